//! The wearable on an nRF52840: wires pins, clocks and radio to the portable parts in the library.
#![no_std]
#![no_main]

mod board;
mod front_end;
mod radio;

use defmt_rtt as _;
use panic_probe as _;

use embassy_executor::{InterruptExecutor, Spawner};
use embassy_nrf::interrupt;
use nrf_sdc::{SoftdeviceController, mpsl::MultiprotocolServiceLayer};
use tonus_firmware::ble::{self, Frame, Outbox};
use tonus_shared::Real;
use trouble_host::Address;

/// Runs the signal path above the thread: pairing computes on a curve for hundreds of milliseconds there,
/// many times the 5 ms in which a converter buffer must be taken.
static SIGNAL_PATH: InterruptExecutor = InterruptExecutor::new();

/// From the signal path to the radio.
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
    let (front_end, radio) = board::take();
    let address = radio.address;
    let started = radio::start(radio);
    let (mpsl, controller) = match started {
        Ok(parts) => parts,
        Err(error) => {
            defmt::error!("radio did not start: {}", error);
            return;
        }
    };
    let signal_path = SIGNAL_PATH.start(board::SIGNAL_PATH_INTERRUPT);
    match (
        acquire(front_end),
        drive_mpsl(mpsl),
        serve(controller, address),
    ) {
        (Ok(acquire), Ok(mpsl), Ok(serve)) => {
            signal_path.spawn(acquire);
            spawner.spawn(mpsl);
            spawner.spawn(serve);
        }
        _ => defmt::error!("a task was started twice"),
    }
}

#[embassy_executor::task]
async fn drive_mpsl(mpsl: &'static MultiprotocolServiceLayer<'static>) -> ! {
    mpsl.run().await
}

#[embassy_executor::task]
async fn serve(controller: SoftdeviceController<'static>, address: Address) {
    let report = |notice| defmt::info!("{}", notice);
    if let Err(error) = ble::run(controller, address, &OUTBOX, report).await {
        defmt::error!("radio stopped, reset the wearable: {}", error);
    }
}

#[embassy_executor::task]
async fn acquire(parts: board::FrontEnd) {
    let mut envelope = 0.0_f32;
    front_end::convert(parts, |block, scans| {
        for [count] in scans {
            let rectified = f32::from(*count).abs();
            envelope += (rectified - envelope) * f32::of(0.03);
        }
        if block.lost > 0 {
            defmt::warn!("{} scans lost", block.lost);
        }
        let mut frame = Frame::new();
        if frame.extend_from_slice(&envelope.to_le_bytes()).is_ok() {
            OUTBOX.signal(frame);
        }
    })
    .await;
}
