//! Skills that are ready to be followed: the model, and the gate on what is none of them.

use std::path::{Path, PathBuf};

use crate::demonstration::Demonstration;
use crate::model::evaluate::{Protocol, leave_one_out};
use crate::model::novelty::{Gate, GateConfig, GateError};
use crate::model::{Dof, Hyperparameters, HyperparametersError, LearnError, Model, Valid, learn};
use crate::session::DOFS;
use crate::store::{self, ContentError, StoreError};
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
    /// The file.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// What was recorded as one.
    #[error("what was recorded as a model: {0}")]
    Content(#[from] ContentError),
    /// A model without a gate.
    #[error(
        "{}: it has no novelty gate, so nothing would be held as unknown: learn it by `tonus train --live` or in `tonus run`",
        file.display()
    )]
    NoGate {
        /// The file.
        file: PathBuf,
    },
    /// A model of other signals.
    #[error(
        "{}: a model of {found:?} cannot be followed, which takes {DOFS:?}: learn it by `tonus train --live`",
        file.display()
    )]
    Dofs {
        /// The file.
        file: PathBuf,
        /// Its signals.
        found: Vec<String>,
    },
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

    /// The skills of a model file with a gate.
    ///
    /// # Errors
    /// [`LibraryError`]: no model file, a model without a gate, or of other signals than [`DOFS`].
    pub fn load(file: &Path) -> Result<Self, LibraryError> {
        let (model, gate) = store::load_gated(file)?;
        Self::of(model, gate, file)
    }

    /// The skills out of the bytes of such a file; `file` names them in errors.
    ///
    /// # Errors
    /// As [`Library::load`].
    pub fn from_bytes(bytes: &[u8], file: &Path) -> Result<Self, LibraryError> {
        let (model, gate) = store::from_bytes(bytes)?;
        Self::of(model, gate, file)
    }

    fn of(model: Model, gate: Option<Gate>, file: &Path) -> Result<Self, LibraryError> {
        let file = file.to_owned();
        if !model.dofs().iter().map(|dof| &dof.name).eq(DOFS) {
            let found = model.dofs().iter().map(|dof| dof.name.clone()).collect();
            return Err(LibraryError::Dofs { file, found });
        }
        let gate = gate.ok_or(LibraryError::NoGate { file })?;
        Ok(Self {
            model,
            gate,
            held_out: None,
        })
    }

    /// Writes the model file, replacing what was there only once the new one is whole.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn save(&self, file: &Path) -> Result<(), StoreError> {
        store::save(&self.model, Some(&self.gate), file)
    }

    /// The bytes of the model file. The same library gives the same bytes.
    ///
    /// # Errors
    /// A header larger than the format allows.
    pub fn to_bytes(&self) -> Result<Vec<u8>, ContentError> {
        store::to_bytes(&self.model, Some(&self.gate))
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
