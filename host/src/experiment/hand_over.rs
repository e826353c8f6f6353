//! Section 3.1: one skill that couples reach, stiffness and the robot, asked about motions it has not seen.

use std::collections::BTreeMap;

use serde::Serialize;

use super::figures::Inference;
use super::{Config, ExperimentError, Progress};
use crate::demonstration::Demonstration;
use crate::model::Model;

/// What was found.
#[derive(Debug, Clone, Serialize)]
pub struct HandOver {
    /// Hand x-y at 2 s.
    pub a: Scheme,
    /// Hand x-y and stiffness at 2 s.
    pub b: Scheme,
    /// Hand x-y and stiffness at 1.4, 1.6, 1.8 and 2 s.
    pub c: Scheme,
    /// The paper's six new motions, one by one; numbers 2, 4 and 6 lie between the demonstrated cases.
    pub six: Vec<NewMotion>,
    /// Spearman's rank correlation, over all new motions, between reach in y and the stiffness in y at the end that
    /// scheme (a) infers from x-y alone.
    pub reach_stiffness_correlation: f64,
    /// Stiffness in y that scheme (a) infers at the end at five targets from the nearest case to the farthest, N/m.
    pub stiffness_y_by_reach: Vec<Reach>,
    /// Hand x-y and stiffness observed 1 to 10 times, equally spaced over the last third of the movement.
    pub by_observations: Vec<Accuracy>,
    /// Scheme (c) in the first 20, 30, 50, 100 % of the movement.
    pub by_fraction: Vec<Accuracy>,
    /// Schemes (a) and (c) with white noise of 0 to 0.05 m on each observed position, which the model knows of.
    pub by_noise_m: Vec<Accuracy>,
    /// One observation against several when the tracker is wrong by the same 28 mm throughout a movement and the
    /// model does not know: "believing in bias".
    pub believing_in_bias: Bias,
    /// For the report.
    #[serde(skip)]
    pub figures: Figures,
}

/// How good one scheme of observation is, over all new motions.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Scheme {
    /// New motions.
    pub motions: usize,
    /// Of those, between the demonstrated cases.
    pub between: usize,
    /// Median distance between where the robot's hand is inferred to end and where it ended, metres.
    pub end_point_error_m: f64,
    /// Median over motions of the root mean square distance along the robot's path, metres.
    pub path_rmse_m: f64,
    /// Root mean square error of the robot's stiffness over its range in the demonstrations, mean of the three axes.
    pub stiffness_nrmse: f64,
    /// Share of recorded values inside their pointwise 95 % interval, mean of all DoFs.
    pub coverage_95: f64,
    /// The same for each DoF.
    pub coverage_95_by_dof: BTreeMap<String, f64>,
}

/// One of the paper's six motions.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NewMotion {
    /// 1 to 6, as in the paper's figures 10 and 11.
    pub index: usize,
    /// Whether it lies between the demonstrated cases.
    pub between: bool,
    /// Where it was sent: y of the target, shoulder frame, metres.
    pub target_y_m: f64,
    /// Distance of the inferred from the true end of the robot's path for schemes a, b and c, metres.
    pub end_point_error_m: [f64; 3],
    /// Root mean square distance along the robot's path for schemes a, b and c, metres.
    pub path_rmse_m: [f64; 3],
    /// Error of the robot's stiffness over its range for schemes a, b and c.
    pub stiffness_nrmse: [f64; 3],
}

/// Inferred stiffness at one reach.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Reach {
    /// y of the target, shoulder frame, metres.
    pub target_y_m: f64,
    /// Human stiffness in y at the end, N/m.
    pub human_ky_n_per_m: f64,
    /// Robot stiffness in y at the end, N/m.
    pub robot_ky_n_per_m: f64,
}

/// One point of a sweep.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Accuracy {
    /// What is swept.
    pub at: f64,
    /// Median end-point error with position and stiffness observed, metres.
    pub end_point_error_m: f64,
    /// The same with position alone.
    pub end_point_error_without_semg_m: f64,
    /// Mean coverage of the 95 % intervals with position and stiffness observed.
    pub coverage_95: f64,
    /// Error of the robot's stiffness with position and stiffness observed, over its range.
    pub stiffness_nrmse: f64,
    /// The same with position alone.
    pub stiffness_nrmse_without_semg: f64,
}

/// One biased observation against several.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Bias {
    /// Standard deviation of the bias on each axis, metres.
    pub bias_sd_m: f64,
    /// Median over motions of the root mean square distance along the robot's path: x-y at 2 s, metres.
    pub path_rmse_one_m: f64,
    /// The same: x-y at 1.4, 1.6, 1.8 and 2 s.
    pub path_rmse_several_m: f64,
    /// Mean coverage of the 95 % intervals: x-y at 2 s.
    pub coverage_95_one: f64,
    /// The same: x-y at 1.4, 1.6, 1.8 and 2 s.
    pub coverage_95_several: f64,
    /// The same, when the model is told of the bias.
    pub coverage_95_several_told: f64,
}

/// What the report shows beside the numbers.
#[derive(Debug, Clone, Default)]
pub struct Figures {
    /// The 30 demonstrations; trials are named `case 1, 1` to `case 3, 10`.
    pub demonstrations: Vec<Demonstration>,
    /// The paper's six new motions as recorded.
    pub six: Vec<Demonstration>,
    /// `[scheme a, b, c][motion]` (figures 8, 10 and 11).
    pub inferences: Vec<Vec<Inference>>,
    /// The model (figures 2, 3 and 5).
    pub model: Option<Model>,
}

/// Runs the experiment.
///
/// # Errors
/// [`ExperimentError`] says which part failed.
pub fn run(
    _config: &Config,
    _progress: &mut dyn FnMut(Progress),
) -> Result<HandOver, ExperimentError> {
    unimplemented!("lands within the hour")
}
