//! Movements at a tempo of their own, begun without notice.

mod end_point;

pub(super) use end_point::ends;
pub use end_point::{EndPoint, UnknownTempoEnd};

use serde::Serialize;
use tonus_shared::onset::{MotionEdge, OnsetConfig, OnsetDetector};

use super::data::{self, Paced};
use super::look::{HAND, HAND_STIFFNESS, Look, STIFFNESS_SIGMA};
use super::{ExperimentError, Score};
use crate::demonstration::Demonstration;
use crate::model::learn;
use crate::model::recognise::Recogniser;
use crate::model::tempo::{TempoConfig, TempoRecogniser};
use crate::model::{Model, View};
use crate::simulate::tracker::TrackerNoise;
use crate::statistics::{mean, root_mean_square};

/// Demonstrations that are learnt from, the first of those there are. A bank of hypotheses costs the square of the rank.
const LEARNED: usize = 45;
/// New movements of each action.
pub(super) const NEW_EACH: usize = 20;
/// Recorded before and after each movement, seconds.
pub(super) const MARGIN_S: f64 = 0.15;
/// Every so often something is observed, seconds.
const INTERVAL_S: f64 = 0.1;
/// How long the demonstrations take, seconds.
const DEMONSTRATED_S: f64 = 2.0;
/// Observations where start and duration are announced.
const OBSERVATIONS: usize = 10;
/// Onsets by the hand's speed: these are slow movements, and a window of this length makes a millimetre's jitter slower.
const ONSET: OnsetConfig = OnsetConfig {
    window_s: 0.12,
    start_m_per_s: 0.06,
    rest_multiple: 0.0,
    release: 0.5,
    shortest_movement_s: 0.03,
    shortest_pause_s: 0.03,
};

/// Recognition at a tempo and onset that nobody announces: new movements at 0.7 to 1.4 times the demonstrated
/// duration, by a model of at most 45 demonstrations.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct UnknownTempo {
    /// Tempo and onset inferred, at the end of the movement.
    pub inferred: Score,
    /// Tempo and onset inferred, half-way.
    pub inferred_first_half: Score,
    /// Start and duration announced, ten observations.
    pub announced: Score,
    /// Start announced, and the movement taken to last as long as the demonstrations did.
    pub assumed: Score,
    /// Root mean square error of the duration inferred at the end, as a share of it.
    pub duration_error: f64,
}

/// How `new` movements are recognised by a model of the demonstrations.
pub(super) fn recognised(
    demonstrations: &[Demonstration],
    new: &[Paced],
) -> Result<UnknownTempo, ExperimentError> {
    let learned = demonstrations.get(..LEARNED).unwrap_or(demonstrations);
    let model = learn(learned, &data::hyperparameters()?)?;
    let view = model.view()?;
    let late = onset_errors(learned)?;
    let mut recogniser = Recogniser::new(&model, &view)?;
    let [mut announced, mut assumed] = [const { Vec::new() }; 2];
    let [mut whole, mut half] = [const { Vec::new() }; 2];
    let mut durations = Vec::with_capacity(new.len());
    for paced in new {
        let label = paced.demonstration.label();
        let known = |phase: f64| (phase * paced.duration_s, phase);
        observe_at(&mut recogniser, paced, 1.0, known)?;
        announced.push(answer(&model, &recogniser.log_posterior(), label));
        let taken = |phase: f64| (phase * DEMONSTRATED_S, phase);
        observe_at(&mut recogniser, paced, 1.0, taken)?;
        assumed.push(answer(&model, &recogniser.log_posterior(), label));
        let mut bank = bank(&model, &view, &late)?;
        let mut first_half = None;
        follow(&mut bank, paced, |bank| {
            first_half = Some(bank.log_posterior());
            Ok(())
        })?;
        let at_end = bank.log_posterior();
        half.push(answer(
            &model,
            first_half.as_ref().unwrap_or(&at_end),
            label,
        ));
        whole.push(answer(&model, &at_end, label));
        let inferred = bank.duration(0.95).map(|interval| interval.mean);
        durations.extend(inferred.map(|d| d / paced.duration_s - 1.0));
    }
    Ok(UnknownTempo {
        inferred: Score::of(whole),
        inferred_first_half: Score::of(half),
        announced: Score::of(announced),
        assumed: Score::of(assumed),
        duration_error: root_mean_square(&durations),
    })
}

fn answer(model: &Model, log_posterior: &[f64], label: &str) -> (f64, bool) {
    let own = model
        .skill(label)
        .and_then(|skill| log_posterior.get(skill));
    let own = own.copied().unwrap_or(f64::NEG_INFINITY);
    let others = model
        .labels()
        .iter()
        .zip(log_posterior)
        .filter(|(name, _)| *name != label);
    (own, others.into_iter().all(|(_, other)| *other < own))
}

/// Ten observations at the times and phases that `at` makes of equal steps, in this share of the movement.
fn observe_at(
    recogniser: &mut Recogniser<'_>,
    paced: &Paced,
    share: f64,
    at: impl Fn(f64) -> (f64, f64),
) -> Result<(), ExperimentError> {
    recogniser.reset();
    let movement = &paced.demonstration;
    let (first_s, lasts_s) = (movement.t_s()[0], movement.duration_s());
    for step in Look::spaced(OBSERVATIONS, 1.0, true).phases {
        let (time_s, phase) = at(step);
        if time_s > share * paced.duration_s {
            break;
        }
        for dof in HAND.into_iter().chain(HAND_STIFFNESS) {
            if let Some(value) = movement.value_at(dof, (time_s - first_s) / lasts_s) {
                recogniser.observe(dof, phase, value, sigma(dof, value))?;
            }
        }
    }
    Ok(())
}

fn sigma(dof: usize, value: f64) -> f64 {
    if HAND.contains(&dof) {
        TrackerNoise::STATED.jitter_sd_m
    } else {
        STIFFNESS_SIGMA * value
    }
}

/// When the detector says that demonstrations began, later than they did: mean and standard deviation, seconds.
fn onset_errors(demonstrations: &[Demonstration]) -> Result<(f64, f64), ExperimentError> {
    let mut late_s = Vec::with_capacity(demonstrations.len());
    for movement in demonstrations {
        let mut detector = OnsetDetector::new(&ONSET)?;
        for (sample, &time_s) in movement.t_s().iter().enumerate() {
            let hand_m = HAND.map(|dof| movement.values()[dof][sample]);
            if let Some(MotionEdge::Onset { at_s }) = detector.step(time_s, hand_m)? {
                late_s.push(at_s);
                break;
            }
        }
    }
    let middle = if late_s.is_empty() {
        0.0
    } else {
        mean(&late_s)
    };
    let off: Vec<f64> = late_s.iter().map(|late| late - middle).collect();
    let spread = if off.is_empty() {
        0.0
    } else {
        root_mean_square(&off)
    };
    // A tempo that is not the demonstrations' moves a threshold's crossing too.
    Ok((middle, spread.max(0.03)))
}

fn bank<'m>(
    model: &'m Model,
    view: &'m View<'m>,
    (late_s, spread_s): &(f64, f64),
) -> Result<TempoRecogniser<'m>, ExperimentError> {
    let given = TempoConfig {
        onset_late_s: *late_s,
        onset_std_s: *spread_s,
        lead_s: 2.0 * MARGIN_S,
        ..TempoConfig::default()
    };
    Ok(TempoRecogniser::new(model, view, given)?)
}

/// Follows one movement to its end as it comes in: the detector says that it began, the bank does the rest. `half_way` is
/// called once half of the true duration has passed, which nobody tells the bank.
fn follow<'m>(
    bank: &mut TempoRecogniser<'m>,
    paced: &Paced,
    half_way: impl FnOnce(&mut TempoRecogniser<'m>) -> Result<(), ExperimentError>,
) -> Result<(), ExperimentError> {
    let mut detector = OnsetDetector::new(&ONSET)?;
    let movement = &paced.demonstration;
    let mut next_s = f64::NEG_INFINITY;
    let mut half_way = Some(half_way);
    for (sample, &time_s) in movement.t_s().iter().enumerate() {
        if time_s > paced.duration_s {
            break;
        }
        if time_s > 0.5 * paced.duration_s
            && let Some(look) = half_way.take()
        {
            look(bank)?;
        }
        let hand_m = HAND.map(|dof| movement.values()[dof][sample]);
        let edge = detector.step(time_s, hand_m)?;
        if time_s >= next_s {
            next_s = time_s + INTERVAL_S;
            for (dof, series) in movement.values().iter().enumerate() {
                bank.observe(dof, time_s, series[sample], sigma(dof, series[sample]))?;
            }
        }
        if let (Some(MotionEdge::Onset { at_s }), false) = (edge, bank.begun()) {
            bank.begin(at_s)?;
        }
    }
    Ok(())
}
