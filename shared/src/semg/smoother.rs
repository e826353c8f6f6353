//! From the conditioned signal to its envelope: Butterworth low-pass, moving average or RMS.

use super::biquad::{Cascade, CascadeState};
use super::design::{self, DesignError};
use crate::Real;

/// Longest window, samples: 256 ms at 2 kHz. One channel's ring takes 2 kB in `f32`.
pub const WINDOW_CAPACITY: usize = 512;

/// Which smoother makes the envelope.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Smoother {
    /// Butterworth low-pass of the rectified signal.
    Butterworth {
        /// 1 to 8.
        order: usize,
        /// -3 dB frequency, Hz.
        cutoff_hz: f64,
    },
    /// Mean of the rectified signal over a trailing window.
    MovingAverage {
        /// Window, s; rounded to an odd count of samples.
        window_s: f64,
    },
    /// Square root of the mean square over a trailing window. Squares, and so does not rectify.
    Rms {
        /// Window, s; rounded to an odd count of samples.
        window_s: f64,
    },
}

impl Default for Smoother {
    /// Butterworth, order 3, 5 Hz.
    fn default() -> Self {
        Self::Butterworth {
            order: 3,
            cutoff_hz: 5.0,
        }
    }
}

/// The odd count of samples that a window stands for: `2 floor(n / 2) + 1`, n the nearest whole number of
/// samples (150 ms at 200 Hz is 31). Odd, so that its delay is a whole number of samples and a centred
/// window has a centre.
///
/// # Errors
/// [`DesignError`] when the rate is outside what the chain accepts, the window is not above zero, or it
/// is longer than `capacity` samples.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_precision_loss,
    reason = "range checked before the cast"
)]
pub fn window_samples(window_s: f64, rate_hz: f64, capacity: usize) -> Result<usize, DesignError> {
    design::check_rate(rate_hz)?;
    let samples = libm::round(window_s * rate_hz);
    // `>` is false for NaN; so is `<=`.
    if window_s > 0.0 && samples <= capacity as f64 {
        let odd = 2 * (samples as usize / 2) + 1;
        if odd <= capacity {
            return Ok(odd);
        }
    }
    Err(DesignError::Window {
        window_s,
        rate_hz,
        longest_s: capacity.saturating_sub(1) as f64 / rate_hz,
    })
}

/// Mean over the last `len` samples, one addition and one subtraction each.
///
/// A running sum in floating point drifts. Here a second sum collects the same samples without ever
/// subtracting; after `len` samples it is the sum of exactly the ring's content and replaces the
/// running one. Rounding therefore never outlives two windows, at constant cost per sample.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window<T> {
    next: usize,
    running: T,
    collected: T,
    ring: [T; WINDOW_CAPACITY],
}

impl<T: Real> Window<T> {
    /// A window of zeros.
    #[must_use]
    pub fn zero() -> Self {
        Self {
            ring: [T::zero(); WINDOW_CAPACITY],
            next: 0,
            running: T::zero(),
            collected: T::zero(),
        }
    }

    /// As if `x` had been the input for ever; `samples` is the window's length.
    #[cold]
    pub fn settle(&mut self, samples: usize, x: T) {
        self.ring = [x; WINDOW_CAPACITY];
        self.next = 0;
        self.running = x * count::<T>(samples);
        self.collected = T::zero();
    }

    /// Takes the newest sample; returns the mean of the last `samples`, which must be the same at each
    /// call since the window was settled.
    #[inline]
    pub fn step(&mut self, samples: usize, x: T) -> T {
        let samples = samples.clamp(1, WINDOW_CAPACITY);
        if let Some(oldest) = self.ring.get_mut(self.next) {
            self.running = self.running + x - *oldest;
            *oldest = x;
        }
        self.collected += x;
        self.next += 1;
        if self.next >= samples {
            self.next = 0;
            self.running = self.collected;
            self.collected = T::zero();
        }
        self.running / count::<T>(samples)
    }
}

/// A sample count in the scalar; exact, as counts are at most [`WINDOW_CAPACITY`].
#[allow(clippy::cast_possible_truncation, reason = "at most 512")]
fn count<T: Real>(samples: usize) -> T {
    T::whole(samples as i32)
}

/// A designed smoother, shared by all channels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Design<T> {
    LowPass(Cascade<T>),
    Mean { samples: usize },
    Rms { samples: usize },
}

/// A smoother's state for one channel. It holds the storage of every kind, because the kind is
/// chosen at run time and nothing is allocated.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct State<T> {
    cascade: CascadeState<T>,
    window: Window<T>,
}

impl<T: Real> State<T> {
    pub(crate) fn zero() -> Self {
        Self {
            cascade: CascadeState::zero(),
            window: Window::zero(),
        }
    }
}

impl<T: Real> Design<T> {
    /// The smoother and its delay of slow changes, s.
    pub(crate) fn new(smoother: Smoother, rate_hz: f64) -> Result<(Self, f64), DesignError> {
        Ok(match smoother {
            Smoother::Butterworth { order, cutoff_hz } => {
                let filter = design::low_pass(rate_hz, cutoff_hz, order)?;
                let delay_s = filter.slow_delay_samples() / rate_hz;
                (Self::LowPass(filter.convert()), delay_s)
            }
            Smoother::MovingAverage { window_s } => {
                let samples = window_samples(window_s, rate_hz, WINDOW_CAPACITY)?;
                (Self::Mean { samples }, window_delay_s(samples, rate_hz))
            }
            Smoother::Rms { window_s } => {
                let samples = window_samples(window_s, rate_hz, WINDOW_CAPACITY)?;
                (Self::Rms { samples }, window_delay_s(samples, rate_hz))
            }
        })
    }

    /// Starts in the steady state of a constant conditioned signal; returns the envelope.
    pub(crate) fn settle(&self, state: &mut State<T>, conditioned: T) -> T {
        let magnitude = conditioned.abs();
        match self {
            Self::LowPass(filter) => filter.settle(&mut state.cascade, magnitude),
            Self::Mean { samples } => {
                state.window.settle(*samples, magnitude);
                magnitude
            }
            Self::Rms { samples } => {
                state.window.settle(*samples, magnitude * magnitude);
                magnitude
            }
        }
    }

    #[inline(always)]
    pub(crate) fn step(&self, state: &mut State<T>, conditioned: T) -> T {
        match self {
            Self::LowPass(filter) => filter.step(&mut state.cascade, conditioned.abs()),
            Self::Mean { samples } => state.window.step(*samples, conditioned.abs()),
            Self::Rms { samples } => {
                let mean_square = state.window.step(*samples, conditioned * conditioned);
                // After a burst the running sum may undershoot zero by its rounding.
                if mean_square < T::zero() {
                    T::zero()
                } else {
                    mean_square.sqrt()
                }
            }
        }
    }
}

impl<T: Real> Design<T> {
    /// As [`Design::step`] for several channels.
    #[inline(always)]
    pub(crate) fn step_all<const C: usize>(
        &self,
        states: [&mut State<T>; C],
        mut conditioned: [T; C],
    ) -> [T; C] {
        if let Self::LowPass(filter) = self {
            let cascades = states.map(|state| &mut state.cascade);
            return filter.step_all(cascades, conditioned.map(|x| x.abs()));
        }
        for (x, state) in conditioned.iter_mut().zip(states) {
            *x = self.step(state, *x);
        }
        conditioned
    }
}

/// Delay of a trailing window of `samples`, s: half its length.
#[allow(clippy::cast_possible_truncation, reason = "at most 512")]
pub(crate) fn window_delay_s(samples: usize, rate_hz: f64) -> f64 {
    f64::from(samples.saturating_sub(1) as u32) / 2.0 / rate_hz
}
