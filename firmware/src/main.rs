//! The wearable on an nRF52840: wires pins, clocks and radio to the portable parts in the library.
#![no_std]
#![no_main]

mod board;
mod front_end;
mod radio;

use defmt_rtt as _;
use panic_probe as _;

use core::sync::atomic::AtomicU8;

use embassy_executor::{InterruptExecutor, Spawner};
use embassy_nrf::{gpio::Input, interrupt};
use embassy_time::Instant;
use nrf_sdc::{SoftdeviceController, mpsl::MultiprotocolServiceLayer};
use tonus_firmware::{
    acquisition::{BUFFER_SCANS, PERIOD_US, RATE_HZ, ScanClock},
    ble::{self, BondList, Bonds, BondsNotKept, DeviceInformation, PairingWindow, Ports, Shown},
    inbox::Inbox,
    outbox::Outbox,
    signal_path::SignalPath,
};
use tonus_shared::pipeline;
use trouble_host::Address;

/// Runs the signal path above the thread: pairing computes on a curve for hundreds of milliseconds there,
/// many times the 5 ms in which a converter buffer must be taken.
static SIGNAL_PATH: InterruptExecutor = InterruptExecutor::new();

/// From the signal path to the radio.
static OUTBOX: Outbox = Outbox::new();

/// From the radio to whoever handles requests.
static INBOX: Inbox = Inbox::new();

/// The calibration that a host reads.
static CALIBRATION: Shown = Shown::new();

/// Opened by the board's button.
static WINDOW: PairingWindow = PairingWindow::new();

/// State of charge, percent; not measured yet.
static BATTERY_PERCENT: AtomicU8 = AtomicU8::new(0);

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
    let (mpsl, controller) = match radio::start(board.radio) {
        Ok(parts) => parts,
        Err(error) => {
            defmt::error!("radio did not start: {}", error);
            return;
        }
    };
    // Without the crystal the scan timer would follow the RC oscillator, hundreds of parts per million off;
    // the guard keeps it running.
    let crystal = mpsl.request_hfclk().await;
    if crystal.is_err() {
        defmt::error!("the crystal oscillator cannot be held: scan times drift");
    }
    let urgent = SIGNAL_PATH.start(board::SIGNAL_PATH_INTERRUPT);
    let tasks = (
        acquire(board.front_end, board.boot_id),
        drive_radio(mpsl),
        serve(controller, board.address),
        open_window(board.button),
    );
    let (Ok(acquire), Ok(drive_radio), Ok(serve), Ok(open_window)) = tasks else {
        defmt::error!("a task was started twice");
        return;
    };
    urgent.spawn(acquire);
    spawner.spawn(drive_radio);
    spawner.spawn(serve);
    spawner.spawn(open_window);
    core::future::pending::<()>().await;
}

/// What Nordic's libraries leave to be done outside their interrupts.
#[embassy_executor::task]
async fn drive_radio(mpsl: &'static MultiprotocolServiceLayer<'static>) -> ! {
    mpsl.run().await
}

#[embassy_executor::task]
async fn serve(controller: SoftdeviceController<'static>, address: Address) {
    let ports = Ports {
        outbox: &OUTBOX,
        inbox: &INBOX,
        calibration: &CALIBRATION,
        window: &WINDOW,
        battery_percent: &BATTERY_PERCENT,
        device: DeviceInformation {
            manufacturer: "Tonus",
            model: board::MODEL,
            firmware: env!("CARGO_PKG_VERSION"),
        },
    };
    let report = |notice| defmt::info!("{}", notice);
    let Err(error) = ble::run(&controller, address, &ports, &mut UntilReset, report).await;
    defmt::error!("radio stopped, reset the wearable: {}", error);
}

/// Lets a host pair when a person presses the button.
#[embassy_executor::task]
async fn open_window(mut button: Input<'static>) -> ! {
    loop {
        button.wait_for_falling_edge().await;
        WINDOW.press(Instant::now());
        defmt::info!("a host may pair for {} s", ble::OPEN.as_secs());
    }
}

/// Bonds that last until the wearable is reset, and say so.
struct UntilReset;

impl Bonds for UntilReset {
    async fn load(&mut self) -> BondList {
        BondList::new()
    }

    async fn store(&mut self, _: &BondList) -> Result<(), BondsNotKept> {
        Err(BondsNotKept)
    }
}

/// Runs in [`SIGNAL_PATH`], below every hardware interrupt and above all else.
#[embassy_executor::task]
async fn acquire(parts: board::FrontEnd, boot_id: u32) {
    let Ok(adc) = front_end::scale() else {
        defmt::error!("the front end's constants are impossible");
        return;
    };
    let wearable = pipeline::Board {
        boot_id,
        firmware_hash: [0; 8],
        adc,
        rates_hz: &[RATE_HZ],
    };
    let calibration = pipeline::illustrative(front_end::MUSCLES, RATE_HZ);
    let Ok(mut signal_path) = SignalPath::new(wearable, &calibration) else {
        defmt::error!("the illustrative calibration is impossible on this board");
        return;
    };
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
            defmt::error!("a packet could not be left for the radio");
        }
    })
    .await;
}
