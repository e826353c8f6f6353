//! A movement as it comes in: samples at any phase, brought to the gate's instants.

use tonus_shared::promp::{Novelty, Watch, WatchError};

use super::Gate;
use crate::model::NotPositive;

/// A sample that a gate refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StreamError {
    /// A DoF that the gate does not look at.
    #[error("the gate does not look at DoF number {dof}")]
    Dof {
        /// The DoF, from 0.
        dof: usize,
    },
    /// A phase that is no number or not after the DoF's last.
    #[error("phase {phase} does not come after the one before it: observe each DoF in order")]
    Phase {
        /// The phase.
        phase: f64,
    },
    /// A value without a logarithm.
    #[error(transparent)]
    NotPositive(#[from] NotPositive),
    /// A value that cannot be judged.
    #[error(transparent)]
    Watch(#[from] WatchError),
}

/// One movement against a gate. Keeps each DoF's last sample and its values at the instants: bounded by the gate.
#[derive(Clone, Debug)]
pub struct GateStream<'g> {
    gate: &'g Gate,
    watch: Watch<'g, f64, Vec<f64>>,
    /// Last sample of each DoF: phase and value as it enters the model.
    last: Vec<Option<(f64, f64)>>,
    /// Values of each DoF at the instants passed.
    passed: Vec<Vec<f64>>,
}

impl<'g> GateStream<'g> {
    pub(super) fn new(gate: &'g Gate, watch: Watch<'g, f64, Vec<f64>>) -> Self {
        let dofs = gate.parts().dofs.len();
        let instants = gate.parts().phases.len();
        Self {
            gate,
            watch,
            last: vec![None; dofs],
            passed: vec![Vec::with_capacity(instants); dofs],
        }
    }

    /// Forgets everything, for the next movement.
    pub fn reset(&mut self) {
        self.watch.reset();
        self.last.fill(None);
        for passed in &mut self.passed {
            passed.clear();
        }
    }

    /// A sample of the DoF number `dof` of the model, in its unit. Instants between it and the DoF's last sample take
    /// their value on the line between the two; instants before the first sample take that sample's.
    ///
    /// # Errors
    /// [`StreamError`]; the stream is as before then.
    pub fn observe(&mut self, dof: usize, phase: f64, value: f64) -> Result<(), StreamError> {
        let parts = self.gate.parts();
        let place = parts.dofs.iter().position(|(index, _)| *index == dof);
        let place = place.ok_or(StreamError::Dof { dof })?;
        let last = self.last[place];
        if !phase.is_finite() || last.is_some_and(|(before, _)| phase <= before) {
            return Err(StreamError::Phase { phase });
        }
        let value = parts.dofs[place].1.encode(value)?;
        if !value.is_finite() {
            return Err(StreamError::Watch(WatchError::Value { value }));
        }
        let kept = self.passed[place].len();
        for &instant in parts.phases[kept..].iter().take_while(|p| **p <= phase) {
            let at = last.map_or(value, |(before, from)| {
                from + (instant - before) / (phase - before) * (value - from)
            });
            self.passed[place].push(at);
        }
        self.last[place] = Some((phase, value));
        self.judge()
    }

    /// Hands on every row whose turn it is.
    fn judge(&mut self) -> Result<(), StreamError> {
        let dofs = self.passed.len();
        while self.watch.seen() < self.watch_rows() {
            let row = self.watch.seen();
            let Some(&value) = self.passed[row % dofs].get(row / dofs) else {
                break;
            };
            self.watch.observe(value)?;
        }
        Ok(())
    }

    fn watch_rows(&self) -> usize {
        self.gate.parts().thresholds.len()
    }

    /// The answer so far, `None` before the first instant has been seen.
    #[must_use]
    pub fn novelty(&self) -> Option<Novelty<f64>> {
        self.watch.novelty()
    }
}
