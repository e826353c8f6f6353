//! New movements at a tempo of their own.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{CASES, JITTER, named_movement, pull, rig};
use crate::demonstration::Demonstration;
use crate::experiment::{Config, ExperimentError};
use crate::simulate::demonstrations::sense;
use crate::simulate::skills::{DURATION_US, Skill, with_object_anywhere};
use crate::simulate::tracker::TrackerNoise;
use crate::simulate::wearer::{Action, Task};

/// Keeps the seeds of these sittings apart from all others.
const PACED_SITTING: u64 = 0x7061_6365;

/// A movement whose start and duration nobody announced: human DoFs alone, from before its begin to after its end.
#[derive(Debug, Clone)]
pub struct Paced {
    /// Six DoFs (hand position, hand stiffness); times are from the begin, below zero before it.
    pub demonstration: Demonstration,
    /// How long the movement took, seconds.
    pub duration_s: f64,
}

/// New reaches, picks and places, `each` of each, at 0.7 to 1.4 times the demonstrated duration (evenly in its logarithm),
/// recorded from `margin_s` before to `margin_s` after the movement.
///
/// # Errors
/// As [`objects`](super::objects).
pub fn paced_pick_and_place(
    each: usize,
    margin_s: f64,
    config: &Config,
) -> Result<Vec<Paced>, ExperimentError> {
    let skills: Vec<Skill> = (0..each).flat_map(|_| Skill::PICK_AND_PLACE).collect();
    let action = |place: usize, rng: &mut ChaCha8Rng| {
        let latent = with_object_anywhere(skills[place], rng);
        Action::with_latent(skills[place], latent, rng)
    };
    paced((skills.len(), action), JITTER, margin_s, config)
}

/// New lifts, `each` of each object, under the tracker's stated noise; tempo and margins as [`paced_pick_and_place`].
///
/// # Errors
/// As [`objects`](super::objects).
pub fn paced_objects(
    each: usize,
    margin_s: f64,
    config: &Config,
) -> Result<Vec<Paced>, ExperimentError> {
    let skills: Vec<Skill> = (0..each).flat_map(|_| Skill::LIFTS).collect();
    let action = |place: usize, rng: &mut ChaCha8Rng| Action::sample(skills[place], rng);
    paced(
        (skills.len(), action),
        TrackerNoise::STATED,
        margin_s,
        config,
    )
}

/// `count` new pulls anywhere between the first and the last case; tempo and margins as [`paced_pick_and_place`].
///
/// # Errors
/// As [`objects`](super::objects).
pub fn paced_hand_over(
    count: usize,
    margin_s: f64,
    config: &Config,
) -> Result<Vec<Paced>, ExperimentError> {
    let action = |_, rng: &mut ChaCha8Rng| {
        let case = rng.random_range(0.0..(CASES - 1) as f64);
        pull(case, rng)
    };
    paced((count, action), JITTER, margin_s, config)
}

fn paced(
    (count, action): (usize, impl Fn(usize, &mut ChaCha8Rng) -> Action),
    noise: TrackerNoise,
    margin_s: f64,
    config: &Config,
) -> Result<Vec<Paced>, ExperimentError> {
    let seed = config.seed ^ PACED_SITTING;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let tasks: Vec<(Action, u64)> = (0..count)
        .map(|place| {
            let action = action(place, &mut rng);
            let tempo = rng.random_range(libm::log(0.7)..libm::log(1.4));
            let duration_us = (DURATION_US as f64 * libm::exp(tempo)).round() as u64;
            (action, duration_us)
        })
        .collect();
    let performed = tasks.iter().map(|&(action, duration_us)| Task::Paced {
        action,
        duration_us,
    });
    let performed: Vec<_> = performed.collect();
    let margin_us = (margin_s * 1e6) as u64;
    let sensed = sense(&performed, margin_us, &rig(noise, seed, config))?;
    let named = sensed.iter().zip(&tasks).enumerate();
    let named = named.map(|(trial, (instants, &(action, duration_us)))| {
        let t_s = instants.iter().map(|sensed| sensed.t_s()).collect();
        let hand = (0..3).map(|axis| instants.iter().map(|i| i.hand_m[axis]).collect());
        let firm = (0..3).map(|axis| instants.iter().map(|i| i.n_per_m[axis]).collect());
        let values = hand.chain(firm).collect();
        let demonstration = named_movement(action.skill, trial, trial.to_string(), t_s, values)?;
        Ok(Paced {
            demonstration,
            duration_s: duration_us as f64 * 1e-6,
        })
    });
    named.collect()
}
