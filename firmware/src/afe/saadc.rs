//! The chip's own converter: what its counts are worth, of an electrode behind an analogue amplifier and of a battery
//! behind a divider.

use tonus_shared::pipeline::Board;
use tonus_shared::sample::{AdcScale, AdcScaleError};

use crate::acquisition::RATE_HZ;

/// Counts of the 12-bit converter.
const COUNTS: i32 = 4096;
/// Its range: 0.6 V internal reference at a gain of one sixth.
const RANGE_MV: i32 = 3_600;
/// Gain of the analogue amplifier between electrodes and converter.
const AMPLIFIER_GAIN: f64 = 200.0;
/// What the amplifier gives for 0 V at the electrodes: 1.65 V, half of its supply.
const BIAS_COUNTS: i32 = 1877;

/// What the signal path must know of a wearable with this front end.
///
/// # Errors
/// [`AdcScaleError`] when the constants above contradict each other.
pub fn board(boot_id: u32) -> Result<Board, AdcScaleError> {
    let volts_per_count = f64::from(RANGE_MV) / 1e3 / f64::from(COUNTS) / AMPLIFIER_GAIN;
    Ok(Board {
        boot_id,
        firmware_hash: [0; 8],
        adc: AdcScale::new(volts_per_count, BIAS_COUNTS, 0, COUNTS - 1)?,
        rates_hz: &[RATE_HZ],
    })
}

/// The voltage in millivolts above a divider of which the converter sees `part` of `whole`:
///
/// ```text
/// count / 4096 · 3600 mV · whole / part
/// ```
///
/// Below 0 V it is 0.
#[must_use]
pub fn millivolts(count: i16, [whole, part]: [i64; 2]) -> u16 {
    let at_input = i64::from(count.max(0)) * i64::from(RANGE_MV) * whole;
    u16::try_from(at_input / (i64::from(COUNTS) * part)).unwrap_or(u16::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_battery_above_its_divider_is_known_to_a_count() {
        // A count is 3.6 V / 4096 at the input: 0.88 mV, times 1510 / 510 above the XIAO's divider, times 5 of the DK.
        for (count, divider, battery_mv) in [
            // 4.2 V · 510 / 1510 = 1.41854 V = 1613.98 counts.
            (1_614, [1_510, 510], 4_200),
            // 3.3 V: 1.11457 V = 1268.1 counts.
            (1_268, [1_510, 510], 3_299),
            // 3 V / 5 = 682.7 counts; half of the range is 1.8 V.
            (683, [5, 1], 3_001),
            (2_048, [5, 1], 9_000),
            (0, [5, 1], 0),
            (-3, [1_510, 510], 0),
            (4_095, [1_510, 510], 10_656),
        ] {
            assert_eq!(millivolts(count, divider), battery_mv, "{count} counts");
        }
    }
}
