//! Section 3.1: one skill that couples reach, stiffness and the robot, asked about motions it has not seen.

mod asked;

use std::collections::BTreeMap;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

use self::asked::{Asked, schemes_of, spread};
use super::bands::robot_stiffness_ranges;
use super::figures::Inference;
use super::look::Look;
use super::tempo::{self, UnknownTempoEnd};
use super::widths::LeftOut;
use super::{Config, ExperimentError, Progress, data};
use crate::demonstration::Demonstration;
use crate::model::recognise::Recogniser;
use crate::model::{Model, learn};
use crate::statistics::rank_correlation;

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
    /// Onset and duration of each pull not announced: where the hand will be at the end, half-way.
    pub unknown_tempo: UnknownTempoEnd,
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
    /// Factor on the model's own intervals, found by leaving one demonstration out: 1 where they were right already.
    pub width_by_dof: BTreeMap<String, f64>,
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

/// One biased observation against several; intervals as the model has them.
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

/// New motions along each of the three cases; as many altogether lie between the cases.
const NEW_EACH: usize = 51;
/// New motions at a tempo of their own.
const PACED: usize = 60;
/// Biased motions along each case.
const BIASED_EACH: usize = 20;
/// Phases that the schemes observe.
const LAST: [f64; 1] = [1.0];
const LAST_FOUR: [f64; 4] = [0.7, 0.8, 0.9, 1.0];
/// Of the new motions, every so many are in the sweeps.
const SWEEP_STRIDE: usize = 3;

/// Runs the experiment.
///
/// The demonstrated cases are one skill: 30 demonstrations, one Gaussian. The tracker has its jitter and no slow
/// bias, but for [`HandOver::believing_in_bias`].
///
/// # Errors
/// [`ExperimentError`] says which part failed.
pub fn run(
    config: &Config,
    progress: &mut dyn FnMut(Progress),
) -> Result<HandOver, ExperimentError> {
    let mut step = 0;
    let mut next = |what| {
        progress(Progress {
            what,
            done: step,
            total: 7,
        });
        step += 1;
    };
    next("hand-over: 30 demonstrations, two passes each");
    let demonstrations = data::hand_over(config)?;
    next("hand-over: new motions");
    let new = data::new_hand_over(NEW_EACH, config)?;
    let six = data::six_hand_overs(config)?;
    let biased = data::biased_hand_over(BIASED_EACH, config)?;
    next("hand-over: learning");
    let model = learn(&demonstrations, &data::hyperparameters()?)?;
    let view = model.view()?;
    let mut asked = Asked {
        recogniser: Recogniser::new(&model, &view)?,
        left_out: LeftOut::learn(&demonstrations, &model, config.seed)?,
        ranges: robot_stiffness_ranges(&demonstrations),
        noise: ChaCha8Rng::seed_from_u64(config.seed),
    };
    next("hand-over: new motions inferred");
    let [a, b, c] = schemes_of();
    let a = asked.scheme(&a, &new)?;
    let b = asked.scheme(&b, &new)?;
    let c = asked.scheme(&c, &new)?;
    let (six_one_by_one, inferences) = asked.one_by_one(&six)?;
    next("hand-over: sweeps");
    let some: Vec<&Demonstration> = new.iter().step_by(SWEEP_STRIDE).collect();
    let by_observations = asked.sweep(&some, (1..=10).map(|n| n as f64), |n, with_semg| {
        Look::at(&spread(n as usize, 0.7, 1.0), with_semg)
    })?;
    let by_fraction = asked.sweep(&some, [0.2, 0.3, 0.5, 1.0].into_iter(), |f, with_semg| {
        Look::at(&LAST_FOUR.map(|phase| f * phase), with_semg)
    })?;
    let noises = (0..=5).map(|cm| f64::from(cm) * 0.01);
    let by_noise_m = asked.sweep(&some, noises, |noise_m, with_semg| {
        Look::at(&LAST_FOUR, with_semg).in_noise(noise_m)
    })?;
    next("hand-over: believing in bias");
    let reach = asked.reach(&new)?;
    next("hand-over: at any tempo");
    let paced = data::paced_hand_over(PACED, tempo::MARGIN_S, config)?;
    let unknown_tempo = tempo::ends(&demonstrations, &paced)?;

    Ok(HandOver {
        a,
        b,
        c,
        six: six_one_by_one,
        reach_stiffness_correlation: rank_correlation(&reach),
        stiffness_y_by_reach: asked.by_reach()?,
        by_observations,
        by_fraction,
        by_noise_m,
        believing_in_bias: asked.bias(&biased)?,
        unknown_tempo,
        figures: Figures {
            demonstrations,
            six,
            inferences,
            model: Some(model.clone()),
        },
    })
}
