//! Where a movement of one skill will end, from its first half.

use serde::Serialize;

use super::{DEMONSTRATED_S, LEARNED, Paced, bank, follow, observe_at, onset_errors};
use crate::demonstration::Demonstration;
use crate::experiment::ExperimentError;
use crate::experiment::data;
use crate::experiment::look::{HAND, HAND_STIFFNESS};
use crate::model::learn;
use crate::model::recognise::Recogniser;
use crate::statistics::{mean, median, root_mean_square};

/// Long after every movement: what is expected then is expected at the end.
const AFTER_S: f64 = 1e3;

/// How well the end of the hand's movement is foretold half-way.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct EndPoint {
    /// New movements.
    pub motions: usize,
    /// Median distance of the hand's expected from its true end, metres.
    pub hand_end_point_error_m: f64,
    /// Root mean square error of the hand's stiffness at the end over its range in the demonstrations, mean of the axes.
    pub hand_stiffness_nrmse: f64,
}

/// New movements at 0.7 to 1.4 times the demonstrated duration, each asked half-way where it will end.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct UnknownTempoEnd {
    /// Tempo and onset inferred.
    pub inferred: EndPoint,
    /// Start and duration announced.
    pub announced: EndPoint,
    /// Start announced, and the movement taken to last as long as the demonstrations did.
    pub assumed: EndPoint,
    /// Root mean square error of the duration inferred half-way, as a share of it.
    pub duration_error: f64,
}

/// Hand position and stiffness at the end.
type End = [f64; 6];

/// How the ends of `new` movements are foretold by a model of the demonstrations, which are of one skill.
pub(in super::super) fn ends(
    demonstrations: &[Demonstration],
    new: &[Paced],
) -> Result<UnknownTempoEnd, ExperimentError> {
    let learned = demonstrations.get(..LEARNED).unwrap_or(demonstrations);
    let model = learn(learned, &data::hyperparameters()?)?;
    let view = model.view()?;
    let late = onset_errors(learned)?;
    let mut recogniser = Recogniser::new(&model, &view)?;
    let mut errors = [const { Vec::new() }; 3];
    let mut durations = Vec::with_capacity(new.len());
    for paced in new {
        let truth = truth(paced);
        let known = |phase: f64| (phase * paced.duration_s, phase);
        observe_at(&mut recogniser, paced, 0.5, known)?;
        errors[1].push(off(&truth, |dof| {
            Ok(recogniser.predict(0, dof, 1.0)?.mean)
        })?);
        let taken = |phase: f64| (phase * DEMONSTRATED_S, phase);
        observe_at(&mut recogniser, paced, 0.5, taken)?;
        errors[2].push(off(&truth, |dof| {
            Ok(recogniser.predict(0, dof, 1.0)?.mean)
        })?);
        let mut bank = bank(&model, &view, &late)?;
        follow(&mut bank, paced, |bank| {
            // A movement whose onset is not noticed in its first half is one of which nothing is known.
            if bank.begun() {
                errors[0].push(off(&truth, |dof| {
                    Ok(bank.predict(None, dof, AFTER_S)?.mean)
                })?);
            }
            let inferred = bank.duration(0.95).map(|interval| interval.mean);
            durations.extend(inferred.map(|d| d / paced.duration_s - 1.0));
            Ok(())
        })?;
    }
    let ranges = HAND_STIFFNESS.map(|dof| range(learned, dof));
    let [inferred, announced, assumed] = errors.map(|errors| summary(&errors, &ranges));
    Ok(UnknownTempoEnd {
        inferred,
        announced,
        assumed,
        duration_error: root_mean_square(&durations),
    })
}

/// What was recorded once the movement was over, averaged: the tracker jitters.
fn truth(paced: &Paced) -> End {
    let movement = &paced.demonstration;
    let after = movement.t_s().partition_point(|t| *t < paced.duration_s);
    let after = after.min(movement.t_s().len() - 1);
    std::array::from_fn(|dof| mean(&movement.values()[dof][after..]))
}

fn off(
    truth: &End,
    mut expected: impl FnMut(usize) -> Result<f64, ExperimentError>,
) -> Result<End, ExperimentError> {
    let mut off = *truth;
    for (dof, value) in off.iter_mut().enumerate() {
        *value = expected(dof)? - *value;
    }
    Ok(off)
}

fn range(demonstrations: &[Demonstration], dof: usize) -> f64 {
    let values = demonstrations.iter().flat_map(|d| &d.values()[dof]);
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &v| {
        (low.min(v), high.max(v))
    });
    high - low
}

fn summary(errors: &[End], ranges: &[f64; 3]) -> EndPoint {
    let distance = |off: &End| libm::sqrt(HAND.map(|axis| off[axis] * off[axis]).iter().sum());
    let shares = HAND_STIFFNESS.iter().zip(ranges).map(|(&dof, range)| {
        let off: Vec<f64> = errors.iter().map(|off| off[dof]).collect();
        root_mean_square(&off) / range
    });
    EndPoint {
        motions: errors.len(),
        hand_end_point_error_m: median(&errors.iter().map(distance).collect::<Vec<_>>()),
        hand_stiffness_nrmse: mean(&shares.collect::<Vec<_>>()),
    }
}
