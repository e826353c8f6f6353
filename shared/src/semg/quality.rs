//! Signal quality per channel, from raw counts: saturation, flat line, mains hum, lead-off.
//!
//! Four lamps. They warn; they never change the signal. A count at a rail and the front end's own detection show
//! at once, a count that stands still after 0.09 s. The rest is judged over blocks of half a second and shows up to a
//! second late: in a shorter block at 200 samples/s chance alone would look like hum. A lamp stays lit to the end
//! of the next clean block.

use core::f64::consts::PI;

use micromath::F32Ext;

use super::design::{self, DesignError, Mains};
use crate::sample::{AdcScale, difference};

/// Length of a judged block, s: whole periods of 50 and of 60 Hz, 2 Hz wide bins.
const BLOCK_S: f64 = 0.5;
/// A count that has not moved at all for this long is flat before its block ends, s. (A Myo at rest, whose eight
/// bits hardly move, repeats a count for up to 0.06 s.)
const STILL_S: f64 = 0.09;
/// Hum lamp: the mains line carries as much as everything else together (-3 dB of the AC power).
const HUM_LIMIT_DB: f32 = -3.0;
/// Hum figure of a channel without any AC power, dB.
const NO_HUM_DB: f32 = -120.0;
/// A live converter toggles its last bits; a block spanning no more than this many counts is flat.
const FLAT_COUNTS: i64 = 1;
/// Lead-off by offset: the block's mean is within this part of the range from a rail, where an
/// unconnected input drifts.
const RAIL_MARGIN: f32 = 0.02;
/// Lead-off by hum: a floating electrode picks up more than this, V RMS at the electrode; sEMG stays below.
const LEAD_OFF_HUM_V: f32 = 5e-3;

/// A set of warnings of one channel, one bit each, as it travels in the stream packet. Zero is good.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Quality(u8);

impl Quality {
    /// Nothing wrong.
    pub const GOOD: Self = Self(0);
    /// A count lay at a rail of the converter.
    pub const SATURATED: Self = Self(1 << 0);
    /// The counts do not move.
    pub const FLAT: Self = Self(1 << 1);
    /// Mains hum carries at least half of the AC power.
    pub const HUM: Self = Self(1 << 2);
    /// The electrode has come off, by the front end's own detection or by the signal.
    pub const LEAD_OFF: Self = Self(1 << 3);

    /// The bits as they travel.
    #[must_use]
    pub fn bits(self) -> u8 {
        self.0
    }

    /// The set that the bits mean; `None` when an undefined bit is set.
    #[must_use]
    pub fn from_bits(bits: u8) -> Option<Self> {
        (bits < 1 << 4).then_some(Self(bits))
    }

    /// Whether every warning of `other` is in this set.
    #[must_use]
    pub fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// This set with `other` added.
    #[must_use]
    pub fn with(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

/// Goertzel's recursion for one line: `v[n] = x[n] + 2 cos(w) v[n-1] - v[n-2]`, power
/// `v1^2 + v2^2 - 2 cos(w) v1 v2` at the block's end.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
struct Line {
    v1: f32,
    v2: f32,
}

impl Line {
    fn step(&mut self, coefficient: f32, x: f32) {
        let v = x + coefficient * self.v1 - self.v2;
        self.v2 = self.v1;
        self.v1 = v;
    }

    fn power(self, coefficient: f32) -> f32 {
        self.v1 * self.v1 + self.v2 * self.v2 - coefficient * self.v1 * self.v2
    }
}

/// What one block has gathered so far.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Block {
    samples: u32,
    /// The block's first count; sums are of differences from it, so that `f32` holds them.
    first: i32,
    lowest: i32,
    highest: i32,
    warned: Quality,
    sum: f32,
    sum_squares: f32,
    lines: [Line; 2],
}

impl Block {
    fn new(first: i32, warned: Quality) -> Self {
        Self {
            samples: 0,
            first,
            lowest: first,
            highest: first,
            warned,
            sum: 0.0,
            sum_squares: 0.0,
            lines: [Line::default(); 2],
        }
    }
}

/// The judge of channels at one sample rate and converter scale; coefficients only.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QualityMonitor {
    scale: AdcScale,
    block_samples: u32,
    still_samples: u32,
    /// `2 cos(2 pi f / fs)` for 50 and 60 Hz. From `f64` cosines: at 2 kHz an approximate one would
    /// listen a bin beside the line.
    coefficients: [f32; 2],
}

/// State of one channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QualityState {
    block: Option<Block>,
    /// Newest count, and how many samples in a row have had it.
    newest: i32,
    still: u32,
    judged: Quality,
    hum_db: f32,
}

impl QualityState {
    /// Before the first sample.
    #[must_use]
    pub fn new() -> Self {
        Self {
            block: None,
            newest: 0,
            still: 0,
            judged: Quality::GOOD,
            hum_db: NO_HUM_DB,
        }
    }

    /// Whether the newest sample was the last of a block, which has just been judged.
    pub(crate) fn just_judged(&self) -> bool {
        self.block.is_none()
    }

    /// Power of the stronger mains line over the whole AC power in the last whole block, dB (at most 0;
    /// -120 before the first block ends and for a flat line).
    #[must_use]
    pub fn hum_db(&self) -> f32 {
        self.hum_db
    }
}

impl Default for QualityState {
    fn default() -> Self {
        Self::new()
    }
}

impl QualityMonitor {
    /// A monitor for `rate_hz` samples/s (200 to 2000) of a converter with this scale.
    ///
    /// # Errors
    /// [`DesignError::Rate`] when the rate is outside what the chain accepts.
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "block of 100 to 1000 samples; coefficients within 2"
    )]
    pub fn new(rate_hz: f64, scale: AdcScale) -> Result<Self, DesignError> {
        design::check_rate(rate_hz)?;
        let coefficient = |mains: Mains| (2.0 * libm::cos(2.0 * PI * mains.hz() / rate_hz)) as f32;
        Ok(Self {
            scale,
            block_samples: libm::round(BLOCK_S * rate_hz) as u32,
            still_samples: libm::round(STILL_S * rate_hz) as u32,
            coefficients: [coefficient(Mains::Hz50), coefficient(Mains::Hz60)],
        })
    }

    /// Takes one count and the front end's own lead-off detection (`false` where it has none); returns
    /// the warnings of the last whole block, and those of this one that need not wait for its end.
    #[inline(always)]
    pub fn step(&self, state: &mut QualityState, count: i32, lead_off: bool) -> Quality {
        let block = (state.block).get_or_insert_with(|| Block::new(count, self.saturation(count)));
        // A count at a rail is an extreme of its block: if not a new one, it has been seen before.
        if count < block.lowest {
            block.lowest = count;
            block.warned = block.warned.with(self.saturation(count));
        } else if count > block.highest {
            block.highest = count;
            block.warned = block.warned.with(self.saturation(count));
        }
        let mut warned = block.warned;
        if lead_off {
            warned = warned.with(Quality::LEAD_OFF);
        }
        if count == state.newest {
            state.still = state.still.saturating_add(1);
            if state.still >= self.still_samples {
                warned = warned.with(Quality::FLAT);
            }
        } else {
            (state.newest, state.still) = (count, 1);
        }
        block.warned = warned;
        let x: f32 = difference(count, block.first);
        block.sum += x;
        block.sum_squares += x * x;
        for (line, coefficient) in block.lines.iter_mut().zip(self.coefficients) {
            line.step(coefficient, x);
        }
        block.samples += 1;
        if block.samples >= self.block_samples {
            let whole = *block;
            state.block = None;
            self.judge(state, &whole);
        }
        state.judged.with(warned)
    }

    fn saturation(&self, count: i32) -> Quality {
        if self.scale.at_rail(count) {
            Quality::SATURATED
        } else {
            Quality::GOOD
        }
    }

    /// Warnings of a whole block. `micromath`'s `log10` (within 0.05, so 0.5 dB) and `sqrt` (within 6 %) are
    /// enough for lamps with limits of several dB, and are a few integer operations instead of a libm call;
    /// the signal path uses neither.
    #[inline(never)]
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_precision_loss,
        reason = "lamps: single precision of the sums is enough"
    )]
    fn judge(&self, state: &mut QualityState, block: &Block) {
        let n = block.samples as f32;
        let mean = block.sum / n;
        let ac_power = (block.sum_squares / n - mean * mean).max(0.0);
        let mut quality = block.warned;
        state.hum_db = NO_HUM_DB;
        if i64::from(block.highest) - i64::from(block.lowest) <= FLAT_COUNTS {
            quality = quality.with(Quality::FLAT);
        } else if ac_power > 0.0 {
            // A sine of amplitude A has |X|^2 = (A n / 2)^2 and power A^2 / 2 = 2 |X|^2 / n^2.
            let line_power = (block.lines.iter().zip(self.coefficients))
                .map(|(line, coefficient)| 2.0 * line.power(coefficient) / (n * n))
                .fold(0.0, f32::max)
                .min(ac_power);
            state.hum_db = (10.0 * F32Ext::log10(line_power / ac_power)).clamp(NO_HUM_DB, 0.0);
            if state.hum_db >= HUM_LIMIT_DB {
                quality = quality.with(Quality::HUM);
                let hum_v = F32Ext::sqrt(line_power) * self.scale.volts_per_count() as f32;
                if hum_v > LEAD_OFF_HUM_V {
                    quality = quality.with(Quality::LEAD_OFF);
                }
            }
        }
        let (min, max) = self.scale.rails();
        let margin = RAIL_MARGIN * difference::<f32>(max, min);
        let above_min = difference::<f32>(block.first, min) + mean;
        let below_max = difference::<f32>(max, block.first) - mean;
        if above_min < margin || below_max < margin {
            quality = quality.with(Quality::LEAD_OFF);
        }
        state.judged = quality;
    }
}
