//! The three experiments of the paper's section 3 on the simulated wearer, and the same questions to real recordings.
//!
//! ```text
//! data (wearer -> sEMG -> packets -> demonstrations) --> model --> hand_over | object_matching | pick_and_place
//! ```
//!
//! Everything that is learnt from or tested on has gone through the wearable's pipeline, packets of which 5 %
//! are lost, and the tracker. Accuracy is on movements that were held out unless a field says `training`.
//! Duration and start of each movement are known (an oracle) unless a field says `unknown_tempo`.

mod bands;
pub mod baselines;
pub mod data;
pub mod figures;
pub mod hand_over;
mod look;
pub mod object_matching;
pub mod pick_and_place;
pub mod recordings;
pub mod tempo;
mod widths;

use std::path::PathBuf;

use serde::Serialize;
use serde_json::Value;

use crate::baseline::BaselineError;
use crate::demonstration::{DemonstrationError, ReadError};
use crate::model::calibration::CalibrationError;
use crate::model::cluster::ClusterError;
use crate::model::evaluate::EvaluateError;
use crate::model::novelty::GateError;
use crate::model::recognise::RecogniseError;
use crate::model::stacking::StackError;
use crate::model::{HyperparametersError, LearnError};
use crate::simulate::difficulty::DensityError;
use crate::simulate::operator::OperatorError;
use crate::simulate::rig::RigError;
use crate::statistics;
use crate::table::TableError;
use tonus_shared::onset::OnsetError;
use tonus_shared::promp::{BasisError, ModelError};

/// Basis functions of each DoF in every experiment (section 3.1).
pub const BASIS_FUNCTIONS: usize = 30;

/// What the experiments are run with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Config {
    /// Everything random follows from it.
    pub seed: u64,
    /// Share of packets that each link loses.
    pub loss: f64,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            seed: 1,
            loss: 0.05,
        }
    }
}

/// What was found with one seed; an experiment that was not asked for is none.
#[derive(Debug, Clone, Serialize)]
pub struct Results {
    /// The seed, so that anybody can repeat it.
    pub seed: u64,
    /// Section 3.1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hand_over: Option<hand_over::HandOver>,
    /// Section 3.2.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub object_matching: Option<object_matching::ObjectMatching>,
    /// Section 3.3.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pick_and_place: Option<pick_and_place::PickAndPlace>,
    /// Recordings of real people by others.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub recordings: Option<recordings::Recordings>,
    /// Other methods on the same data.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub baselines: Option<baselines::Baselines>,
}

/// Answers counted.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Score {
    /// Right answers.
    pub correct: usize,
    /// Answers.
    pub total: usize,
    /// Share of right ones.
    pub accuracy: f64,
    /// Mean of minus the natural logarithm of the probability given to the right answer, nats.
    pub log_loss: f64,
}

/// One point of a sweep, with all human signals and with positions alone.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Point {
    /// What is swept: a share of the movement, a number of observations, or metres of noise.
    pub at: f64,
    /// Hand position and stiffness observed.
    pub with_semg: Score,
    /// Hand position alone.
    pub without_semg: Score,
}

/// Recognition over what is observed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Sweeps {
    /// Ten observations in the first 20, 30, 50, 100 % of the movement.
    pub by_fraction: Vec<Point>,
    /// 1 to 10 observations equally spaced over the whole movement.
    pub by_observations: Vec<Point>,
    /// White noise of 0 to 0.05 m added to each observed position; the recogniser knows of it.
    pub by_noise_m: Vec<Point>,
}

/// How far an experiment is: what it does, how much of it is done, and how much there is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// What is being done.
    pub what: &'static str,
    /// Parts done.
    pub done: u64,
    /// Parts.
    pub total: u64,
}

/// Why an experiment cannot go on.
#[derive(Debug, thiserror::Error)]
pub enum ExperimentError {
    /// The simulated wearer.
    #[error(transparent)]
    Rig(#[from] RigError),
    /// The operator's second pass.
    #[error(transparent)]
    Operator(#[from] OperatorError),
    /// A recorded demonstration.
    #[error("movement {trial} of a simulated sitting was not recorded: {source}")]
    Demonstration {
        /// Its place in the sitting, from 0.
        trial: usize,
        /// Why.
        source: DemonstrationError,
    },
    /// The hyperparameters.
    #[error(transparent)]
    Hyperparameters(#[from] HyperparametersError),
    /// The basis.
    #[error(transparent)]
    Basis(#[from] BasisError),
    /// Learning.
    #[error(transparent)]
    Learn(#[from] LearnError),
    /// Another method.
    #[error(transparent)]
    Baseline(#[from] BaselineError),
    /// The onset of a movement.
    #[error(transparent)]
    Onset(#[from] OnsetError),
    /// Clustering.
    #[error(transparent)]
    Cluster(#[from] ClusterError),
    /// Inference.
    #[error(transparent)]
    Recognise(#[from] RecogniseError),
    /// The model's view.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// A novelty gate.
    #[error(transparent)]
    Gate(#[from] GateError),
    /// Calibration.
    #[error(transparent)]
    Calibration(#[from] CalibrationError),
    /// Settings that cannot be mixed.
    #[error(transparent)]
    Stacking(#[from] StackError),
    /// A recorded movement of which too little can be used.
    #[error("{}: trial {trial}, rows in which the hand is seen and moves: {source}", file.display())]
    Recording {
        /// The file.
        file: PathBuf,
        /// The trial.
        trial: String,
        /// Why.
        source: DemonstrationError,
    },
    /// The simulator's own densities.
    #[error(transparent)]
    Density(#[from] DensityError),
    /// A recording of which a part is missing.
    #[error("{}: {found} movements of {expected}: copy the whole recording there", folder.display())]
    Movements {
        /// The folder of its tables.
        folder: PathBuf,
        /// Movements found.
        found: usize,
        /// Movements that it was published with.
        expected: usize,
    },
    /// A folder of recordings that is not there.
    #[error(
        "{}: no recording can be read there; give the folder that holds all three recordings",
        folder.display()
    )]
    Folder {
        /// The folder.
        folder: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// Evaluation.
    #[error(transparent)]
    Evaluate(#[from] EvaluateError),
    /// A recording that cannot be opened.
    #[error(transparent)]
    Table(#[from] TableError),
    /// A recording that holds no demonstrations.
    #[error(transparent)]
    Read(#[from] ReadError),
}

impl Results {
    /// Nothing found yet.
    #[must_use]
    pub fn of(seed: u64) -> Self {
        Self {
            seed,
            hand_over: None,
            object_matching: None,
            pick_and_place: None,
            recordings: None,
            baselines: None,
        }
    }
}

/// Documents of one shape, number by number averaged; what is no number is the first one's. Numbers that are the
/// same everywhere stay what they are.
#[must_use]
pub fn mean_of(documents: &[Value]) -> Value {
    let Some(first) = documents.first() else {
        return Value::Null;
    };
    let below = |of: &dyn Fn(&Value) -> Option<Value>| -> Value {
        mean_of(&documents.iter().filter_map(of).collect::<Vec<_>>())
    };
    match first {
        Value::Object(keys) => {
            let one = |key: &String| (key.clone(), below(&|d| d.get(key).cloned()));
            Value::Object(keys.keys().map(one).collect())
        }
        Value::Array(items) => {
            let one = |index: usize| below(&|d| d.get(index).cloned());
            Value::Array((0..items.len()).map(one).collect())
        }
        Value::Number(_) if documents.iter().any(|d| d != first) => {
            let numbers: Vec<f64> = documents.iter().filter_map(Value::as_f64).collect();
            Value::from(statistics::mean(&numbers))
        }
        other => other.clone(),
    }
}

impl Score {
    /// From the log probability of the right answer and whether it was given, one by one.
    #[must_use]
    pub fn of(answers: impl IntoIterator<Item = (f64, bool)>) -> Self {
        let mut score = Self::default();
        let mut loss = 0.0;
        for (log_probability, right) in answers {
            score.total += 1;
            score.correct += usize::from(right);
            loss -= log_probability;
        }
        let total = score.total.max(1) as f64;
        score.accuracy = score.correct as f64 / total;
        score.log_loss = loss / total;
        score
    }
}
