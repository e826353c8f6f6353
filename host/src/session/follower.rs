//! Who follows the movement: by announced start and duration, or by a bank of hypotheses once motion is detected.

use tonus_shared::onset::{MotionEdge, OnsetDetector, OnsetError};

use super::movement::{Movement, Sampled};
use super::{SessionConfig, SessionError};
use crate::model::Model;
use crate::model::recognise::{Prediction, RecogniseError, Recogniser};
use crate::model::tempo::TempoRecogniser;

/// The movement is over when the hand rests and this much of the posterior says so.
const OVER_AT_REST: f64 = 0.5;
/// The same while the hand still moves.
const OVER: f64 = 0.99;
/// A hand that rests for so long has ended its movement, whatever the skills expect, microseconds: no skill stands still for
/// as long in its midst, and what was taken for one may have been the way to where the next begins.
const LONGEST_REST_US: u64 = 500_000;

/// One number of a sensor: signal of the model, value, standard deviation of its noise.
pub(super) type Reading = (usize, f64, f64);

/// Which sensor an observation comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Sensor {
    Hand,
    Stiffness,
}

/// The movement under way, and what the model makes of it.
#[derive(Debug)]
pub(super) enum Follower<'m> {
    /// Start and duration come with [`super::Event::Began`].
    Announced {
        recogniser: Box<Recogniser<'m>>,
        movement: Option<Movement>,
    },
    /// The detector begins, the bank follows.
    Inferred(Box<Inferred<'m>>),
}

impl<'m> Follower<'m> {
    pub(super) fn model(&self) -> &'m Model {
        match self {
            Self::Announced { recogniser, .. } => recogniser.model(),
            Self::Inferred(inferred) => inferred.recogniser.model(),
        }
    }

    /// Probability of each skill.
    pub(super) fn posterior(&self) -> Vec<f64> {
        let log_posterior = match self {
            Self::Announced { recogniser, .. } => recogniser.log_posterior(),
            Self::Inferred(inferred) => inferred.recogniser.log_posterior(),
        };
        log_posterior.into_iter().map(f64::exp).collect()
    }

    pub(super) fn movement(&self) -> Option<&Movement> {
        match self {
            Self::Announced { movement, .. } => movement.as_ref(),
            Self::Inferred(inferred) => inferred.movement.as_ref(),
        }
    }

    pub(super) fn movement_mut(&mut self) -> Option<&mut Movement> {
        match self {
            Self::Announced { movement, .. } => movement.as_mut(),
            Self::Inferred(inferred) => inferred.movement.as_mut(),
        }
    }

    /// Start and duration are announced; who infers them does not listen. Whether a movement begins by that.
    pub(super) fn began(&mut self, at_us: u64, duration_us: u64) -> bool {
        match self {
            Self::Announced {
                recogniser,
                movement,
            } => {
                recogniser.reset();
                *movement = Some(Movement::new(at_us, duration_us));
                true
            }
            Self::Inferred(_) => false,
        }
    }

    /// Phase of the movement under way at a time within it, as it is announced or now inferred.
    pub(super) fn phase(&self, at_us: u64) -> Option<f64> {
        match self {
            Self::Announced { movement, .. } => {
                let movement = movement.as_ref()?;
                movement.part(at_us, 1).map(|_| movement.phase(at_us))
            }
            Self::Inferred(inferred) => {
                let movement = inferred.movement.as_ref()?;
                let within = at_us >= movement.began_us;
                let (mean, _) = inferred
                    .recogniser
                    .phase(seconds(at_us))
                    .filter(|_| within)?;
                Some(mean)
            }
        }
    }

    /// The movement is said to be over.
    pub(super) fn ended(&mut self) {
        match self {
            Self::Announced { movement, .. } => *movement = None,
            Self::Inferred(inferred) => inferred.end(),
        }
    }

    /// The hand was seen: motion begins or ends a movement that nobody announces. Whether one begins by that.
    pub(super) fn watch(&mut self, at_us: u64, position_m: [f64; 3]) -> Result<bool, SessionError> {
        match self {
            Self::Announced { .. } => Ok(false),
            Self::Inferred(inferred) => inferred.watch(at_us, position_m),
        }
    }

    /// Takes what a sensor saw at one instant, if it is wanted; whether a movement was told something new.
    pub(super) fn observe(
        &mut self,
        sensor: Sensor,
        at_us: u64,
        readings: &[Reading; 3],
        config: &SessionConfig,
    ) -> Result<bool, RecogniseError> {
        match self {
            Self::Announced {
                recogniser,
                movement,
            } => {
                let Some(movement) = movement else {
                    return Ok(false);
                };
                let part = movement.part(at_us, config.observations);
                if !movement.sampled(sensor).take(part) {
                    return Ok(false);
                }
                let phase = movement.phase(at_us);
                for (dof, value, sigma) in *readings {
                    recogniser.observe(dof, phase, value, sigma)?;
                }
                Ok(true)
            }
            Self::Inferred(inferred) => inferred.observe(sensor, at_us, readings),
        }
    }

    /// What the skills, weighted by their posteriors, expect of a signal now; the rate is per second. `None` at rest.
    pub(super) fn expected(
        &mut self,
        dof: usize,
        now_us: u64,
    ) -> Result<Option<Prediction>, RecogniseError> {
        let weights = self.posterior();
        match self {
            Self::Announced {
                recogniser,
                movement,
            } => {
                let Some(movement) = movement else {
                    return Ok(None);
                };
                let phase = movement.phase(now_us);
                let skills = 0..weights.len();
                let of_skill = |skill| recogniser.predict(skill, dof, phase);
                let predictions = skills.map(of_skill).collect::<Result<Vec<_>, _>>()?;
                let mut all = mixed(&weights, &predictions);
                all.rate /= movement.duration_s();
                Ok(Some(all))
            }
            Self::Inferred(inferred) => {
                if inferred.movement.is_none() {
                    return Ok(None);
                }
                let recogniser = &mut inferred.recogniser;
                recogniser.predict(None, dof, seconds(now_us)).map(Some)
            }
        }
    }
}

/// Nobody announces anything.
#[derive(Debug)]
pub(super) struct Inferred<'m> {
    pub(super) recogniser: TempoRecogniser<'m>,
    detector: OnsetDetector<f64>,
    /// One observation of each sensor so often, microseconds.
    interval_us: u64,
    /// The same instants, in a movement and at rest.
    hands: Sampled,
    stiffnesses: Sampled,
    movement: Option<Movement>,
    /// When the hand was first seen to rest, unless it moves.
    rests_since_us: Option<u64>,
}

impl<'m> Inferred<'m> {
    pub(super) fn new(
        recogniser: TempoRecogniser<'m>,
        detector: OnsetDetector<f64>,
        interval_us: u64,
    ) -> Self {
        Self {
            recogniser,
            detector,
            interval_us: interval_us.max(1),
            hands: Sampled::default(),
            stiffnesses: Sampled::default(),
            movement: None,
            rests_since_us: None,
        }
    }

    fn end(&mut self) {
        self.recogniser.end();
        self.movement = None;
    }

    fn watch(&mut self, at_us: u64, position_m: [f64; 3]) -> Result<bool, SessionError> {
        let edge = match self.detector.step(seconds(at_us), position_m) {
            // A frame that comes late tells nothing about the speed.
            Err(OnsetError::Time { .. }) => None,
            edge => edge?,
        };
        let mut begins = false;
        if let (Some(MotionEdge::Onset { at_s }), None) = (edge, &self.movement) {
            self.recogniser.begin(at_s)?;
            begins = true;
            // Saturating: an onset before time zero began at zero.
            self.movement = Some(Movement::since((at_s * 1e6) as u64));
        }
        self.rests_since_us = if self.detector.moving() {
            None
        } else {
            Some(self.rests_since_us.unwrap_or(at_us))
        };
        let rested_us = self
            .rests_since_us
            .map_or(0, |since_us| at_us.saturating_sub(since_us));
        let over = self.recogniser.over(seconds(at_us));
        let enough = if self.detector.moving() {
            OVER
        } else {
            OVER_AT_REST
        };
        let over = over.is_none_or(|over| over >= enough) || rested_us >= LONGEST_REST_US;
        if self.movement.is_some() && over {
            self.end();
        }
        Ok(begins)
    }

    fn observe(
        &mut self,
        sensor: Sensor,
        at_us: u64,
        readings: &[Reading; 3],
    ) -> Result<bool, RecogniseError> {
        let part = u32::try_from(at_us / self.interval_us).ok();
        let sampled = match sensor {
            Sensor::Hand => &mut self.hands,
            Sensor::Stiffness => &mut self.stiffnesses,
        };
        if !sampled.take(part) {
            return Ok(false);
        }
        for (dof, value, sigma) in *readings {
            self.recogniser.observe(dof, seconds(at_us), value, sigma)?;
        }
        if let Some(movement) = &mut self.movement {
            movement.sampled(sensor).count += 1;
        }
        Ok(self.movement.is_some())
    }
}

#[allow(clippy::cast_precision_loss, reason = "microseconds of 285 years")]
fn seconds(at_us: u64) -> f64 {
    at_us as f64 * 1e-6
}

/// Moments of the mixture of `predictions` with `weights` that sum to one.
fn mixed(weights: &[f64], predictions: &[Prediction]) -> Prediction {
    let average = |of: fn(&Prediction) -> f64| -> f64 {
        weights
            .iter()
            .zip(predictions)
            .map(|(w, p)| w * of(p))
            .sum()
    };
    let mean = average(|p| p.mean);
    let square = average(|p| p.std * p.std + p.mean * p.mean);
    Prediction {
        mean,
        std: (square - mean * mean).max(0.0).sqrt(),
        rate: average(|p| p.rate),
    }
}
