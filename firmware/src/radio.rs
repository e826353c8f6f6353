//! The transport `ble`: Nordic's multiprotocol service layer (MPSL), the controller above it (SDC), and the tasks that
//! run them.

use core::sync::atomic::AtomicU8;

use embassy_executor::{SpawnError, Spawner};
use embassy_nrf::{gpio::Input, mode::Async, rng::Rng};
use embassy_time::Instant;
use nrf_sdc::{
    Builder, Mem, SoftdeviceController,
    mpsl::{Hfclk, MultiprotocolServiceLayer, raw},
};
use static_cell::StaticCell;
use tonus_firmware::{
    ble::{self, BondList, Bonds, BondsNotKept, DeviceInformation, PairingWindow, Ports, Shown},
    inbox::Inbox,
    outbox::Outbox,
};
use tonus_shared::wire::Calibration;
use trouble_host::Address;

use crate::board::{self, Irqs, Transport};

/// The calibration that a host reads.
static CALIBRATION: Shown = Shown::new();

/// Opened by the board's button.
static WINDOW: PairingWindow = PairingWindow::new();

/// State of charge, percent; not measured yet.
static BATTERY_PERCENT: AtomicU8 = AtomicU8::new(0);

/// Bytes per air packet: the longest that data length extension allows, less its header.
const PACKET_SIZE: u16 = 251;
/// Packets the controller holds. Two notifications fall into one 15 ms interval at 100 Hz; more places would
/// only let frames grow old when the link stalls.
const PACKETS: u8 = 3;
/// Memory of the controller in bytes. By the formulas of its header: link 2435, shared 17, advertising set
/// 574, accept list 68; the rest is reserve. It checks at start and says how much it wants.
const MEMORY: usize = 4096;
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

/// Starts both libraries and the tasks that send what appears in the outbox and leave what comes in the inbox.
///
/// # Errors
/// [`StartError`]; there is no way on but a reset.
pub(crate) async fn start(
    parts: Transport,
    spawner: Spawner,
    (outbox, inbox): (&'static Outbox, &'static Inbox),
) -> Result<(), StartError> {
    let Transport {
        mpsl,
        controller,
        random,
        address,
        button,
    } = parts;
    let (mpsl, controller) = libraries(mpsl, controller, random).map_err(StartError::Library)?;
    // Without the crystal the scan timer would follow the RC oscillator, hundreds of parts per million off.
    let crystal = mpsl.request_hfclk().await;
    if crystal.is_err() {
        defmt::error!("the crystal oscillator cannot be held: scan times drift");
    }
    spawner.spawn(drive(mpsl, crystal.ok()).map_err(StartError::Task)?);
    spawner.spawn(serve(controller, address, outbox, inbox).map_err(StartError::Task)?);
    spawner.spawn(open_window(button).map_err(StartError::Task)?);
    Ok(())
}

/// What Nordic's libraries leave to be done outside their interrupts; holds the crystal oscillator.
#[embassy_executor::task]
async fn drive(mpsl: &'static MultiprotocolServiceLayer<'static>, _crystal: Option<Hfclk>) -> ! {
    mpsl.run().await
}

#[embassy_executor::task]
async fn serve(
    controller: SoftdeviceController<'static>,
    address: Address,
    outbox: &'static Outbox,
    inbox: &'static Inbox,
) {
    let ports = Ports {
        outbox,
        inbox,
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

    let clock = raw::mpsl_clock_lfclk_cfg_t {
        source: raw::MPSL_CLOCK_LF_SRC_XTAL as u8,
        rc_ctiv: 0,
        rc_temp_ctiv: 0,
        accuracy_ppm: CRYSTAL_PPM,
        skip_wait_lfclk_started: false,
    };
    let mpsl = &*MPSL.init(MultiprotocolServiceLayer::new(mpsl, Irqs, clock)?);
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
