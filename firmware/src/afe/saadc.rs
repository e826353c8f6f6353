//! The chip's own converter behind one analogue amplifier for each channel: what its counts are worth.

use tonus_shared::pipeline::Board;
use tonus_shared::sample::{AdcScale, AdcScaleError};

use crate::acquisition::RATE_HZ;

/// Counts of the 12-bit converter.
const COUNTS: i32 = 4096;
/// Its range: 0.6 V internal reference at a gain of one sixth.
const RANGE_V: f64 = 3.6;
/// Gain of the analogue amplifier between electrodes and converter.
const AMPLIFIER_GAIN: f64 = 200.0;
/// What the amplifier gives for 0 V at the electrodes: 1.65 V, half of its supply.
const BIAS_COUNTS: i32 = 1877;

/// What the signal path must know of a wearable with this front end.
///
/// # Errors
/// [`AdcScaleError`] when the constants above contradict each other.
pub fn board(boot_id: u32) -> Result<Board, AdcScaleError> {
    let volts_per_count = RANGE_V / f64::from(COUNTS) / AMPLIFIER_GAIN;
    Ok(Board {
        boot_id,
        firmware_hash: [0; 8],
        adc: AdcScale::new(volts_per_count, BIAS_COUNTS, 0, COUNTS - 1)?,
        rates_hz: &[RATE_HZ],
    })
}
