//! Skills learnt from demonstrations: what a model is, how it is learnt, and how good it is.
//!
//! ```text
//! Hyperparameters --check--> Valid --learn(demonstrations)--> Model --> tonus_shared::promp
//! ```
//!
//! Inference is `tonus_shared::promp` alone, the code that runs on the wearable: [`Model::view`] is
//! what it takes. A DoF with [`Transform::Log`] enters the model as the logarithm of its
//! value, so that no inferred stiffness is negative: values go in through [`Dof::encode`] and come out
//! through [`Dof::decode`].

mod assembly;
pub mod calibration;
mod choice;
pub mod cluster;
pub mod compose;
mod dof;
mod em;
pub mod evaluate;
mod first_part;
mod fits;
mod fitted;
mod hyperparameters;
pub mod image;
mod learn;
pub mod novelty;
mod parts;
mod placement;
pub mod recognise;
pub mod reduce;
mod shrinkage;
mod spread;
pub mod stacking;
mod subspace;
pub mod tempo;
mod weights;

pub use dof::{Dof, NotPositive, Transform};
pub use em::{Em, EmConfig, learn_em, run_em};
pub use fits::Fitted;
pub use fitted::{Model, View};
pub use hyperparameters::{Hyperparameters, HyperparametersError, Predictive, Shrinkage, Valid};
pub use learn::{LearnError, extend, fit, learn, learn_fitted};
pub use parts::{Durations, Learner, Parts, PartsError};
pub use spread::{ProbabilityError, Spread};
