//! One watchdog, a handle for each task: one that hangs resets the chip.
//!
//! A task pets its handle where it makes progress: with every scan, every attitude, every turn of its loop. Tasks that wait for
//! others wake once a second to do so.

use embassy_nrf::{
    Peri, peripherals,
    wdt::{Config, HaltConfig, Watchdog, WatchdogHandle},
};
use embassy_time::{Duration, Timer};

/// Longer than a front end or sensor that failed is left alone, many times longer than erasing a page of flash takes.
const TIMEOUT_TICKS: u32 = 4 * 32_768;
/// Between two signs of life of a task that waits.
const BEAT: Duration = Duration::from_secs(1);

/// For one task.
pub(crate) type Handle = WatchdogHandle;

/// One for each task.
pub(crate) struct Handles {
    pub(crate) acquisition: Handle,
    pub(crate) signal_path: Handle,
    pub(crate) attitude: Handle,
    pub(crate) keeper: Handle,
    pub(crate) recognition: Handle,
    pub(crate) transport: Handle,
}

/// Starts it; nothing stops it again. None when it runs already with other settings, which a bootloader's would.
pub(crate) fn start(watchdog: Peri<'static, peripherals::WDT>) -> Option<Handles> {
    let mut config = Config::default();
    config.timeout_ticks = TIMEOUT_TICKS;
    config.action_during_debug_halt = HaltConfig::Pause;
    let (_, handles) = Watchdog::try_new(watchdog, config).ok()?;
    let [
        acquisition,
        signal_path,
        attitude,
        keeper,
        recognition,
        transport,
    ] = handles;
    Some(Handles {
        acquisition,
        signal_path,
        attitude,
        keeper,
        recognition,
        transport,
    })
}

/// Pets for as long as the task that it is part of is run.
pub(crate) async fn beat(mut handle: Handle) -> ! {
    loop {
        handle.pet();
        Timer::after(BEAT).await;
    }
}
