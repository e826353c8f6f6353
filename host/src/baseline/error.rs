//! What the methods refuse.

use crate::model::recognise::RecogniseError;
use crate::model::{LearnError, NotPositive};
use tonus_shared::promp::{ModelError, RowError};

/// Why a method could not be learnt or asked.
#[derive(Debug, thiserror::Error)]
pub enum BaselineError {
    /// Nothing to learn from or to test on.
    #[error("no demonstrations to {0}")]
    None(&'static str),
    /// A demonstration with another number of DoFs than the protocol names.
    #[error("a demonstration of `{label}` has {got} DoFs, the protocol names {expected}")]
    Dofs {
        /// Its label.
        label: String,
        /// DoFs of the protocol.
        expected: usize,
        /// Its DoFs.
        got: usize,
    },
    /// A protocol that asks for what there is not.
    #[error("{what}: give {wanted}")]
    Protocol {
        /// What is wrong.
        what: &'static str,
        /// What would be right.
        wanted: &'static str,
    },
    /// A value without a logarithm.
    #[error(transparent)]
    NotPositive(#[from] NotPositive),
    /// Learning movement primitives.
    #[error(transparent)]
    Learn(#[from] LearnError),
    /// Inference with movement primitives.
    #[error(transparent)]
    Recognise(#[from] RecogniseError),
    /// The basis.
    #[error(transparent)]
    Row(#[from] RowError),
    /// A model's view.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// A factorisation failed.
    #[error("the {0} failed: check the demonstrations for DoFs that never vary")]
    Numerical(&'static str),
}
