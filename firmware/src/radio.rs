//! The transport `ble`: Nordic's multiprotocol service layer (MPSL), the controller above it (SDC), and the tasks that
//! run them.

mod flash;

use embassy_executor::{SpawnError, Spawner};
use embassy_futures::select::select;
use embassy_nrf::{gpio::Input, mode::Async, rng::Rng};
use embassy_time::Instant;
use nrf_sdc::{
    Builder, Mem, SoftdeviceController,
    mpsl::{self, Hfclk, MultiprotocolServiceLayer, SessionMem, raw},
};
use static_cell::StaticCell;
use tonus_firmware::{
    ble::{self, DeviceInformation, KeptBonds, Notice, PairingWindow, Ports, Shown},
    keeper::Flash,
};
use tonus_shared::wire::Calibration;
use trouble_host::Address;

use crate::{
    INBOX, OUTBOX, VITALS,
    board::{self, Irqs, Transport},
    watchdog::{self, Handle},
};

/// The flash, which the radio's library writes between packets.
pub(crate) use flash::Nvm;

/// The calibration that a host reads.
static CALIBRATION: Shown = Shown::new();

/// Opened by the board's button.
static WINDOW: PairingWindow = PairingWindow::new();

/// Bytes per air packet: the longest that data length extension allows, less its header.
const PACKET_SIZE: u16 = 251;
/// Packets the controller holds. Two notifications fall into one 15 ms interval at 100 Hz; more places would
/// only let frames grow old when the link stalls.
const PACKETS: u8 = 3;
/// Memory of the controller in bytes. By the formulas of its header: link 2435, shared 17, advertising set
/// 574, accept list 68; the rest is reserve. It checks at start and says how much it wants.
const MEMORY: usize = 4096;
/// Whoever asks the library for time without radio packets: the flash.
const TIMESLOTS: usize = 1;
/// Accuracy of the board's 32 kHz crystal in parts per million.
const CRYSTAL_PPM: u16 = 50;

/// Why the radio does not run.
#[derive(defmt::Format)]
pub(crate) enum StartError {
    /// What Nordic's library returned: a resource in use, or too little [`MEMORY`].
    Library(nrf_sdc::Error),
    /// A task was started twice.
    Task(SpawnError),
}

/// Lets a host read this calibration from now on.
pub(crate) fn show(boot_id: u32, calibration: &Calibration) {
    if CALIBRATION.show(boot_id, calibration).is_err() {
        defmt::error!("the calibration in use fits no frame");
    }
}

/// What the tasks of the link need.
pub(crate) struct Link {
    controller: SoftdeviceController<'static>,
    address: Address,
    button: Input<'static>,
}

/// Starts both libraries.
///
/// # Errors
/// [`StartError`]; there is no way on but a reset.
pub(crate) async fn open(parts: Transport, spawner: Spawner) -> Result<(Link, Nvm), StartError> {
    let Transport {
        mpsl,
        controller,
        random,
        address,
        button,
        flash,
    } = parts;
    let (mpsl, controller) = libraries(mpsl, controller, random).map_err(StartError::Library)?;
    // Without the crystal the scan timer would follow the RC oscillator, hundreds of parts per million off.
    let crystal = mpsl.request_hfclk().await;
    if crystal.is_err() {
        defmt::error!("the crystal oscillator cannot be held: scan times drift");
    }
    spawner.spawn(drive(mpsl, crystal.ok()).map_err(StartError::Task)?);
    let link = Link {
        controller,
        address,
        button,
    };
    Ok((link, Nvm::new(mpsl::Flash::take(mpsl, flash))))
}

/// Starts the tasks that send what appears in the outbox, leave what comes in the inbox, and let hosts pair.
///
/// # Errors
/// When they were started before.
pub(crate) fn serve(
    link: Link,
    flash: &'static Flash<Nvm>,
    handle: Handle,
    spawner: Spawner,
) -> Result<(), SpawnError> {
    spawner.spawn(run(link.controller, link.address, flash, handle)?);
    spawner.spawn(open_window(link.button)?);
    Ok(())
}

/// What Nordic's libraries leave to be done outside their interrupts; holds the crystal oscillator.
#[embassy_executor::task]
async fn drive(mpsl: &'static MultiprotocolServiceLayer<'static>, _crystal: Option<Hfclk>) -> ! {
    mpsl.run().await
}

#[embassy_executor::task]
async fn run(
    controller: SoftdeviceController<'static>,
    address: Address,
    flash: &'static Flash<Nvm>,
    handle: Handle,
) {
    let ports = Ports {
        outbox: &OUTBOX,
        inbox: &INBOX,
        calibration: &CALIBRATION,
        window: &WINDOW,
        battery_percent: VITALS.battery_percent(),
        device: DeviceInformation {
            manufacturer: "Tonus",
            model: board::MODEL,
            firmware: env!("CARGO_PKG_VERSION"),
        },
    };
    let report = |notice| {
        if notice == Notice::Connected {
            VITALS.linked();
        }
        defmt::info!("{}", notice);
    };
    let mut bonds = KeptBonds(flash);
    let served = async {
        let Err(error) = ble::run(&controller, address, &ports, &mut bonds, report).await;
        defmt::error!("radio stopped, the wearable restarts: {}", error);
    };
    select(served, watchdog::beat(handle)).await;
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

fn libraries(
    mpsl: nrf_sdc::mpsl::Peripherals<'static>,
    controller: nrf_sdc::Peripherals<'static>,
    random: Rng<'static, Async>,
) -> Result<
    (
        &'static MultiprotocolServiceLayer<'static>,
        SoftdeviceController<'static>,
    ),
    nrf_sdc::Error,
> {
    static MPSL: StaticCell<MultiprotocolServiceLayer<'static>> = StaticCell::new();
    static RANDOM: StaticCell<Rng<'static, Async>> = StaticCell::new();
    static CONTROLLER: StaticCell<Mem<MEMORY>> = StaticCell::new();
    static SESSIONS: StaticCell<SessionMem<TIMESLOTS>> = StaticCell::new();

    let clock = raw::mpsl_clock_lfclk_cfg_t {
        source: raw::MPSL_CLOCK_LF_SRC_XTAL as u8,
        rc_ctiv: 0,
        rc_temp_ctiv: 0,
        accuracy_ppm: CRYSTAL_PPM,
        skip_wait_lfclk_started: false,
    };
    let mpsl = &*MPSL.init(MultiprotocolServiceLayer::with_timeslots(
        mpsl,
        Irqs,
        clock,
        SESSIONS.init(SessionMem::new()),
    )?);
    let controller = Builder::new()?
        .support_adv()
        .support_peripheral()
        .support_dle_peripheral()
        .support_le_2m_phy()
        .support_phy_update_peripheral()
        .support_le_privacy()
        .peripheral_count(1)?
        .buffer_cfg(PACKET_SIZE, PACKET_SIZE, PACKETS, PACKETS)?
        .build(
            controller,
            RANDOM.init(random),
            mpsl,
            CONTROLLER.init(Mem::new()),
        )?;
    Ok((mpsl, controller))
}
