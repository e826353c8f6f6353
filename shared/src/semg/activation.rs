//! Normalised envelopes and the activation of a muscle group (eq. 4).

use super::NonFinite;
use super::smoother::{WINDOW_CAPACITY, Window, window_delay_s};
use crate::Real;
use crate::real::not_negative;

/// One channel's scale from envelope to fraction of maximum voluntary contraction (MVC):
/// `(envelope - rest) / (mvc - rest)`, not below 0. Without it activation would depend on electrode gain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Normalisation<T> {
    rest: T,
    per_unit: T,
}

/// Why rest and MVC levels were refused.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum NormalisationError {
    /// A level is negative or not finite.
    #[error(
        "rest {rest} and MVC {mvc} must be finite envelope levels, not negative: measure them again"
    )]
    Level {
        /// Refused rest level.
        rest: f64,
        /// Refused MVC level.
        mvc: f64,
    },
    /// MVC does not exceed rest.
    #[error(
        "the MVC level {mvc} does not exceed the rest level {rest}: measure the contraction again"
    )]
    MvcNotAboveRest {
        /// Rest level.
        rest: f64,
        /// MVC level.
        mvc: f64,
    },
}

impl<T: Real> Normalisation<T> {
    /// From the envelope at rest and at maximum voluntary contraction, both in the envelope's unit (V).
    ///
    /// # Errors
    /// [`NormalisationError`] when a level is not finite or negative, or MVC does not exceed rest.
    pub fn new(rest: T, mvc: T) -> Result<Self, NormalisationError> {
        let (rest_f64, mvc_f64) = (rest.widen(), mvc.widen());
        if !(rest.is_finite() && mvc.is_finite() && rest >= T::zero() && mvc >= T::zero()) {
            return Err(NormalisationError::Level {
                rest: rest_f64,
                mvc: mvc_f64,
            });
        }
        let per_unit = (mvc - rest).recip();
        // Subnormal differences have no finite reciprocal either.
        if mvc <= rest || !per_unit.is_finite() {
            return Err(NormalisationError::MvcNotAboveRest {
                rest: rest_f64,
                mvc: mvc_f64,
            });
        }
        Ok(Self { rest, per_unit })
    }

    /// The envelope as a fraction of MVC: 0 at rest and below, 1 at MVC, above 1 beyond it.
    #[inline]
    pub fn apply(&self, envelope: T) -> T {
        not_negative((envelope - self.rest) * self.per_unit)
    }
}

/// Eq. 4 in its causal form: `e(t) = (1/W) sum_i sum_tau a_i(tau)`, i over the mapped channels, tau over
/// the last W samples. The sum over muscles is not divided by their number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Activation<const C: usize> {
    mapped: [bool; C],
    samples: usize,
}

/// Why an activation was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ActivationError {
    /// The window has no centre or does not fit.
    #[error("activation window of {samples} samples: give an odd count between 1 and {longest}")]
    Window {
        /// Refused length, samples.
        samples: usize,
        /// Longest odd length, samples.
        longest: usize,
    },
    /// No channel is mapped, so activation would always be zero.
    #[error("activation needs at least one mapped channel")]
    NoChannel,
}

/// The sliding window of one [`Activation`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ActivationState<T> {
    started: bool,
    window: Window<T>,
}

impl<T: Real> ActivationState<T> {
    /// Before the first sample.
    #[must_use]
    pub fn new() -> Self {
        Self {
            started: false,
            window: Window::zero(),
        }
    }

    /// Forgets the past, as after a gap.
    pub fn reset(&mut self) {
        self.started = false;
    }
}

impl<T: Real> Default for ActivationState<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const C: usize> Activation<C> {
    /// Sums the channels that `mapped` marks over a window of `samples` (W, odd).
    ///
    /// # Errors
    /// [`ActivationError`] when W is even, zero or too long, or no channel is mapped.
    pub fn new(mapped: [bool; C], samples: usize) -> Result<Self, ActivationError> {
        let longest = WINDOW_CAPACITY - 1;
        if samples.is_multiple_of(2) || samples > longest {
            return Err(ActivationError::Window { samples, longest });
        }
        if !mapped.contains(&true) {
            return Err(ActivationError::NoChannel);
        }
        Ok(Self { mapped, samples })
    }

    /// One set of normalised envelopes to activation (fractions of MVC, summed over muscles). The first call
    /// starts as if its envelopes had always been there.
    ///
    /// # Errors
    /// [`NonFinite`] when the sum over the mapped channels or the mean is not finite; the state is reset.
    #[inline(always)]
    pub fn step<T: Real>(
        &self,
        state: &mut ActivationState<T>,
        normalised: &[T; C],
    ) -> Result<T, NonFinite> {
        let sum = (self.mapped.iter().zip(normalised))
            .filter(|(mapped, _)| **mapped)
            .fold(T::zero(), |sum, (_, a)| sum + *a);
        if !state.started {
            state.window.settle(self.samples, sum);
        }
        let activation = if state.started {
            state.window.step(self.samples, sum)
        } else {
            sum
        };
        // The window's mean is not finite while a sum in it is not.
        state.started = activation.is_finite();
        if state.started {
            Ok(activation)
        } else {
            Err(NonFinite { value: sum.widen() })
        }
    }

    /// What the window adds to the envelopes' delay, s: `(W - 1) / 2` samples.
    #[must_use]
    pub fn delay_s(&self, rate_hz: f64) -> f64 {
        window_delay_s(self.samples, rate_hz)
    }
}
