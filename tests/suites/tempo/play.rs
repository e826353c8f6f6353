//! An action as it comes in: the detector begins it, the bank follows.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tonus::model::Model;
use tonus::model::tempo::{Interval, TempoConfig, TempoRecogniser};
use tonus_shared::onset::{MotionEdge, OnsetConfig, OnsetDetector};

use super::recordings::Action;

pub(crate) const FRACTIONS: [f64; 3] = [1.0, 0.5, 0.3];

/// How a hand is followed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Following {
    pub(crate) tempo: TempoConfig,
    pub(crate) onset: OnsetConfig,
    /// One observation so often, s.
    pub(crate) interval_s: f64,
    /// Noise assumed on each, m.
    pub(crate) sigma_m: f64,
}

/// What was said at a part of the movement.
#[derive(Clone, Debug)]
pub(crate) struct Said {
    pub(crate) log_posterior: Vec<f64>,
    /// 90 % credible.
    pub(crate) duration: Option<Interval>,
    pub(crate) onset: Option<Interval>,
}

/// Before the action 0.2 to 0.5 s, the same for the same seed.
pub(crate) fn lead_s(seed: u64) -> f64 {
    ChaCha8Rng::seed_from_u64(seed).random_range(0.2..0.5)
}

/// What is said after each of [`FRACTIONS`] of the true movement; nobody tells the recogniser which that is.
pub(crate) fn play(
    model: &Model,
    following: &Following,
    action: &Action<'_>,
    seed: u64,
) -> [Said; 3] {
    let view = model.view().expect("a view");
    let mut recogniser = TempoRecogniser::new(model, &view, following.tempo).expect("a recogniser");
    let mut detector = OnsetDetector::new(&following.onset).expect("a detector");
    let mut next_s = f64::NEG_INFINITY;
    let mut said: [Option<Said>; 3] = [None, None, None];
    for (time_s, position_m) in action.stream(lead_s(seed), 1.0) {
        for (slot, fraction) in said.iter_mut().zip(FRACTIONS) {
            let cut_s = action.start_s() + fraction * action.duration_s() + 1e-9;
            if slot.is_none() && time_s > cut_s {
                *slot = Some(say(&recogniser));
            }
        }
        if time_s >= next_s {
            next_s = time_s + following.interval_s - 1e-3;
            for (dof, value) in position_m.into_iter().enumerate() {
                recogniser
                    .observe(dof, time_s, value, following.sigma_m)
                    .expect("an observation");
            }
        }
        if let Some(MotionEdge::Onset { at_s }) = detector.step(time_s, position_m).expect("a step")
        {
            recogniser.begin(at_s).expect("a movement");
        }
    }
    said.map(|said| said.unwrap_or_else(|| say(&recogniser)))
}

fn say(recogniser: &TempoRecogniser<'_>) -> Said {
    Said {
        log_posterior: recogniser.log_posterior(),
        duration: recogniser.duration(0.9),
        onset: recogniser.onset(0.9),
    }
}
