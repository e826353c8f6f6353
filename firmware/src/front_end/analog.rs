//! One sEMG channel through the chip's own converter (SAADC).

use embassy_nrf::{
    saadc::{CallbackResult, ChannelConfig, Config, Saadc},
    timer::Frequency,
};
use embassy_time::Instant;
use tonus_firmware::acquisition::{BUFFER_SCANS, CHANNELS, PERIOD_US};

use crate::board::{self, Irqs};

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
