//! The transport `ble`: Nordic's multiprotocol service layer (MPSL), the controller above it (SDC), and the tasks that
//! run them.

use embassy_executor::{SpawnError, Spawner};
use nrf_sdc::{
    Builder, Mem, SoftdeviceController,
    mpsl::{Hfclk, MultiprotocolServiceLayer, raw},
};
use static_cell::StaticCell;
use tonus_firmware::{ble, outbox::Outbox};
use trouble_host::Address;

use crate::board::{Irqs, Transport};

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

/// Starts both libraries and the tasks that send what appears in `outbox`.
///
/// # Errors
/// [`StartError`]; there is no way on but a reset.
pub(crate) async fn start(
    parts: Transport,
    spawner: Spawner,
    outbox: &'static Outbox,
) -> Result<(), StartError> {
    let address = parts.address;
    let (mpsl, controller) = libraries(parts).map_err(StartError::Library)?;
    // Without the crystal the scan timer would follow the RC oscillator, hundreds of parts per million off.
    let crystal = mpsl.request_hfclk().await;
    if crystal.is_err() {
        defmt::error!("the crystal oscillator cannot be held: scan times drift");
    }
    spawner.spawn(drive(mpsl, crystal.ok()).map_err(StartError::Task)?);
    spawner.spawn(serve(controller, address, outbox).map_err(StartError::Task)?);
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
) {
    let report = |notice| defmt::info!("{}", notice);
    if let Err(error) = ble::run(controller, address, outbox, report).await {
        defmt::error!("radio stopped, reset the wearable: {}", error);
    }
}

fn libraries(
    radio: Transport,
) -> Result<
    (
        &'static MultiprotocolServiceLayer<'static>,
        SoftdeviceController<'static>,
    ),
    nrf_sdc::Error,
> {
    static MPSL: StaticCell<MultiprotocolServiceLayer<'static>> = StaticCell::new();
    static RANDOM: StaticCell<embassy_nrf::rng::Rng<'static, embassy_nrf::mode::Async>> =
        StaticCell::new();
    static CONTROLLER: StaticCell<Mem<MEMORY>> = StaticCell::new();

    let clock = raw::mpsl_clock_lfclk_cfg_t {
        source: raw::MPSL_CLOCK_LF_SRC_XTAL as u8,
        rc_ctiv: 0,
        rc_temp_ctiv: 0,
        accuracy_ppm: CRYSTAL_PPM,
        skip_wait_lfclk_started: false,
    };
    let mpsl = &*MPSL.init(MultiprotocolServiceLayer::new(radio.mpsl, Irqs, clock)?);
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
            radio.controller,
            RANDOM.init(radio.random),
            mpsl,
            CONTROLLER.init(Mem::new()),
        )?;
    Ok((mpsl, controller))
}
