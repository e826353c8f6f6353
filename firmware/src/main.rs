//! The wearable on an nRF52840: wires pins, clocks and a transport to the portable parts in the library.
#![no_std]
#![no_main]

mod board;
mod front_end;
#[cfg(feature = "ble")]
mod radio;
#[cfg(feature = "wired")]
mod serial;

use defmt_rtt as _;
use panic_probe as _;

use embassy_executor::{InterruptExecutor, Spawner};
use embassy_nrf::interrupt;
#[cfg(feature = "ble")]
use radio as transport;
#[cfg(feature = "wired")]
use serial as transport;
use tonus_firmware::{outbox::Outbox, signal_path::SignalPath};

/// Runs the signal path above the thread: pairing computes on a curve for hundreds of milliseconds there,
/// many times the 5 ms in which a converter buffer must be taken.
static SIGNAL_PATH: InterruptExecutor = InterruptExecutor::new();

/// From the signal path to the transport.
static OUTBOX: Outbox = Outbox::new();

#[interrupt]
#[allow(
    unsafe_code,
    reason = "the handler runs only after `start` has unmasked it, and nothing else calls the executor"
)]
unsafe fn EGU1_SWI1() {
    // SAFETY: `InterruptExecutor::start` initialised the executor before it unmasked this interrupt, and
    // this handler is the only caller.
    unsafe { SIGNAL_PATH.on_interrupt() }
}

#[embassy_executor::main]
async fn main(spawner: Spawner) {
    let board = board::take();
    if let Err(error) = transport::start(board.transport, spawner, &OUTBOX).await {
        defmt::error!("the transport did not start: {}", error);
        return;
    }
    let urgent = SIGNAL_PATH.start(board::SIGNAL_PATH_INTERRUPT);
    match acquire(board.front_end, board.boot_id) {
        Ok(acquire) => urgent.spawn(acquire),
        Err(error) => defmt::error!("acquisition did not start: {}", error),
    }
}

/// Runs in [`SIGNAL_PATH`], below every hardware interrupt and above all else.
#[embassy_executor::task]
async fn acquire(parts: board::FrontEnd, boot_id: u32) {
    let Ok(mut signal_path) = SignalPath::new(boot_id) else {
        defmt::error!("the signal path's constants are impossible");
        return;
    };
    front_end::convert(parts, |seen_us, buffer| {
        match signal_path.buffer_full(seen_us, buffer, &OUTBOX) {
            Ok(block) if block.lost > 0 => defmt::warn!("{} scans lost", block.lost),
            Ok(_) => {}
            Err(_) => defmt::error!("a frame could not be encoded"),
        }
    })
    .await;
}
