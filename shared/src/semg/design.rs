//! Filters from the sample rate, in `f64`: Butterworth, mains notch, DC block.
//!
//! Butterworth filters come from the bilinear transform with the cutoff prewarped: with
//! `k = tan(pi fc / fs)` and the analogue pole pair of quality `q`, a section is
//!
//! ```text
//! low-pass   b = g k^2 [1, 2, 1]      a1 = 2 g (k^2 - 1)     a2 = g (1 - k/q + k^2)
//! high-pass  b = g [1, -2, 1]         g = 1 / (1 + k/q + k^2)
//! 1 + a1 + a2 = 4 g k^2
//! ```
//!
//! Sections run from the lowest `q` to the highest, so that the peaking ones see a signal that is
//! already filtered.

use core::f64::consts::PI;

use super::biquad::{Cascade, MAX_SECTIONS, Section};

/// Sample rates the signal chain is made for, Hz: a Myo (200) to a laboratory amplifier (2000).
pub const RATE_RANGE_HZ: (f64, f64) = (200.0, 2000.0);
/// Highest Butterworth order.
pub const MAX_ORDER: usize = 2 * MAX_SECTIONS;
/// Lowest and highest cutoff, as parts of the sample rate. Below (0.5 Hz at 2 kHz) a filter takes seconds to
/// settle; above is within 2 % of the Nyquist frequency, where a bilinear design has no transition left.
pub const CUTOFF_PER_RATE: (f64, f64) = (2.5e-4, 0.49);
/// Notch quality factors that still settle within seconds and leave the signal beside the line.
pub const NOTCH_Q_RANGE: (f64, f64) = (1.0, 100.0);

/// Why a filter cannot be designed.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum DesignError {
    /// The sample rate is outside [`RATE_RANGE_HZ`].
    #[error("sample rate {rate_hz} Hz: give one between {lowest_hz} and {highest_hz} Hz")]
    Rate {
        /// Refused rate, Hz.
        rate_hz: f64,
        /// Lowest rate, Hz.
        lowest_hz: f64,
        /// Highest rate, Hz.
        highest_hz: f64,
    },
    /// The rate cannot carry the cutoff.
    #[error(
        "a cutoff of {cutoff_hz} Hz cannot be built at {rate_hz} samples/s: give one between {lowest_hz} and {highest_hz} Hz"
    )]
    Cutoff {
        /// Sample rate, Hz.
        rate_hz: f64,
        /// Refused cutoff, Hz.
        cutoff_hz: f64,
        /// Lowest cutoff at this rate, Hz.
        lowest_hz: f64,
        /// Highest cutoff at this rate, Hz.
        highest_hz: f64,
    },
    /// The order is 0 or above [`MAX_ORDER`].
    #[error("Butterworth order {order}: give one between 1 and {highest}")]
    Order {
        /// Refused order.
        order: usize,
        /// Highest order.
        highest: usize,
    },
    /// The notch quality is outside [`NOTCH_Q_RANGE`].
    #[error("notch quality {q}: give one between {lowest} and {highest}")]
    NotchQ {
        /// Refused quality (centre frequency / -3 dB width).
        q: f64,
        /// Lowest quality.
        lowest: f64,
        /// Highest quality.
        highest: f64,
    },
    /// The averaging window is empty or longer than the ring that holds it.
    #[error(
        "a window of {window_s} s at {rate_hz} samples/s: give one above 0 and at most {longest_s} s"
    )]
    Window {
        /// Refused window, s.
        window_s: f64,
        /// Sample rate, Hz.
        rate_hz: f64,
        /// Longest window at this rate, s.
        longest_s: f64,
    },
}

/// The frequency of the power line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mains {
    /// 50 Hz.
    Hz50,
    /// 60 Hz.
    Hz60,
}

impl Mains {
    /// The frequency, Hz.
    #[must_use]
    pub fn hz(self) -> f64 {
        match self {
            Self::Hz50 => 50.0,
            Self::Hz60 => 60.0,
        }
    }
}

/// Checks a sample rate against [`RATE_RANGE_HZ`].
pub(crate) fn check_rate(rate_hz: f64) -> Result<(), DesignError> {
    let (lowest_hz, highest_hz) = RATE_RANGE_HZ;
    if (lowest_hz..=highest_hz).contains(&rate_hz) {
        Ok(())
    } else {
        Err(DesignError::Rate {
            rate_hz,
            lowest_hz,
            highest_hz,
        })
    }
}

fn check_cutoff(rate_hz: f64, cutoff_hz: f64) -> Result<(), DesignError> {
    check_rate(rate_hz)?;
    let (lowest_hz, highest_hz) = (CUTOFF_PER_RATE.0 * rate_hz, CUTOFF_PER_RATE.1 * rate_hz);
    if (lowest_hz..=highest_hz).contains(&cutoff_hz) {
        Ok(())
    } else {
        Err(DesignError::Cutoff {
            rate_hz,
            cutoff_hz,
            lowest_hz,
            highest_hz,
        })
    }
}

#[derive(Clone, Copy)]
enum Pass {
    Low,
    High,
}

/// Butterworth low-pass: `order` 1 to 8, -3 dB at `cutoff_hz`, for `rate_hz` samples/s.
///
/// # Errors
/// [`DesignError`] when rate, cutoff or order is outside what can be built.
pub fn low_pass(rate_hz: f64, cutoff_hz: f64, order: usize) -> Result<Cascade<f64>, DesignError> {
    butterworth(Pass::Low, rate_hz, cutoff_hz, order)
}

/// Butterworth high-pass: `order` 1 to 8, -3 dB at `cutoff_hz`, for `rate_hz` samples/s.
///
/// # Errors
/// [`DesignError`] when rate, cutoff or order is outside what can be built.
pub fn high_pass(rate_hz: f64, cutoff_hz: f64, order: usize) -> Result<Cascade<f64>, DesignError> {
    butterworth(Pass::High, rate_hz, cutoff_hz, order)
}

fn butterworth(
    pass: Pass,
    rate_hz: f64,
    cutoff_hz: f64,
    order: usize,
) -> Result<Cascade<f64>, DesignError> {
    check_cutoff(rate_hz, cutoff_hz)?;
    if !(1..=MAX_ORDER).contains(&order) {
        return Err(DesignError::Order {
            order,
            highest: MAX_ORDER,
        });
    }
    let k = libm::tan(PI * cutoff_hz / rate_hz);
    Ok(Cascade::build(order, |index| {
        if index == 0 && order % 2 == 1 {
            first_order(pass, k)
        } else {
            second_order(pass, k, damping(order, index))
        }
    }))
}

/// `1 / q` of pole pair `index` (lowest q first; index 0 of an odd order is the real pole).
#[allow(clippy::cast_precision_loss, reason = "orders are at most 8")]
fn damping(order: usize, index: usize) -> f64 {
    // The angle of the pole from the negative real axis; odd orders start at the real pole itself.
    let half_steps = if order % 2 == 1 {
        2 * index
    } else {
        2 * index + 1
    };
    2.0 * libm::cos(PI * half_steps as f64 / (2.0 * order as f64))
}

fn first_order(pass: Pass, k: f64) -> Section<f64> {
    let c = 2.0 * k / (1.0 + k);
    let numerator = match pass {
        Pass::Low => [1.0, 0.5, 0.0],
        Pass::High => [0.0, 0.5 / k, 0.0],
    };
    Section::new(0.0, c, numerator)
}

fn second_order(pass: Pass, k: f64, damping: f64) -> Section<f64> {
    let g = 1.0 / (1.0 + k * damping + k * k);
    let a2 = g * (1.0 - k * damping + k * k);
    let c = 4.0 * g * k * k;
    let edge = match pass {
        Pass::Low => 0.25,
        Pass::High => 0.25 / (k * k),
    };
    let sum = match pass {
        Pass::Low => 1.0,
        Pass::High => 0.0,
    };
    Section::new(a2, c, [sum, edge, edge])
}

/// Second-order notch at the mains frequency, `q` = centre / width between its -3 dB points (1 to 100).
///
/// Gain 1 at zero and Nyquist, 0 at the line; the same filter as SciPy's `iirnotch`.
///
/// # Errors
/// [`DesignError`] when the rate or `q` is outside what can be built.
pub fn notch(rate_hz: f64, mains: Mains, q: f64) -> Result<Cascade<f64>, DesignError> {
    check_cutoff(rate_hz, mains.hz())?;
    let (lowest, highest) = NOTCH_Q_RANGE;
    if !(lowest..=highest).contains(&q) {
        return Err(DesignError::NotchQ { q, lowest, highest });
    }
    let centre = 2.0 * PI * mains.hz() / rate_hz;
    // b = g [1, -2 cos, 1], a = [1, -2 g cos, 2 g - 1]: 1 + a1 + a2 = 2 g (1 - cos).
    let g = 1.0 / (1.0 + libm::tan(centre / q / 2.0));
    let sine = libm::sin(centre / 2.0);
    let one_less_cosine = 2.0 * sine * sine;
    let edge = 0.5 / one_less_cosine;
    let section = Section::new(2.0 * g - 1.0, 2.0 * g * one_less_cosine, [1.0, edge, edge]);
    Ok(Cascade::build(2, |_| section))
}

/// First-order DC block `g (1 - z^-1) / (1 - R z^-1)`, `R = exp(-2 pi fc / fs)`, `g = (1 + R) / 2`.
///
/// # Errors
/// [`DesignError`] when the rate or cutoff is outside what can be built.
pub fn dc_block(rate_hz: f64, cutoff_hz: f64) -> Result<Cascade<f64>, DesignError> {
    check_cutoff(rate_hz, cutoff_hz)?;
    let c = -libm::expm1(-2.0 * PI * cutoff_hz / rate_hz);
    let g = 1.0 - c / 2.0;
    let section = Section::new(0.0, c, [0.0, g / c, 0.0]);
    Ok(Cascade::build(1, |_| section))
}
