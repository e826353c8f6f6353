//! Four sEMG channels through the chip's own converter (SAADC), and the battery as a fifth.
//!
//! The timer counts microseconds and starts a scan every [`PERIOD_US`] through PPI, whatever the processor does. Two
//! buffers alternate: [`acquire`] has one buffer's time before the next is overwritten, which the converter does
//! silently, and the clock notices.

use embassy_executor::{SendSpawner, SpawnError, Spawner};
use embassy_nrf::{
    saadc::{CallbackResult, ChannelConfig, Config, Saadc, Time},
    timer::Frequency,
};
use embassy_time::{Duration, Instant};
use tonus_firmware::{
    acquisition::{BUFFER_SCANS, CHANNELS, Event, PERIOD_US, ScanClock},
    afe::saadc,
};
use tonus_shared::{pipeline, sample::AdcScaleError};

use crate::{
    EVENTS, VITALS,
    board::{self, Irqs},
    watchdog::Handle,
};

/// What is converted in each scan: every channel, then the battery.
const INPUTS: usize = CHANNELS + 1;
/// Enough for a source of 400 kilohms, and the battery's divider has 338 (product specification, SAADC, acquisition
/// time); an amplifier takes less than the usual 10 us, which is for 100. With 2 us a conversion a scan takes 70 us.
const BATTERY_ACQUISITION: Time = Time::_20US;
/// Between two looks at the battery.
const BATTERY: Duration = Duration::from_secs(10);

/// What the signal path must know of a wearable with this front end.
pub(crate) fn wearable(boot_id: u32) -> Result<pipeline::Board, AdcScaleError> {
    saadc::board(boot_id)
}

/// Starts to acquire, and to look at the battery.
pub(crate) fn start(
    parts: board::FrontEnd,
    handle: Handle,
    urgent: SendSpawner,
    _: Spawner,
) -> Result<(), SpawnError> {
    urgent.spawn(acquire(parts, handle)?);
    Ok(())
}

/// Converts for ever.
#[embassy_executor::task]
async fn acquire(parts: board::FrontEnd, mut handle: Handle) {
    let [first, second, third, fourth] = parts.amplifiers.map(ChannelConfig::single_ended);
    let mut battery = ChannelConfig::single_ended(parts.battery);
    battery.time = BATTERY_ACQUISITION;
    let inputs = [first, second, third, fourth, battery];
    let mut converter = Saadc::new(parts.converter, Irqs, Config::default(), inputs);
    converter.calibrate().await;

    let mut clock = ScanClock::new(PERIOD_US, BUFFER_SCANS as u32);
    let mut look_at = Instant::now();
    let mut buffers = [[[0; INPUTS]; BUFFER_SCANS]; 2];
    converter
        .run_task_sampler(
            parts.timer,
            parts.restart,
            parts.pace,
            Frequency::F1MHz,
            PERIOD_US,
            &mut buffers,
            |buffer| {
                handle.pet();
                let now = Instant::now();
                take(&mut clock, now, buffer);
                if let Some([.., count]) = buffer.last()
                    && look_at <= now
                {
                    look_at = now + BATTERY;
                    let battery_mv = saadc::millivolts(*count, board::BATTERY_DIVIDER);
                    VITALS.set_battery(&board::BATTERY, battery_mv);
                }
                CallbackResult::Continue
            },
        )
        .await;
}

/// Hands a full buffer to the signal path. Amplifiers of this kind do not tell whether an electrode is off.
fn take(clock: &mut ScanClock, seen: Instant, buffer: &[[i16; INPUTS]]) {
    let block = clock.buffer_full(seen.as_micros());
    VITALS.lost_scans(block.lost);
    let channels = buffer.iter().map(|[channels @ .., _]| *channels);
    for scan in block.scans(PERIOD_US, channels) {
        EVENTS.put(Event::Scan {
            scan,
            lead_off: [false; CHANNELS],
        });
    }
}
