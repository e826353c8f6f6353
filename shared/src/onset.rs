//! When a movement begins and ends, from the hand's position alone, as it streams in.
//!
//! The speed is the norm of a causal least-squares slope over a short window; it describes the window's middle, which is
//! the time it is given. A movement begins when the speed stays above the start threshold and ends when it stays
//! below the stop threshold (the hysteresis). Both thresholds rise with the speed at rest, so that a noisy tracker does
//! not move a hand that rests.
//!
//! A threshold is crossed late. People begin and end a reach with speed growing as the square of time (minimum
//! jerk: `v = 30 (A / D) s^2 (1 - s)^2`, Flash and Hogan 1985), so its square root grows evenly, and the two crossings
//! of stop and start, `t_l` and `t_h`, tell when it was zero: `t_0 = t_l - (t_h - t_l) q / (1 - q)`,
//! `q = sqrt(v_l / v_h)`; mirrored at the end.

use thiserror::Error;

use crate::Real;

/// Samples the slope is taken over at most: 80 ms at 200 Hz.
const WINDOW: usize = 16;
/// Time constants of the rest level's fall and rise, s: a low-side tracker, as that of [`crate::semg::bursts`].
const FALL_S: f64 = 0.3;
const RISE_S: f64 = 10.0;
/// How far beyond a crossing an edge may be put, s.
const REACH_S: f64 = 0.2;

/// What counts as a movement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OnsetConfig {
    /// Length of the slope's window, s (above 0, at most 1); of the newest 16 samples at most.
    pub window_s: f64,
    /// Start threshold at least, m/s (above 0).
    pub start_m_per_s: f64,
    /// Start threshold at least, multiples of the rest level (from 0).
    pub rest_multiple: f64,
    /// Stop threshold as a part of the start threshold (above 0, below 1): the hysteresis.
    pub release: f64,
    /// The speed must stay above the start threshold this long, s (0 to 10).
    pub shortest_movement_s: f64,
    /// The speed must stay below the stop threshold this long, s (0 to 10).
    pub shortest_pause_s: f64,
}

impl Default for OnsetConfig {
    /// For a hand and a tracker of millimetres: 0.2 m/s to begin, half of that to end, each for 30 ms.
    fn default() -> Self {
        Self {
            window_s: 0.05,
            start_m_per_s: 0.2,
            rest_multiple: 3.0,
            release: 0.5,
            shortest_movement_s: 0.03,
            shortest_pause_s: 0.03,
        }
    }
}

/// A configuration or a sample that was refused; the detector is as it was before it.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum OnsetError {
    /// A number of the configuration outside its range.
    #[error("{what} is {value}: out of range")]
    Config {
        /// Which number.
        what: &'static str,
        /// The number.
        value: f64,
    },
    /// NaN or infinite.
    #[error("the hand is at {position_m} m on one axis: drop the sample")]
    Position {
        /// The coordinate.
        position_m: f64,
    },
    /// A time that does not come after the one before it, or is not a number.
    #[error("the sample's time {time_s} s does not come after the one before it")]
    Time {
        /// The time.
        time_s: f64,
    },
}

/// The beginning or end of a movement, told once it is certain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MotionEdge<T> {
    /// It began at this time, seconds.
    Onset {
        /// When.
        at_s: T,
    },
    /// It ended at this time, seconds.
    End {
        /// When.
        at_s: T,
    },
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Sample<T> {
    time_s: T,
    position_m: [T; 3],
}

/// Speed at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Speed<T> {
    time_s: T,
    m_per_s: T,
}

/// Finds onset and end of movements in a stream of positions. 72 numbers; about 150 operations for each sample.
#[derive(Clone, Debug, PartialEq)]
pub struct OnsetDetector<T> {
    window_s: T,
    start_m_per_s: T,
    rest_multiple: T,
    release: T,
    shortest_movement_s: T,
    shortest_pause_s: T,
    samples: [Sample<T>; WINDOW],
    count: usize,
    last: Option<Speed<T>>,
    /// Speed at rest, m/s; none before the first.
    rest: Option<T>,
    moving: bool,
    /// When the speed last crossed the stop and the start threshold in the direction that would change `moving`.
    low_s: Option<T>,
    high_s: Option<T>,
}

impl<T: Real> OnsetDetector<T> {
    /// A hand at rest.
    ///
    /// # Errors
    /// [`OnsetError::Config`].
    pub fn new(config: &OnsetConfig) -> Result<Self, OnsetError> {
        let OnsetConfig {
            window_s,
            start_m_per_s,
            rest_multiple,
            release,
            shortest_movement_s,
            shortest_pause_s,
        } = *config;
        let ten = 0.0..=10.0;
        for (what, value, fine) in [
            ("the window", window_s, window_s > 0.0 && window_s <= 1.0),
            (
                "the start threshold",
                start_m_per_s,
                start_m_per_s > 0.0 && start_m_per_s.is_finite(),
            ),
            (
                "the multiple of the rest level",
                rest_multiple,
                rest_multiple >= 0.0 && rest_multiple.is_finite(),
            ),
            ("the release", release, release > 0.0 && release < 1.0),
            (
                "the shortest movement",
                shortest_movement_s,
                ten.contains(&shortest_movement_s),
            ),
            (
                "the shortest pause",
                shortest_pause_s,
                ten.contains(&shortest_pause_s),
            ),
        ] {
            if !fine {
                return Err(OnsetError::Config { what, value });
            }
        }
        let nothing = Sample {
            time_s: T::zero(),
            position_m: [T::zero(); 3],
        };
        Ok(Self {
            window_s: T::of(window_s),
            start_m_per_s: T::of(start_m_per_s),
            rest_multiple: T::of(rest_multiple),
            release: T::of(release),
            shortest_movement_s: T::of(shortest_movement_s),
            shortest_pause_s: T::of(shortest_pause_s),
            samples: [nothing; WINDOW],
            count: 0,
            last: None,
            rest: None,
            moving: false,
            low_s: None,
            high_s: None,
        })
    }

    /// Whether a movement is under way.
    #[must_use]
    pub const fn moving(&self) -> bool {
        self.moving
    }

    /// The newest speed, m/s, and the time it describes, s; none before the third sample.
    #[must_use]
    pub fn speed(&self) -> Option<(T, T)> {
        self.last.map(|speed| (speed.m_per_s, speed.time_s))
    }

    /// Forgets the samples, not the rest level: after a gap in the stream. A movement under way is over.
    pub fn restart(&mut self) {
        (self.count, self.last, self.moving) = (0, None, false);
        (self.low_s, self.high_s) = (None, None);
    }

    /// Takes the hand's position at a time, metres and seconds; tells an edge when one has become certain.
    ///
    /// # Errors
    /// A number that is not finite, a time that does not come after the one before it.
    pub fn step(
        &mut self,
        time_s: T,
        position_m: [T; 3],
    ) -> Result<Option<MotionEdge<T>>, OnsetError> {
        let newest = self
            .count
            .checked_sub(1)
            .map(|index| self.samples[index].time_s);
        if !time_s.is_finite() || newest.is_some_and(|newest| time_s <= newest) {
            return Err(OnsetError::Time {
                time_s: time_s.widen(),
            });
        }
        if let Some(wrong) = position_m.iter().find(|value| !value.is_finite()) {
            return Err(OnsetError::Position {
                position_m: wrong.widen(),
            });
        }
        self.push(Sample { time_s, position_m });
        let Some(speed) = self.slope() else {
            return Ok(None);
        };
        let before = self.last.replace(speed);
        let rest = self.learn_rest(&speed, before.as_ref());
        let start = self.start_m_per_s.max(self.rest_multiple * rest);
        Ok(self.judge(before, speed, (start * self.release, start)))
    }

    fn push(&mut self, sample: Sample<T>) {
        // What is older than the window, or has no room; two are kept at least.
        let oldest_s = sample.time_s - self.window_s;
        let live = &self.samples[..self.count];
        let outside = live.partition_point(|old| old.time_s < oldest_s);
        let stale = outside
            .min(self.count.saturating_sub(2))
            .max((self.count + 1).saturating_sub(WINDOW));
        self.samples.copy_within(stale..self.count, 0);
        self.count -= stale;
        self.samples[self.count] = sample;
        self.count += 1;
    }

    /// Norm of the least-squares slope of the samples, at their mean time.
    fn slope(&self) -> Option<Speed<T>> {
        let live = &self.samples[..self.count];
        if self.count < 3 {
            return None;
        }
        let count = T::of(self.count as f64);
        let first = live[0];
        let mean = |of: &dyn Fn(&Sample<T>) -> T| {
            live.iter().fold(T::zero(), |sum, sample| sum + of(sample)) / count
        };
        let since = |sample: &Sample<T>| sample.time_s - first.time_s;
        let middle = mean(&since);
        let spread = mean(&|sample| (since(sample) - middle) * (since(sample) - middle));
        let axis = |axis: usize| {
            let moved = |sample: &Sample<T>| sample.position_m[axis] - first.position_m[axis];
            mean(&|sample| (since(sample) - middle) * moved(sample)) / spread
        };
        let square = (0..3).fold(T::zero(), |sum, index| sum + axis(index) * axis(index));
        Some(Speed {
            time_s: first.time_s + middle,
            m_per_s: square.sqrt(),
        })
    }

    /// The speed at rest: it falls to a lower speed within 0.3 s and rises over 10 s, never in a movement.
    fn learn_rest(&mut self, speed: &Speed<T>, before: Option<&Speed<T>>) -> T {
        let rest = self.rest.unwrap_or(speed.m_per_s).min(self.start_m_per_s);
        let elapsed_s = before.map_or(T::zero(), |before| speed.time_s - before.time_s);
        let constant_s = T::of(if speed.m_per_s < rest { FALL_S } else { RISE_S });
        let share = if self.moving {
            T::zero()
        } else {
            (elapsed_s / constant_s).min(T::one())
        };
        let rest = rest + share * (speed.m_per_s - rest);
        self.rest = Some(rest);
        rest
    }

    fn judge(
        &mut self,
        before: Option<Speed<T>>,
        speed: Speed<T>,
        (stop, start): (T, T),
    ) -> Option<MotionEdge<T>> {
        let beyond = |threshold: T| {
            if self.moving {
                speed.m_per_s < threshold
            } else {
                speed.m_per_s > threshold
            }
        };
        // The threshold that is met first is the far one; the crossing of the other one is what must last.
        let (first, last) = if self.moving {
            (start, stop)
        } else {
            (stop, start)
        };
        let crossed = |since: Option<T>, threshold: T| {
            beyond(threshold).then(|| since.unwrap_or_else(|| crossing(before, speed, threshold)))
        };
        let (low_s, high_s) = if self.moving {
            (crossed(self.low_s, last), crossed(self.high_s, first))
        } else {
            (crossed(self.low_s, first), crossed(self.high_s, last))
        };
        (self.low_s, self.high_s) = (low_s, high_s);
        let (low_s, high_s) = (low_s?, high_s?);
        let (since_s, needed_s) = if self.moving {
            (low_s, self.shortest_pause_s)
        } else {
            (high_s, self.shortest_movement_s)
        };
        if speed.time_s - since_s < needed_s {
            return None;
        }
        let ratio = self.release.sqrt();
        let reach = T::of(REACH_S);
        let beyond_s = ((low_s - high_s) * ratio / (T::one() - ratio)).clamp(-reach, reach);
        self.moving = !self.moving;
        (self.low_s, self.high_s) = (None, None);
        let at_s = low_s + beyond_s;
        Some(if self.moving {
            MotionEdge::Onset { at_s }
        } else {
            MotionEdge::End { at_s }
        })
    }
}

/// When the line between two speeds crosses a threshold; the later time if there is no line.
fn crossing<T: Real>(before: Option<Speed<T>>, after: Speed<T>, threshold: T) -> T {
    let Some(before) = before else {
        return after.time_s;
    };
    let rise = after.m_per_s - before.m_per_s;
    if rise.is_zero() {
        return after.time_s;
    }
    let share = ((threshold - before.m_per_s) / rise).clamp(T::zero(), T::one());
    before.time_s + share * (after.time_s - before.time_s)
}
