//! Section 3.2: three objects that nearly the same hand path lifts, told apart by the muscles.

use serde::Serialize;

use super::figures::{Envelopes, Inference, Trace};
use super::{Config, ExperimentError, Progress, Score, Sweeps};
use crate::demonstration::Demonstration;
use crate::model::Model;

/// What was found.
#[derive(Debug, Clone, Serialize)]
pub struct ObjectMatching {
    /// New trials, ten observations of hand position and stiffness.
    pub with_semg: Score,
    /// The same from positions alone.
    pub without_semg: Score,
    /// Share of the trials that the best possible recogniser from positions gets right: it knows the simulator's
    /// true densities and sees every frame.
    pub best_possible_without_semg: f64,
    /// The demonstrations themselves, with sEMG: what the paper reports, and no accuracy.
    pub training: Score,
    /// Root mean square error of the inferred robot stiffness, where the object was recognised, over the range of the
    /// demonstrated one; mean of the three axes.
    pub robot_stiffness_nrmse: f64,
    /// The same from positions alone, right or wrong.
    pub robot_stiffness_nrmse_without_semg: f64,
    /// Root mean square distance along the robot's path where the object was recognised, metres.
    pub robot_path_rmse_m: f64,
    /// Share of the recorded values inside their pointwise 95 % interval, all DoFs, where recognised.
    pub coverage_95: f64,
    /// Over what is observed.
    #[serde(flatten)]
    pub sweeps: Sweeps,
    /// One biased tracker, one observation (the last) against ten: `[one, ten]`, position and stiffness.
    pub one_against_ten: [Score; 2],
    /// For the report.
    #[serde(skip)]
    pub figures: Figures,
}

/// What the report shows beside the numbers.
#[derive(Debug, Clone, Default)]
pub struct Figures {
    /// The 30 demonstrations (figure 12).
    pub demonstrations: Vec<Demonstration>,
    /// One new trial of each object, as inferred with sEMG (figure 13, middle).
    pub with_semg: Vec<Inference>,
    /// The same trials, inferred from positions alone (figure 13, right).
    pub without_semg: Vec<Inference>,
    /// Recognition of those trials over time, with sEMG.
    pub traces: Vec<Trace>,
    /// Raw sEMG and envelopes of one lift of each object (figure 4).
    pub envelopes: Vec<Envelopes>,
    /// The model.
    pub model: Option<Model>,
}

/// Runs the experiment.
///
/// # Errors
/// [`ExperimentError`] says which part failed.
pub fn run(
    _config: &Config,
    _progress: &mut dyn FnMut(Progress),
) -> Result<ObjectMatching, ExperimentError> {
    unimplemented!("lands within the hour")
}
