//! Section 3.1: one skill that couples reach, stiffness and the robot, asked about motions it has not seen.

use std::collections::BTreeMap;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

use super::bands::{Errors, figure, infer, robot_stiffness_ranges};
use super::figures::{Inference, Observed};
use super::look::{HAND, HAND_STIFFNESS, Look, ROBOT, ROBOT_STIFFNESS};
use super::statistics::{mean, median, rank_correlation, root_mean_square};
use super::widths::{LeftOut, NOMINAL, Widths};
use super::{Config, ExperimentError, Progress, data};
use crate::demonstration::Demonstration;
use crate::model::recognise::Recogniser;
use crate::model::{Model, learn};
use crate::session::DOFS;
use crate::simulate::skills::pull_target_m;
use crate::simulate::tracker::TrackerNoise;

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
            total: 6,
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
        figures: Figures {
            demonstrations,
            six,
            inferences,
            model: Some(model.clone()),
        },
    })
}

/// x and y of the hand alone: the movement is in that plane.
fn in_plane(look: Look) -> Look {
    let dofs = look.dofs.into_iter().filter(|&dof| dof != HAND[2]);
    Look {
        dofs: dofs.collect(),
        ..look
    }
}

/// Schemes (a), (b), (c).
fn schemes_of() -> [Look; 3] {
    [
        in_plane(Look::at(&LAST, false)),
        in_plane(Look::at(&LAST, true)),
        in_plane(Look::at(&LAST_FOUR, true)),
    ]
}

/// `count` phases equally spaced from `from` to `to`; a single one is at the end.
fn spread(count: usize, from: f64, to: f64) -> Vec<f64> {
    let step = (to - from) / count.saturating_sub(1).max(1) as f64;
    (0..count).rev().map(|n| to - step * n as f64).collect()
}

/// A model that is asked about movements.
struct Asked<'m> {
    recogniser: Recogniser<'m>,
    left_out: LeftOut<'m>,
    ranges: [f64; 3],
    noise: ChaCha8Rng,
}

impl Asked<'_> {
    /// There is one skill, number 0.
    fn errors<'d>(
        &mut self,
        look: &Look,
        widths: &Widths,
        movements: impl IntoIterator<Item = &'d Demonstration>,
    ) -> Result<Vec<Errors>, ExperimentError> {
        let mut one = |movement: &Demonstration| {
            look.observe(&mut self.recogniser, &look.of(movement, &mut self.noise))?;
            let bands = infer(&mut self.recogniser, (0, widths), movement)?;
            Ok(Errors::of(&bands, &self.ranges))
        };
        movements.into_iter().map(&mut one).collect()
    }

    /// With intervals as wide as the demonstrations ask for.
    fn all<'d>(
        &mut self,
        look: &Look,
        movements: impl IntoIterator<Item = &'d Demonstration>,
    ) -> Result<Vec<Errors>, ExperimentError> {
        let widths = self.left_out.widths(look)?;
        self.errors(look, &widths, movements)
    }

    fn scheme(&mut self, look: &Look, new: &[Demonstration]) -> Result<Scheme, ExperimentError> {
        let widths = self.left_out.widths(look)?;
        let errors = self.errors(look, &widths, new)?;
        let between = new.iter().filter(|d| d.trial().starts_with("between"));
        let covered = std::array::from_fn(|dof| {
            mean(&errors.iter().map(|e| e.covered[dof]).collect::<Vec<_>>())
        });
        Ok(Scheme {
            motions: new.len(),
            between: between.count(),
            end_point_error_m: of(&errors, |e| e.end_point_m, median),
            path_rmse_m: of(&errors, |e| e.path_m, median),
            stiffness_nrmse: of(&errors, |e| e.stiffness, root_mean_square),
            coverage_95: of(&errors, Errors::coverage, mean),
            coverage_95_by_dof: by_dof(&covered),
            width_by_dof: by_dof(&widths),
        })
    }

    /// The six motions under each scheme, as numbers and as figures.
    fn one_by_one(
        &mut self,
        six: &[Demonstration],
    ) -> Result<(Vec<NewMotion>, Vec<Vec<Inference>>), ExperimentError> {
        let mut inferences = vec![Vec::new(); 3];
        let mut motions = Vec::with_capacity(six.len());
        let looks = schemes_of();
        let widths = looks.iter().map(|look| self.left_out.widths(look));
        let widths = widths.collect::<Result<Vec<_>, _>>()?;
        for (index, movement) in (1..).zip(six) {
            let mut errors = Vec::with_capacity(3);
            for (scheme, shown) in inferences.iter_mut().enumerate() {
                let (look, name) = (&looks[scheme], ["a", "b", "c"][scheme]);
                let observed = look.of(movement, &mut self.noise);
                look.observe(&mut self.recogniser, &observed)?;
                let bands = infer(&mut self.recogniser, (0, &widths[scheme]), movement)?;
                errors.push(Errors::of(&bands, &self.ranges));
                let name = format!("motion {index} ({}), scheme {name}", movement.trial());
                shown.push(figure(name, movement.label(), movement, (&observed, bands)));
            }
            let each = |of: fn(&Errors) -> f64| std::array::from_fn(|scheme| of(&errors[scheme]));
            motions.push(NewMotion {
                index,
                between: movement.trial().starts_with("between"),
                target_y_m: target_y_m(movement),
                end_point_error_m: each(|e| e.end_point_m),
                path_rmse_m: each(|e| e.path_m),
                stiffness_nrmse: each(|e| e.stiffness),
            });
        }
        Ok((motions, inferences))
    }

    fn sweep(
        &mut self,
        movements: &[&Demonstration],
        points: impl Iterator<Item = f64>,
        look: impl Fn(f64, bool) -> Look,
    ) -> Result<Vec<Accuracy>, ExperimentError> {
        let mut point = |at| {
            let with = self.all(&in_plane(look(at, true)), movements.iter().copied())?;
            let without = self.all(&in_plane(look(at, false)), movements.iter().copied())?;
            Ok(Accuracy {
                at,
                end_point_error_m: of(&with, |e| e.end_point_m, median),
                end_point_error_without_semg_m: of(&without, |e| e.end_point_m, median),
                coverage_95: of(&with, Errors::coverage, mean),
                stiffness_nrmse: of(&with, |e| e.stiffness, root_mean_square),
                stiffness_nrmse_without_semg: of(&without, |e| e.stiffness, root_mean_square),
            })
        };
        points.map(&mut point).collect()
    }

    /// Reach in y, and human stiffness in y at the end inferred from x-y alone, of every motion.
    fn reach(&mut self, new: &[Demonstration]) -> Result<Vec<(f64, f64)>, ExperimentError> {
        let [look, _, _] = schemes_of();
        let one = |movement: &Demonstration| {
            look.observe(&mut self.recogniser, &look.of(movement, &mut self.noise))?;
            let stiffness = self.recogniser.predict(0, HAND_STIFFNESS[1], 1.0)?;
            Ok((target_y_m(movement), stiffness.mean))
        };
        new.iter().map(one).collect()
    }

    /// The same along the middle of the lines, for the table.
    fn by_reach(&mut self) -> Result<Vec<Reach>, ExperimentError> {
        let [look, _, _] = schemes_of();
        let mut at = |case: f64| {
            let target_m = pull_target_m(case);
            let observed = look.dofs.iter().map(|&dof| Observed {
                dof,
                phase: 1.0,
                value: target_m[dof],
            });
            look.observe(&mut self.recogniser, &observed.collect::<Vec<_>>())?;
            Ok(Reach {
                target_y_m: target_m[1],
                human_ky_n_per_m: self.recogniser.predict(0, HAND_STIFFNESS[1], 1.0)?.mean,
                robot_ky_n_per_m: self.recogniser.predict(0, ROBOT_STIFFNESS[1], 1.0)?.mean,
            })
        };
        [0.0, 0.5, 1.0, 1.5, 2.0].into_iter().map(&mut at).collect()
    }

    fn bias(&mut self, biased: &[Demonstration]) -> Result<Bias, ExperimentError> {
        let bias_sd_m = TrackerNoise::STATED.bias_sd_m;
        let one = self.errors(&in_plane(Look::at(&LAST, false)), &NOMINAL, biased)?;
        let several = in_plane(Look::at(&LAST_FOUR, false));
        let told = Look {
            doubt_m: bias_sd_m * libm::sqrt(LAST_FOUR.len() as f64),
            ..several.clone()
        };
        let several = self.errors(&several, &NOMINAL, biased)?;
        let told = self.errors(&told, &NOMINAL, biased)?;
        Ok(Bias {
            bias_sd_m,
            path_rmse_one_m: of(&one, |e| e.path_m, median),
            path_rmse_several_m: of(&several, |e| e.path_m, median),
            coverage_95_one: of(&one, robot_coverage, mean),
            coverage_95_several: of(&several, robot_coverage, mean),
            coverage_95_several_told: of(&told, robot_coverage, mean),
        })
    }
}

fn by_dof(values: &Widths) -> BTreeMap<String, f64> {
    let named = DOFS.iter().zip(values);
    named
        .map(|(name, value)| ((*name).to_owned(), *value))
        .collect()
}

/// Of the robot's position: the person's is recorded with the bias.
fn robot_coverage(errors: &Errors) -> f64 {
    mean(&ROBOT.map(|dof| errors.covered[dof]))
}

fn of(errors: &[Errors], figure: fn(&Errors) -> f64, over: fn(&[f64]) -> f64) -> f64 {
    over(&errors.iter().map(figure).collect::<Vec<_>>())
}

/// Where the hand was sent, from the line's name; NaN of another name.
fn target_y_m(movement: &Demonstration) -> f64 {
    let line = movement
        .trial()
        .split_once(' ')
        .map(|(_, line)| line.parse::<f64>());
    match line {
        Some(Ok(line)) => pull_target_m(line - 1.0)[1],
        _ => f64::NAN,
    }
}
