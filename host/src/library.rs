//! Skills that are ready to be followed: the model, and the gate on what is none of them.

use crate::demonstration::Demonstration;
use crate::model::novelty::{Gate, GateConfig, GateError};
use crate::model::{Dof, Hyperparameters, HyperparametersError, LearnError, Model, learn};
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
        let dofs = DOFS.iter().map(|name| {
            if name.contains("_k") {
                Dof::stiffness(*name)
            } else {
                Dof::position(*name)
            }
        });
        let basis = Basis::gaussian(BASIS_FUNCTIONS)?;
        let valid = Hyperparameters::new(dofs.collect(), basis).check()?;
        // The person's signals; those of the robot are inferred.
        let seen = DOFS
            .iter()
            .filter(|name| name.starts_with("human_"))
            .count();
        let watched = GateConfig {
            throughout: true,
            false_alarm_rate,
            ..GateConfig::of(seen)
        };
        Ok(Self {
            gate: Gate::learn(demonstrations, &valid, &watched)?,
            model: learn(demonstrations, &valid)?,
        })
    }
}
