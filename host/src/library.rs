//! Skills that are ready to be followed: the model, and the gate on what is none of them.

use crate::demonstration::Demonstration;
use crate::model::evaluate::{Protocol, leave_one_out};
use crate::model::novelty::{Gate, GateConfig, GateError};
use crate::model::{Dof, Hyperparameters, HyperparametersError, LearnError, Model, Valid, learn};
use crate::session::DOFS;
use tonus_shared::promp::{Basis, BasisError};

/// Basis functions of each DoF: the fastest thing in two seconds takes about a fifth of one.
const BASIS_FUNCTIONS: usize = 20;
/// What is learnt before anything is followed.
#[derive(Debug, Clone, PartialEq)]
pub struct Library {
    /// The skills.
    pub model: Model,
    /// Says what is none of them.
    pub gate: Gate,
    /// Of demonstrations left out in turn, those recognised by the person's signals, and all; none where that was not asked.
    pub held_out: Option<[usize; 2]>,
}

/// Why there is no library.
#[derive(Debug, thiserror::Error)]
pub enum LibraryError {
    /// The hyperparameters.
    #[error(transparent)]
    Hyperparameters(#[from] HyperparametersError),
    /// The basis.
    #[error(transparent)]
    Basis(#[from] BasisError),
    /// The skills.
    #[error(transparent)]
    Learn(#[from] LearnError),
    /// The novelty gate.
    #[error(transparent)]
    Novelty(#[from] GateError),
}

impl Library {
    /// Learns skills and gate from demonstrations of [`DOFS`], in their order. `false_alarm_rate`: share of known movements
    /// that may be held as unknown at any time; less than the demonstrations can show is extrapolated, and lets more pass
    /// that is unknown.
    ///
    /// # Errors
    /// [`LibraryError`]; among others, fewer demonstrations of a skill than the gate needs.
    pub fn learn(
        demonstrations: &[Demonstration],
        false_alarm_rate: f64,
    ) -> Result<Self, LibraryError> {
        let valid = valid(DOFS.len())?;
        let watched = GateConfig {
            throughout: true,
            false_alarm_rate,
            ..GateConfig::of(seen())
        };
        Ok(Self {
            gate: Gate::learn(demonstrations, &valid, &watched)?,
            model: learn(demonstrations, &valid)?,
            held_out: None,
        })
    }

    /// How many demonstrations are recognised by the person's signals when they are left out, and how many there are; none
    /// where a skill has too few to leave one out. Ten observations of a whole movement whose duration is known.
    #[must_use]
    pub fn held_out(demonstrations: &[Demonstration]) -> Option<[usize; 2]> {
        let protocol = Protocol {
            fraction: 1.0,
            ..Protocol::default()
        };
        let persons = demonstrations.iter().map(|demonstration| {
            let values = demonstration.values().get(..seen())?.to_vec();
            let (label, trial) = (demonstration.label(), demonstration.trial());
            let (file, t_s) = (demonstration.file(), demonstration.t_s().to_vec());
            Demonstration::new(label, trial, file, t_s, values).ok()
        });
        let persons = persons.collect::<Option<Vec<_>>>()?;
        let valid = valid(seen()).ok()?;
        let evaluation = leave_one_out(&persons, &valid, &protocol, &mut |_| {}).ok()?;
        Some([evaluation.correct(), evaluation.total()])
    }
}

/// The person's signals; those of the robot are inferred.
fn seen() -> usize {
    DOFS.iter()
        .filter(|name| name.starts_with("human_"))
        .count()
}

/// Hyperparameters of the first `count` signals.
fn valid(count: usize) -> Result<Valid, LibraryError> {
    let dofs = DOFS.iter().take(count).map(|name| {
        if name.contains("_k") {
            Dof::stiffness(*name)
        } else {
            Dof::position(*name)
        }
    });
    let basis = Basis::gaussian(BASIS_FUNCTIONS)?;
    Ok(Hyperparameters::new(dofs.collect(), basis).check()?)
}
