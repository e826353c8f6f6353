//! Bursts: when a muscle is active, from its envelope alone.
//!
//! The threshold is a multiple of the rest level, so electrode gain and unit do not matter and no recording
//! needs tuning. The rest level is a slow low-side tracker: it falls to a lower envelope within 0.3 s and rises
//! to a higher one over 10 s (60 s during a burst, so that a lasting rise of the noise is still learnt
//! in the end). At the start the filters settle for 0.3 s, then 0.5 s are averaged; a recording that
//! starts in a contraction is corrected by the first pause.

use super::NonFinite;
use super::design::{self, DesignError};
use crate::Real;

const SETTLE_S: f64 = 0.3;
const LEARN_S: f64 = 0.5;
const FALL_S: f64 = 0.3;
const RISE_S: f64 = 10.0;
const RISE_IN_BURST_S: f64 = 60.0;

/// What counts as a burst.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BurstConfig {
    /// Envelope samples/s, 200 to 2000.
    pub rate_hz: f64,
    /// Onset threshold, multiples of the rest level (above 1).
    pub threshold: f64,
    /// Offset threshold as a part of the onset threshold (above 0, at most 1): the hysteresis.
    pub release: f64,
    /// The envelope must stay above the onset threshold this long, s.
    pub shortest_burst_s: f64,
    /// The envelope must stay below the offset threshold this long, s.
    pub shortest_pause_s: f64,
}

impl BurstConfig {
    /// The default detector: 5 times rest to start, half of that to end, 50 ms bursts, 200 ms pauses.
    #[must_use]
    pub fn at_rate(rate_hz: f64) -> Self {
        Self {
            rate_hz,
            threshold: 5.0,
            release: 0.5,
            shortest_burst_s: 0.05,
            shortest_pause_s: 0.2,
        }
    }
}

/// Why a detector was refused.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum BurstError {
    /// The sample rate is outside what the chain accepts.
    #[error(transparent)]
    Rate(#[from] DesignError),
    /// The thresholds do not separate activity from rest.
    #[error(
        "burst threshold {threshold} (times rest) must be above 1 and release {release} above 0 and at most 1"
    )]
    Threshold {
        /// Refused onset threshold.
        threshold: f64,
        /// Refused offset part.
        release: f64,
    },
    /// A duration is negative, not finite or longer than a minute.
    #[error("shortest burst {shortest_burst_s} s and pause {shortest_pause_s} s must be 0 to 60 s")]
    Duration {
        /// Refused shortest burst, s.
        shortest_burst_s: f64,
        /// Refused shortest pause, s.
        shortest_pause_s: f64,
    },
}

/// The beginning or end of a burst, told once it is certain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Edge {
    /// The envelope went above the onset threshold `ago` samples before this one, and stayed.
    Onset {
        /// Samples since the crossing.
        ago: u32,
    },
    /// The envelope went below the offset threshold `ago` samples before this one, and stayed.
    Offset {
        /// Samples since the crossing.
        ago: u32,
    },
}

/// A detector of one rate and configuration, shared by all channels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BurstDetector<T> {
    onset_per_rest: T,
    offset_per_rest: T,
    burst_samples: u32,
    pause_samples: u32,
    settle_samples: u32,
    learn_samples: u32,
    fall: T,
    rise: T,
    rise_in_burst: T,
}

/// State of one channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BurstState<T> {
    /// Samples seen, until rest is learnt.
    seen: u32,
    rest: T,
    active: bool,
    /// Samples in a row beyond the threshold that would end the present phase.
    beyond: u32,
}

impl<T: Real> BurstState<T> {
    /// Before the first sample.
    #[must_use]
    pub fn new() -> Self {
        Self {
            seen: 0,
            rest: T::zero(),
            active: false,
            beyond: 0,
        }
    }

    /// Whether a burst is under way.
    #[must_use]
    pub fn active(&self) -> bool {
        self.active
    }
}

impl<T: Real> Default for BurstState<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Real> BurstDetector<T> {
    /// A detector from its configuration.
    ///
    /// # Errors
    /// [`BurstError`] when the rate, the thresholds or the durations make no detector.
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "at most 60 s at 2 kHz"
    )]
    pub fn new(config: &BurstConfig) -> Result<Self, BurstError> {
        let BurstConfig {
            rate_hz,
            threshold,
            release,
            shortest_burst_s,
            shortest_pause_s,
        } = *config;
        design::check_rate(rate_hz)?;
        let separates = threshold.is_finite() && threshold > 1.0;
        if !(separates && release > 0.0 && release <= 1.0) {
            return Err(BurstError::Threshold { threshold, release });
        }
        let minute = 0.0..=60.0;
        if !(minute.contains(&shortest_burst_s) && minute.contains(&shortest_pause_s)) {
            return Err(BurstError::Duration {
                shortest_burst_s,
                shortest_pause_s,
            });
        }
        let samples = |seconds: f64| (libm::round(seconds * rate_hz) as u32).max(1);
        let per_sample = |seconds: f64| T::of(1.0 / (seconds * rate_hz));
        Ok(Self {
            onset_per_rest: T::of(threshold),
            offset_per_rest: T::of(threshold * release),
            burst_samples: samples(shortest_burst_s),
            pause_samples: samples(shortest_pause_s),
            settle_samples: samples(SETTLE_S),
            learn_samples: samples(LEARN_S),
            fall: per_sample(FALL_S),
            rise: per_sample(RISE_S),
            rise_in_burst: per_sample(RISE_IN_BURST_S),
        })
    }

    /// Takes one envelope value; tells an edge when one has become certain.
    ///
    /// # Errors
    /// [`NonFinite`] for NaN or infinity; the channel then learns its rest level anew.
    pub fn step(&self, state: &mut BurstState<T>, envelope: T) -> Result<Option<Edge>, NonFinite> {
        if !envelope.is_finite() {
            *state = BurstState::new();
            return Err(NonFinite {
                value: envelope.widen(),
            });
        }
        if state.seen < self.settle_samples + self.learn_samples {
            self.learn(state, envelope);
            return Ok(None);
        }
        let rate = if envelope < state.rest {
            self.fall
        } else if state.active {
            self.rise_in_burst
        } else {
            self.rise
        };
        state.rest += rate * (envelope - state.rest);
        let (beyond, needed) = if state.active {
            (
                envelope < self.offset_per_rest * state.rest,
                self.pause_samples,
            )
        } else {
            (
                envelope > self.onset_per_rest * state.rest,
                self.burst_samples,
            )
        };
        state.beyond = if beyond { state.beyond + 1 } else { 0 };
        if state.beyond < needed {
            return Ok(None);
        }
        let ago = state.beyond - 1;
        state.beyond = 0;
        state.active = !state.active;
        Ok(Some(if state.active {
            Edge::Onset { ago }
        } else {
            Edge::Offset { ago }
        }))
    }

    fn learn(&self, state: &mut BurstState<T>, envelope: T) {
        state.seen += 1;
        if let Some(learnt @ 1..) = state.seen.checked_sub(self.settle_samples) {
            state.rest += (envelope - state.rest) / T::of(f64::from(learnt));
        }
    }
}
