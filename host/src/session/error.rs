//! What a session refuses.

use tonus_shared::onset::OnsetError;
use tonus_shared::promp::ModelError;

use crate::model::novelty::StreamError;
use crate::model::recognise::RecogniseError;

/// Why a session cannot be had from a model.
#[derive(Debug, thiserror::Error)]
pub enum SessionError {
    /// A column is missing.
    #[error("the model has no degree of freedom `{name}`; it has {}", present.join(", "))]
    MissingDof {
        /// Name of [`super::DOFS`].
        name: &'static str,
        /// What the model has.
        present: Vec<String>,
    },
    /// The model refused an observation or a question.
    #[error(transparent)]
    Recognise(#[from] RecogniseError),
    /// The onset detector refused its configuration or a position.
    #[error(transparent)]
    Onset(#[from] OnsetError),
    /// A novelty gate of another model.
    #[error(
        "the gate looks at `{name}` as number {index}, which the model has not there: learn the gate from the demonstrations of this model"
    )]
    ForeignGate {
        /// The gate's name of the DoF.
        name: String,
        /// The gate's place of it, from 0.
        index: usize,
    },
    /// A novelty gate on what is not observed.
    #[error(
        "the gate looks at `{name}`, which this session does not observe: learn a gate on some of {}", observed.join(", ")
    )]
    Unobserved {
        /// The gate's name of the DoF.
        name: String,
        /// What the session observes.
        observed: Vec<String>,
    },
    /// A novelty gate that cannot be used.
    #[error("this gate cannot watch")]
    Gate(#[from] ModelError),
    /// The novelty gate refused a value.
    #[error(transparent)]
    Novelty(#[from] StreamError),
}
