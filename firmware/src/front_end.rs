//! One sEMG channel through the chip's own converter (SAADC).

use embassy_nrf::{
    saadc::{CallbackResult, ChannelConfig, Config, Saadc},
    timer::Frequency,
};
use embassy_time::Instant;
use tonus_firmware::acquisition::{BUFFER_SCANS, CHANNELS, PERIOD_US};
use tonus_shared::{
    sample::{AdcScale, AdcScaleError},
    wire::Muscle,
};

use crate::board::{self, Irqs};

/// Where the electrode pair sits.
pub(crate) const MUSCLES: [Muscle; CHANNELS] = [Muscle::BicepsLong];
/// Counts of the 12-bit converter.
const COUNTS: i32 = 4096;
/// Its range: 0.6 V internal reference at a gain of one sixth.
const RANGE_V: f64 = 3.6;
/// Gain of the analogue amplifier between electrodes and converter.
const AMPLIFIER_GAIN: f64 = 200.0;
/// What the amplifier gives for 0 V at the electrodes: 1.65 V, half of its supply.
const BIAS_COUNTS: i32 = 1877;

/// Counts to volts at the electrodes.
///
/// # Errors
/// [`AdcScaleError`] when the constants above contradict each other.
pub(crate) fn scale() -> Result<AdcScale, AdcScaleError> {
    let volts_per_count = RANGE_V / f64::from(COUNTS) / AMPLIFIER_GAIN;
    AdcScale::new(volts_per_count, BIAS_COUNTS, 0, COUNTS - 1)
}

/// Converts for ever and hands each full buffer, with the device time at which it was seen, to `full`.
///
/// The timer counts microseconds and starts a scan every [`PERIOD_US`] through PPI, whatever the processor
/// does. Two buffers alternate: `full` has one buffer's time before the next is overwritten, which the
/// converter does silently.
pub(crate) async fn convert(
    parts: board::FrontEnd,
    mut full: impl FnMut(u64, &[[i16; CHANNELS]; BUFFER_SCANS]),
) {
    let mut converter = Saadc::new(
        parts.converter,
        Irqs,
        Config::default(),
        [ChannelConfig::single_ended(parts.electrodes)],
    );
    converter.calibrate().await;
    let mut buffers = [[[0; CHANNELS]; BUFFER_SCANS]; 2];
    converter
        .run_task_sampler(
            parts.timer,
            parts.restart,
            parts.pace,
            Frequency::F1MHz,
            PERIOD_US,
            &mut buffers,
            |scans| {
                // The sampler lends whole buffers only.
                if let Ok(buffer) = scans.try_into() {
                    full(Instant::now().as_micros(), buffer);
                }
                CallbackResult::Continue
            },
        )
        .await;
}
