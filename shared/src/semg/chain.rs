//! The streaming envelope of Algorithm 1: conditioner -> notch -> rectifier -> smoother.

use super::NonFinite;
use super::biquad::{Cascade, CascadeState, power_delay_samples};
use super::design::{self, DesignError, Mains};
use super::smoother::{self, Smoother};
use crate::Real;

/// Where the band of sEMG begins, Hz; from here up its spectrum is taken as flat when the delay of the
/// conditioning is computed (which is below a sample, except at rates near 200 Hz).
const SEMG_FROM_HZ: f64 = 20.0;

/// What takes offset and drift away before rectification. There is always one: a rectified offset would
/// be read as muscle activity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Conditioner {
    /// Butterworth high-pass; the default, because it also stops motion artefacts of real electrodes.
    HighPass {
        /// -3 dB frequency, Hz.
        cutoff_hz: f64,
        /// 1 to 8.
        order: usize,
    },
    /// First-order DC block: stands in for the linear detrend of the offline form.
    DcBlock {
        /// -3 dB frequency, Hz.
        cutoff_hz: f64,
    },
}

impl Default for Conditioner {
    /// High-pass, 2nd order, 20 Hz.
    fn default() -> Self {
        Self::HighPass {
            cutoff_hz: 20.0,
            order: 2,
        }
    }
}

impl Conditioner {
    /// The conditioner's filter at a sample rate.
    ///
    /// # Errors
    /// [`DesignError`] when the rate cannot carry it.
    pub fn design(self, rate_hz: f64) -> Result<Cascade<f64>, DesignError> {
        match self {
            Self::HighPass { cutoff_hz, order } => design::high_pass(rate_hz, cutoff_hz, order),
            Self::DcBlock { cutoff_hz } => design::dc_block(rate_hz, cutoff_hz),
        }
    }
}

/// A notch against mains hum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NotchConfig {
    /// Power-line frequency.
    pub mains: Mains,
    /// Centre frequency / -3 dB width, 1 to 100.
    pub q: f64,
}

/// What the chain is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChainConfig {
    /// Samples/s of each channel, 200 to 2000.
    pub rate_hz: f64,
    /// Removes offset and drift.
    pub conditioner: Conditioner,
    /// Removes hum, when there is any.
    pub notch: Option<NotchConfig>,
    /// Makes the envelope.
    pub smoother: Smoother,
}

impl ChainConfig {
    /// The default chain at a sample rate: 2nd-order 20 Hz high-pass, no notch, Butterworth of order 3
    /// at 5 Hz.
    #[must_use]
    pub fn at_rate(rate_hz: f64) -> Self {
        Self {
            rate_hz,
            conditioner: Conditioner::default(),
            notch: None,
            smoother: Smoother::default(),
        }
    }
}

/// A designed chain: coefficients only, shared by all channels of one rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chain<T> {
    conditioner: Cascade<T>,
    notch: Option<Cascade<T>>,
    smoother: smoother::Design<T>,
    delay_s: f64,
}

/// State of one channel, the smoother's ring at its end.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChainState<T> {
    /// The first sample, V. Taken from every later one before filtering: `f32` then spends its 24 bits on
    /// the signal instead of on the electrode's offset.
    first: Option<T>,
    conditioner: CascadeState<T>,
    notch: CascadeState<T>,
    smoother: smoother::State<T>,
}

impl<T: Real> ChainState<T> {
    /// Before the first sample.
    #[must_use]
    pub fn new() -> Self {
        Self {
            first: None,
            conditioner: CascadeState::zero(),
            notch: CascadeState::zero(),
            smoother: smoother::State::zero(),
        }
    }

    /// Forgets the past, as after a gap: the next sample starts the channel in steady state.
    pub fn reset(&mut self) {
        self.first = None;
    }
}

impl<T: Real> Default for ChainState<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Real> Chain<T> {
    /// Designs the chain in `f64` and converts it to `T`.
    ///
    /// # Errors
    /// [`DesignError`] names the part that the rate cannot carry, and the limits.
    pub fn design(config: &ChainConfig) -> Result<Self, DesignError> {
        let rate_hz = config.rate_hz;
        let conditioner = config.conditioner.design(rate_hz)?;
        let notch = (config.notch)
            .map(|NotchConfig { mains, q }| design::notch(rate_hz, mains, q))
            .transpose()?;
        let (smoother, smoother_delay_s) = smoother::Design::new(config.smoother, rate_hz)?;
        let carrier = design::high_pass(rate_hz, SEMG_FROM_HZ, 2)?;
        let conditioning_samples = power_delay_samples(&conditioner, notch.as_ref(), &carrier);
        Ok(Self {
            conditioner: conditioner.convert(),
            notch: notch.map(|notch| notch.convert()),
            smoother,
            delay_s: smoother_delay_s + conditioning_samples / rate_hz,
        })
    }

    /// One sample (V, or any unit: the envelope has the same) to one value of the envelope.
    ///
    /// The first sample starts every filter in steady state: the conditioner sees `x - x[0]`, the
    /// smoother starts settled on the first rectified value.
    ///
    /// Budget: 5 multiplications and 5 additions a section. The default chain has 3 sections (high-pass 1, smoother 2),
    /// about 60 cycles of a Cortex-M4F by that count (not measured); 8 channels at 2 kHz take 1 M cycles/s of its 64 M.
    /// An overrun shows as a jump of the scan index; after a long one the caller resets.
    ///
    /// # Errors
    /// [`NonFinite`] for NaN, infinity, or a value that overflows a filter; the state is then reset.
    #[inline(always)]
    pub fn step(&self, state: &mut ChainState<T>, x: T) -> Result<T, NonFinite> {
        // What is not finite leaves no filter that runs as a finite number.
        let envelope = match state.first {
            Some(first) => self.advance(state, x - first),
            None if x.is_finite() => self.start(state, x),
            None => x,
        };
        finite(state, x, envelope)
    }

    /// As [`Chain::step`] for the samples that several channels took at one time; each its own result.
    #[inline(always)]
    pub fn step_all<const C: usize>(
        &self,
        states: [&mut ChainState<T>; C],
        x: [T; C],
    ) -> [Result<T, NonFinite>; C] {
        let mut y = x;
        let mut started = true;
        for (y, state) in y.iter_mut().zip(&states) {
            match state.first {
                Some(first) => *y -= first,
                None => started = false,
            }
        }
        let mut results = x.map(Ok);
        if !started {
            for ((result, state), x) in results.iter_mut().zip(states).zip(x) {
                *result = self.step(state, x);
            }
            return results;
        }
        let mut states = states;
        let y = self.advance_all(states.each_mut().map(|state| &mut **state), y);
        for (((result, state), x), envelope) in results.iter_mut().zip(states).zip(x).zip(y) {
            *result = finite(state, x, envelope);
        }
        results
    }

    #[cold]
    fn start(&self, state: &mut ChainState<T>, x: T) -> T {
        state.first = Some(x);
        let mut y = self.conditioner.settle(&mut state.conditioner, T::zero());
        if let Some(notch) = &self.notch {
            y = notch.settle(&mut state.notch, y);
        }
        self.smoother.settle(&mut state.smoother, y)
    }

    #[inline(always)]
    fn advance(&self, state: &mut ChainState<T>, x: T) -> T {
        let mut y = self.conditioner.step(&mut state.conditioner, x);
        if let Some(notch) = &self.notch {
            y = notch.step(&mut state.notch, y);
        }
        self.smoother.step(&mut state.smoother, y)
    }

    #[inline(always)]
    fn advance_all<const C: usize>(
        &self,
        mut states: [&mut ChainState<T>; C],
        x: [T; C],
    ) -> [T; C] {
        let conditioners = states.each_mut().map(|state| &mut state.conditioner);
        let mut y = self.conditioner.step_all(conditioners, x);
        if let Some(notch) = &self.notch {
            y = notch.step_all(states.each_mut().map(|state| &mut state.notch), y);
        }
        self.smoother
            .step_all(states.map(|state| &mut state.smoother), y)
    }

    /// How far the envelope lags the muscle, s: `describes = acquired - delay`.
    ///
    /// The sum of the smoother's group delay at zero frequency and the delay that conditioner and notch give
    /// to the power of noise in the band of sEMG (not to its carrier, whose phase the rectifier forgets).
    /// A change faster than about 1 Hz through the Butterworth smoother lags a little more (order 3 at 5 Hz:
    /// 63.5 ms slow, 87 ms at 4 Hz).
    #[must_use]
    pub fn delay_s(&self) -> f64 {
        self.delay_s
    }
}

/// The envelope, if it is finite; what is not has spoiled the state.
#[inline(always)]
fn finite<T: Real>(state: &mut ChainState<T>, x: T, envelope: T) -> Result<T, NonFinite> {
    if envelope.is_finite() {
        Ok(envelope)
    } else {
        state.reset();
        Err(NonFinite { value: x.widen() })
    }
}
