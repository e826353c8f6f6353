//! One sEMG channel through the chip's own converter (SAADC).

use embassy_nrf::{
    saadc::{CallbackResult, ChannelConfig, Config, Saadc},
    timer::Frequency,
};
use embassy_time::Instant;
use tonus_firmware::acquisition::{Block, ScanClock};

use crate::board::{self, Irqs};

/// Channels that are converted.
pub(crate) const CHANNELS: usize = 1;
/// Scans per second.
pub(crate) const RATE_HZ: u32 = 1000;
/// Scans per buffer: one stream packet's worth at 100 Hz would be 10; half of it halves the wait.
pub(crate) const BUFFER_SCANS: usize = 5;

const TIMER_HZ: u32 = 1_000_000;
const PERIOD_US: u32 = 1_000_000 / RATE_HZ;

/// Converts for ever and hands each full buffer to `scans`.
///
/// Two buffers alternate: `scans` has one buffer's time (5 ms) before the next is overwritten. The converter
/// loses buffers silently; [`ScanClock`] finds the hole from the time of the next one.
pub(crate) async fn convert(
    parts: board::FrontEnd,
    mut scans: impl FnMut(Block, &[[i16; CHANNELS]]),
) {
    let mut converter = Saadc::new(
        parts.converter,
        Irqs,
        Config::default(),
        [ChannelConfig::single_ended(parts.electrodes)],
    );
    converter.calibrate().await;
    let mut clock = ScanClock::new(PERIOD_US, BUFFER_SCANS as u32);
    let mut buffers = [[[0; CHANNELS]; BUFFER_SCANS]; 2];
    converter
        .run_task_sampler(
            parts.timer,
            parts.restart,
            parts.pace,
            Frequency::F1MHz,
            TIMER_HZ / RATE_HZ,
            &mut buffers,
            |full| {
                scans(clock.buffer_full(Instant::now().as_micros()), full);
                CallbackResult::Continue
            },
        )
        .await;
}
