//! The model of the hand-over, asked about motions under each scheme of observation.

use std::collections::BTreeMap;

use rand_chacha::ChaCha8Rng;

use super::{Accuracy, Bias, LAST, LAST_FOUR, NewMotion, Reach, Scheme};
use crate::demonstration::Demonstration;
use crate::experiment::ExperimentError;
use crate::experiment::bands::{Errors, figure, infer};
use crate::experiment::figures::{Inference, Observed};
use crate::experiment::look::{HAND, HAND_STIFFNESS, Look, ROBOT, ROBOT_STIFFNESS};
use crate::experiment::widths::{LeftOut, NOMINAL, Widths};
use crate::model::recognise::Recogniser;
use crate::session::DOFS;
use crate::simulate::skills::pull_target_m;
use crate::simulate::tracker::TrackerNoise;
use crate::statistics::{mean, median, root_mean_square};

/// x and y of the hand alone: the movement is in that plane.
fn in_plane(look: Look) -> Look {
    let dofs = look.dofs.into_iter().filter(|&dof| dof != HAND[2]);
    Look {
        dofs: dofs.collect(),
        ..look
    }
}

/// Schemes (a), (b), (c).
pub(super) fn schemes_of() -> [Look; 3] {
    [
        in_plane(Look::at(&LAST, false)),
        in_plane(Look::at(&LAST, true)),
        in_plane(Look::at(&LAST_FOUR, true)),
    ]
}

/// `count` phases equally spaced from `from` to `to`; a single one is at the end.
pub(super) fn spread(count: usize, from: f64, to: f64) -> Vec<f64> {
    let step = (to - from) / count.saturating_sub(1).max(1) as f64;
    (0..count).rev().map(|n| to - step * n as f64).collect()
}

/// A model that is asked about movements.
pub(super) struct Asked<'m> {
    pub(super) recogniser: Recogniser<'m>,
    pub(super) left_out: LeftOut<'m>,
    pub(super) ranges: [f64; 3],
    pub(super) noise: ChaCha8Rng,
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

    pub(super) fn scheme(
        &mut self,
        look: &Look,
        new: &[Demonstration],
    ) -> Result<Scheme, ExperimentError> {
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
    pub(super) fn one_by_one(
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

    pub(super) fn sweep(
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
    pub(super) fn reach(
        &mut self,
        new: &[Demonstration],
    ) -> Result<Vec<(f64, f64)>, ExperimentError> {
        let [look, _, _] = schemes_of();
        let one = |movement: &Demonstration| {
            look.observe(&mut self.recogniser, &look.of(movement, &mut self.noise))?;
            let stiffness = self.recogniser.predict(0, HAND_STIFFNESS[1], 1.0)?;
            Ok((target_y_m(movement), stiffness.mean))
        };
        new.iter().map(one).collect()
    }

    /// The same along the middle of the lines, for the table.
    pub(super) fn by_reach(&mut self) -> Result<Vec<Reach>, ExperimentError> {
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

    pub(super) fn bias(&mut self, biased: &[Demonstration]) -> Result<Bias, ExperimentError> {
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
