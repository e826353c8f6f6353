//! What recognition refuses.

use thiserror::Error;

use crate::onset::OnsetError;
use crate::promp::{BankError, ModelError};

/// A model, an observation or an answer that was refused; the movement under way goes on.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum RecognitionError {
    /// A model without the human's stiffness.
    #[error("the model has no stiffness of the human along every axis: export one that has")]
    NoStiffness,
    /// A stiffness without a logarithm, or a predicted one that no packet holds.
    #[error("the stiffness along axis {axis} is {value} N/m: it must be positive and finite")]
    Stiffness {
        /// 0 to 2.
        axis: usize,
        /// The stiffness, N/m.
        value: f32,
    },
    /// A model that inference refused.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// A hypothesis or an observation that the bank refused.
    #[error(transparent)]
    Bank(#[from] BankError),
    /// A position that the onset detector refused.
    #[error(transparent)]
    Onset(#[from] OnsetError),
}
