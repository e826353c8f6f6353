//! Whether the movement under way is one of the library: the novelty gate on what the session sees.

use tonus_shared::promp::WatchError;

use super::SessionError;
use super::follower::Reading;
use crate::model::Model;
use crate::model::novelty::{Gate, GateStream, StreamError};

/// Longest part of a movement that may pass between two samples of a signal. The gate takes what it missed to be on the line
/// between them, which a hand leaves the more, the longer nobody looks.
const LONGEST_GAP: f64 = 0.35;

/// What the novelty gate says of the movement under way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoveltyReport<'m> {
    /// Mean surprise about what was seen so far, against the demonstration that is the least surprised.
    pub score: f64,
    /// The score above which a movement is none of the library's.
    pub threshold: f64,
    /// Whether the score has been above its threshold at any time in this movement.
    pub unknown: bool,
    /// Class of the least surprised demonstration: what to take this movement for, if it must be something.
    pub nearest: &'m str,
    /// Distance from it, in standard deviations of one performance from another.
    pub distance: f64,
}

/// The gate's judgement of one movement. What is unknown once stays unknown until the movement ends: a score that
/// falls again has been diluted by what looks familiar, and the robot's way until then was made of nothing known.
/// After a gap longer than [`LONGEST_GAP`] the movement is not judged further; what was said of it stands, and what was not
/// said is missing until it ends: [`Watchman::missed`].
#[derive(Debug)]
pub(super) struct Watchman<'m> {
    gate: &'m Gate,
    stream: GateStream<'m>,
    /// Where each of the gate's DoFs was last seen.
    phases: Vec<Option<f64>>,
    unknown: bool,
    /// A signal was missed for too long.
    missed: bool,
}

impl<'m> Watchman<'m> {
    /// `observed`: names of what the session observes.
    pub(super) fn new(
        gate: &'m Gate,
        model: &Model,
        observed: &[&str],
    ) -> Result<Self, SessionError> {
        for (index, dof) in &gate.parts().dofs {
            if model.dofs().get(*index) != Some(dof) {
                let (name, index) = (dof.name.clone(), *index);
                return Err(SessionError::ForeignGate { name, index });
            }
            if !observed.contains(&dof.name.as_str()) {
                let name = dof.name.clone();
                let observed = observed.iter().map(|&name| name.to_owned()).collect();
                return Err(SessionError::Unobserved { name, observed });
            }
        }
        Ok(Self {
            gate,
            stream: gate.stream()?,
            phases: vec![None; gate.parts().dofs.len()],
            unknown: false,
            missed: false,
        })
    }

    /// Another movement begins.
    pub(super) fn reset(&mut self) {
        self.stream.reset();
        self.phases.fill(None);
        self.unknown = false;
        self.missed = false;
    }

    /// Looks at what a sensor saw at a phase of the movement. A phase that is not after the last one tells nothing: packets overtake each other, and an estimated phase may fall.
    ///
    /// # Errors
    /// A value that the gate refuses; it goes on without it.
    pub(super) fn look(&mut self, phase: f64, readings: &[Reading]) -> Result<(), StreamError> {
        for &(dof, value, _) in readings {
            let mut dofs = self.gate.parts().dofs.iter();
            let Some(place) = dofs.position(|(index, _)| *index == dof) else {
                continue;
            };
            let last = &mut self.phases[place];
            if last.is_some_and(|last| phase <= last) {
                continue;
            }
            self.missed |= phase - last.unwrap_or(0.0) > LONGEST_GAP;
            if self.missed {
                return Ok(());
            }
            match self.stream.observe(dof, phase, value) {
                Ok(()) => *last = Some(phase),
                // Farther from all that is known than a number can say.
                Err(StreamError::Watch(WatchError::Overflow { .. })) => self.unknown = true,
                Err(refused) => return Err(refused),
            }
            self.unknown |= self
                .stream
                .novelty()
                .is_some_and(|novelty| novelty.unknown());
        }
        Ok(())
    }

    pub(super) fn unknown(&self) -> bool {
        self.unknown
    }

    /// Whether the movement can no longer be judged.
    pub(super) fn missed(&self) -> bool {
        self.missed
    }

    /// `None` before the first instant of the gate was seen.
    pub(super) fn report(&self) -> Option<NoveltyReport<'m>> {
        let novelty = self.stream.novelty()?;
        Some(NoveltyReport {
            score: novelty.score,
            threshold: novelty.threshold,
            unknown: self.unknown,
            nearest: self.gate.classes().get(novelty.nearest)?,
            distance: novelty.distance,
        })
    }
}
