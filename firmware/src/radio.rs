//! Nordic's radio: the multiprotocol service layer (MPSL) and the controller above it (SDC).

use nrf_sdc::{
    Builder, Mem, SoftdeviceController,
    mpsl::{MultiprotocolServiceLayer, raw},
};
use static_cell::StaticCell;

use crate::board::{Irqs, Radio};

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

/// Starts both libraries.
///
/// # Errors
/// What Nordic's library returned: a resource in use, or too little [`MEMORY`].
pub(crate) fn start(
    radio: Radio,
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
