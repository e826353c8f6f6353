//! Algorithm 1 on a whole recording: the forms that need the future, in `f64`.
//!
//! The wearable runs `tonus_shared::semg::chain`; this module adds what a stream cannot have: linear
//! detrend, centred windows, filters run forward and backward (zero phase). Every coefficient comes from
//! `tonus_shared::semg::design`.

use tonus_shared::semg::biquad::{Cascade, CascadeState};
use tonus_shared::semg::chain::{Conditioner, NotchConfig};
use tonus_shared::semg::design::{self, DesignError};
use tonus_shared::semg::smoother::{Smoother, window_samples};

/// What takes offset and drift away before rectification.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Baseline {
    /// Least-squares line over the whole recording.
    Detrend,
    /// A filter of the streaming chain.
    Filter(Conditioner),
}

/// An envelope computed from a whole recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OfflineEnvelope {
    /// Samples/s, 200 to 2000.
    pub rate_hz: f64,
    /// Removes offset and drift.
    pub baseline: Baseline,
    /// Removes hum, when there is any.
    pub notch: Option<NotchConfig>,
    /// Makes the envelope.
    pub smoother: Smoother,
    /// Filters forward and backward, windows centred: no delay. Otherwise filters forward from zero state,
    /// windows trailing.
    pub zero_phase: bool,
}

/// Why a recording has no envelope.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum EnvelopeError {
    /// A filter cannot be built at this rate.
    #[error(transparent)]
    Design(#[from] DesignError),
    /// The recording is shorter than the padding of a zero-phase filter, or empty.
    #[error("{samples} samples are too few: this envelope needs at least {needed}")]
    TooShort {
        /// Samples given.
        samples: usize,
        /// Samples needed.
        needed: usize,
    },
    /// A sample is NaN or infinite.
    #[error("sample {index} is {value}: give finite samples only")]
    NonFinite {
        /// Position of the sample, from 0.
        index: usize,
        /// The sample.
        value: f64,
    },
}

impl OfflineEnvelope {
    /// The envelope of `x`, one value per sample, in the unit of `x`.
    ///
    /// # Errors
    /// [`EnvelopeError`] when a filter cannot be built, `x` is too short or not finite.
    pub fn apply(&self, x: &[f64]) -> Result<Vec<f64>, EnvelopeError> {
        if let Some((index, value)) = x.iter().enumerate().find(|(_, value)| !value.is_finite()) {
            return Err(EnvelopeError::NonFinite {
                index,
                value: *value,
            });
        }
        if x.is_empty() {
            return Err(EnvelopeError::TooShort {
                samples: 0,
                needed: 1,
            });
        }
        let mut signal = match self.baseline {
            Baseline::Detrend => detrend(x),
            Baseline::Filter(conditioner) => self.filter(&conditioner.design(self.rate_hz)?, x)?,
        };
        if let Some(NotchConfig { mains, q }) = self.notch {
            signal = self.filter(&design::notch(self.rate_hz, mains, q)?, &signal)?;
        }
        match self.smoother {
            Smoother::Butterworth { order, cutoff_hz } => {
                let filter = design::low_pass(self.rate_hz, cutoff_hz, order)?;
                self.filter(&filter, &rectify(&signal))
            }
            Smoother::MovingAverage { window_s } => {
                let (before, after) = self.reach(window_s)?;
                Ok(window_mean(&rectify(&signal), before, after))
            }
            Smoother::Rms { window_s } => {
                let (before, after) = self.reach(window_s)?;
                Ok(window_rms(&signal, before, after))
            }
        }
    }

    fn filter(&self, filter: &Cascade<f64>, x: &[f64]) -> Result<Vec<f64>, EnvelopeError> {
        if self.zero_phase {
            filter_zero_phase(filter, x)
        } else {
            Ok(filter_forward(filter, x))
        }
    }

    /// Samples that a window reaches back and ahead.
    fn reach(&self, window_s: f64) -> Result<(usize, usize), DesignError> {
        // A recording has no ring to fill; the longest window is one that counts still hold exactly.
        const LONGEST: usize = 1 << 32;
        let samples = window_samples(window_s, self.rate_hz, LONGEST)?;
        Ok(if self.zero_phase {
            (samples / 2, samples / 2)
        } else {
            (samples - 1, 0)
        })
    }
}

/// `x` less its least-squares line.
#[must_use]
#[allow(clippy::cast_precision_loss, reason = "recordings are far below 2^52")]
pub fn detrend(x: &[f64]) -> Vec<f64> {
    let n = x.len() as f64;
    let mean = x.iter().sum::<f64>() / n;
    // Time centred on the middle of the recording makes slope and mean independent.
    let time = |index: usize| index as f64 - (n - 1.0) / 2.0;
    let (mut covariance, mut variance) = (0.0, 0.0);
    for (index, value) in x.iter().enumerate() {
        covariance += time(index) * (value - mean);
        variance += time(index) * time(index);
    }
    let slope = if variance > 0.0 {
        covariance / variance
    } else {
        0.0
    };
    (x.iter().enumerate())
        .map(|(index, value)| value - mean - slope * time(index))
        .collect()
}

fn rectify(x: &[f64]) -> Vec<f64> {
    x.iter().map(|value| value.abs()).collect()
}

/// Mean over `before` samples back, the sample, and `after` ahead; zeros beyond the ends. `before = after`
/// is the centred window.
#[must_use]
#[allow(clippy::cast_precision_loss, reason = "windows are far below 2^52")]
pub fn window_mean(x: &[f64], before: usize, after: usize) -> Vec<f64> {
    let samples = (before + 1 + after) as f64;
    (0..x.len())
        .map(|index| {
            let from = index.saturating_sub(before);
            let to = (index + after + 1).min(x.len());
            // Summed anew for each sample: a running sum over hours would drift.
            x[from..to].iter().sum::<f64>() / samples
        })
        .collect()
}

/// Root mean square over the window of [`window_mean`].
#[must_use]
pub fn window_rms(x: &[f64], before: usize, after: usize) -> Vec<f64> {
    let squares: Vec<f64> = x.iter().map(|value| value * value).collect();
    (window_mean(&squares, before, after).into_iter())
        .map(f64::sqrt)
        .collect()
}

/// `x` through the filter once, from zero state (SciPy's `lfilter`).
#[must_use]
pub fn filter_forward(filter: &Cascade<f64>, x: &[f64]) -> Vec<f64> {
    let mut state = CascadeState::zero();
    (x.iter())
        .map(|value| filter.step(&mut state, *value))
        .collect()
}

/// `x` through the filter forward and backward: squared magnitude, no phase (SciPy's `filtfilt`: odd
/// extension of `3 (order + 1)` samples at both ends, each pass started in the steady state of its first
/// sample).
///
/// # Errors
/// [`EnvelopeError::TooShort`] when `x` is not longer than the extension.
pub fn filter_zero_phase(filter: &Cascade<f64>, x: &[f64]) -> Result<Vec<f64>, EnvelopeError> {
    let pad = 3 * (filter.order() + 1);
    let (Some(first), Some(last)) = (x.first(), x.last()) else {
        return Err(EnvelopeError::TooShort {
            samples: 0,
            needed: pad + 1,
        });
    };
    if x.len() <= pad {
        return Err(EnvelopeError::TooShort {
            samples: x.len(),
            needed: pad + 1,
        });
    }
    let before = x[1..=pad].iter().rev().map(|value| 2.0 * first - value);
    let after = (x[x.len() - 1 - pad..x.len() - 1].iter().rev()).map(|value| 2.0 * last - value);
    let mut extended: Vec<f64> = before.chain(x.iter().copied()).chain(after).collect();
    for _pass in 0..2 {
        let mut state = CascadeState::zero();
        if let Some(start) = extended.first() {
            filter.settle(&mut state, *start);
        }
        for value in &mut extended {
            *value = filter.step(&mut state, *value);
        }
        extended.reverse();
    }
    Ok(extended[pad..pad + x.len()].to_vec())
}

#[cfg(test)]
mod tests {
    use super::{Baseline, EnvelopeError, OfflineEnvelope, detrend, window_mean};
    use tonus_shared::semg::smoother::Smoother;

    #[test]
    fn a_line_has_no_trend_left() {
        let line: Vec<f64> = (0..50).map(|n| 3.0 - 0.25 * f64::from(n)).collect();
        assert!(detrend(&line).iter().all(|value| value.abs() < 1e-12));
        assert_eq!(detrend(&[7.0]), [0.0]);
    }

    #[test]
    fn windows_reach_as_far_as_they_say() {
        let x = [0.0, 0.0, 6.0, 0.0, 0.0];
        assert_eq!(window_mean(&x, 1, 1), [0.0, 2.0, 2.0, 2.0, 0.0]);
        assert_eq!(window_mean(&x, 2, 0), [0.0, 0.0, 2.0, 2.0, 2.0]);
    }

    #[test]
    fn short_and_broken_recordings_are_refused() {
        let envelope = OfflineEnvelope {
            rate_hz: 200.0,
            baseline: Baseline::Detrend,
            notch: None,
            smoother: Smoother::default(),
            zero_phase: true,
        };
        assert_eq!(
            envelope.apply(&[1.0; 12]),
            Err(EnvelopeError::TooShort {
                samples: 12,
                needed: 13
            })
        );
        assert!(matches!(
            envelope.apply(&[0.0, f64::NAN]),
            Err(EnvelopeError::NonFinite { index: 1, .. })
        ));
        assert!(envelope.apply(&[]).is_err());
    }
}
