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
use embassy_time::Instant;
#[cfg(feature = "ble")]
use radio as transport;
#[cfg(feature = "wired")]
use serial as transport;
use tonus_firmware::{
    acquisition::{BUFFER_SCANS, PERIOD_US, RATE_HZ, ScanClock},
    afe::saadc,
    inbox::Inbox,
    outbox::Outbox,
    requests::{self, Effect},
    signal_path::SignalPath,
};
use tonus_shared::pipeline;

/// Runs the signal path above the thread: pairing computes on a curve for hundreds of milliseconds there,
/// many times the 5 ms in which a converter buffer must be taken.
static SIGNAL_PATH: InterruptExecutor = InterruptExecutor::new();

/// From the signal path to the transport.
static OUTBOX: Outbox = Outbox::new();

/// From the transport to the signal path.
static INBOX: Inbox = Inbox::new();

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
    if let Err(error) = transport::start(board.transport, spawner, (&OUTBOX, &INBOX)).await {
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
    let Ok(wearable) = saadc::board(boot_id) else {
        defmt::error!("the front end's constants are impossible");
        return;
    };
    let calibration = pipeline::illustrative(saadc::MUSCLES, RATE_HZ);
    let Ok(mut signal_path) = SignalPath::new(wearable, &calibration) else {
        defmt::error!("the illustrative calibration is impossible on this board");
        return;
    };
    transport::show(boot_id, signal_path.calibration());
    let mut clock = ScanClock::new(PERIOD_US, BUFFER_SCANS as u32);
    front_end::convert(parts, |seen_us, buffer| {
        let block = clock.buffer_full(seen_us);
        if block.lost > 0 {
            defmt::warn!("{} scans lost", block.lost);
        }
        if signal_path
            .buffer_full(block, PERIOD_US, buffer, &OUTBOX)
            .is_err()
        {
            defmt::error!("a packet could not be left for the transport");
        }
        signal_path.set_health(pipeline::Health {
            refused_requests: INBOX.refused(),
            ..pipeline::Health::default()
        });
        while let Some(frame) = INBOX.try_take() {
            match requests::handle(&mut signal_path, frame, Instant::now().as_micros(), &OUTBOX) {
                Effect::Recalibrated => transport::show(boot_id, signal_path.calibration()),
                Effect::None => {}
            }
        }
    })
    .await;
}
