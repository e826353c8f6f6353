//! What every board shares: how the chip starts, and which of its parts serve the transport. The boards add their pins.
//!
//! With the radio, Nordic's libraries own RADIO, TIMER0, RTC0, CLOCK, TEMP and PPI 17 to 31. Priorities, urgent
//! first: 0 radio; 2 time driver, pin edges; 3 converter, sensor; 4 radio library's own work, serial port;
//! 5 acquisition; 6 signal path; then the thread.

#[cfg(feature = "wired")]
use embassy_nrf::buffered_uarte;
#[cfg(feature = "dk-ads129x")]
use embassy_nrf::spim;
use embassy_nrf::{
    Peri, Peripherals, bind_interrupts,
    config::{Config, HfclkSource, LfclkSource},
    gpio::AnyPin,
    interrupt::{self, InterruptExt, Priority},
    pac, peripherals, rng, saadc, twim,
};
#[cfg(feature = "ble")]
use embassy_nrf::{gpio::Input, mode::Async, rng::Rng};
#[cfg(feature = "ble")]
use nrf_sdc::mpsl::{ClockInterruptHandler, HighPrioInterruptHandler, LowPrioInterruptHandler};
use tonus_firmware::reset;
use tonus_shared::wire::ResetReason;
#[cfg(feature = "ble")]
use trouble_host::Address;

use super::FrontEnd;

bind_interrupts!(pub(crate) struct Irqs {
    RNG => rng::InterruptHandler<peripherals::RNG>;
    SAADC => saadc::InterruptHandler;
    TWISPI0 => twim::InterruptHandler<peripherals::TWISPI0>;
    #[cfg(feature = "dk-ads129x")]
    SPIM3 => spim::InterruptHandler<peripherals::SPI3>;
    #[cfg(feature = "wired")]
    UARTE0 => buffered_uarte::InterruptHandler<peripherals::UARTE0>;
    #[cfg(feature = "ble")]
    EGU0_SWI0 => LowPrioInterruptHandler;
    #[cfg(feature = "ble")]
    CLOCK_POWER => ClockInterruptHandler;
    #[cfg(feature = "ble")]
    RADIO => HighPrioInterruptHandler;
    #[cfg(feature = "ble")]
    TIMER0 => HighPrioInterruptHandler;
    #[cfg(feature = "ble")]
    RTC0 => HighPrioInterruptHandler;
});

/// The software interrupt that runs the front end.
pub(crate) const ACQUISITION_INTERRUPT: interrupt::Interrupt = interrupt::EGU1_SWI1;

/// The software interrupt that runs the signal path above the thread.
pub(crate) const SIGNAL_PATH_INTERRUPT: interrupt::Interrupt = interrupt::EGU2_SWI2;

/// The bus of the attitude sensor.
pub(crate) struct AttitudeSensor {
    pub(crate) bus: Peri<'static, peripherals::TWISPI0>,
    pub(crate) data: Peri<'static, AnyPin>,
    pub(crate) clock: Peri<'static, AnyPin>,
}

/// What Nordic's libraries need, and the flash, which is written between their radio's packets.
#[cfg(feature = "ble")]
pub(crate) struct Transport {
    pub(crate) mpsl: nrf_sdc::mpsl::Peripherals<'static>,
    pub(crate) controller: nrf_sdc::Peripherals<'static>,
    pub(crate) random: Rng<'static, Async>,
    pub(crate) address: Address,
    /// Lets a host pair; low while pressed.
    pub(crate) button: Input<'static>,
    pub(crate) flash: Peri<'static, peripherals::NVMC>,
}

/// What the serial port needs: its pins, and a counter of received bytes that runs without the processor; and the flash.
#[cfg(feature = "wired")]
pub(crate) struct Transport {
    pub(crate) port: Peri<'static, peripherals::UARTE0>,
    pub(crate) to_host: Peri<'static, AnyPin>,
    pub(crate) from_host: Peri<'static, AnyPin>,
    pub(crate) byte_counter: Peri<'static, peripherals::TIMER2>,
    pub(crate) count: Peri<'static, peripherals::PPI_CH2>,
    pub(crate) restart: Peri<'static, peripherals::PPI_CH3>,
    pub(crate) restart_once: Peri<'static, peripherals::PPI_GROUP0>,
    pub(crate) flash: Peri<'static, peripherals::NVMC>,
}

/// The chip, shared out.
pub(crate) struct Board {
    pub(crate) front_end: FrontEnd,
    pub(crate) attitude: AttitudeSensor,
    pub(crate) transport: Transport,
    pub(crate) watchdog: Peri<'static, peripherals::WDT>,
    /// Random; tells one start from another.
    pub(crate) boot_id: u32,
    pub(crate) reset_reason: ResetReason,
}

/// Starts clocks and time, and sets every priority that the radio's library does not. Call once.
pub(super) fn start() -> Peripherals {
    let mut config = Config::default();
    config.hfclk_source = HfclkSource::ExternalXtal;
    config.lfclk_source = LfclkSource::ExternalXtal;
    config.gpiote_interrupt_priority = Priority::P2;
    config.time_interrupt_priority = Priority::P2;
    let chip = embassy_nrf::init(config);
    interrupt::SAADC.set_priority(Priority::P3);
    interrupt::TWISPI0.set_priority(Priority::P3);
    #[cfg(feature = "dk-ads129x")]
    interrupt::SPIM3.set_priority(Priority::P3);
    #[cfg(feature = "wired")]
    interrupt::UARTE0.set_priority(Priority::P4);
    ACQUISITION_INTERRUPT.set_priority(Priority::P5);
    SIGNAL_PATH_INTERRUPT.set_priority(Priority::P6);
    chip
}

/// Makes the board: takes what every board needs out of the chip, whose pins alone differ. A macro, because a function
/// cannot be lent a chip of which some pins are gone.
macro_rules! share {
    (
        $chip:ident, $front_end:expr, $attitude:expr,
        button: $button:ident, to_host: $to_host:ident, from_host: $from_host:ident $(,)?
    ) => {{
        let mut random = embassy_nrf::rng::Rng::new($chip.RNG, shared::Irqs);
        let boot_id = random.blocking_next_u32();
        #[cfg(feature = "wired")]
        let transport = shared::Transport {
            port: $chip.UARTE0,
            to_host: $chip.$to_host.into(),
            from_host: $chip.$from_host.into(),
            byte_counter: $chip.TIMER2,
            count: $chip.PPI_CH2,
            restart: $chip.PPI_CH3,
            restart_once: $chip.PPI_GROUP0,
            flash: $chip.NVMC,
        };
        #[cfg(feature = "ble")]
        let transport = shared::Transport {
            mpsl: nrf_sdc::mpsl::Peripherals::new(
                $chip.RTC0,
                $chip.TIMER0,
                $chip.TEMP,
                $chip.PPI_CH19,
                $chip.PPI_CH30,
                $chip.PPI_CH31,
            ),
            controller: nrf_sdc::Peripherals::new(
                $chip.PPI_CH17,
                $chip.PPI_CH18,
                $chip.PPI_CH20,
                $chip.PPI_CH21,
                $chip.PPI_CH22,
                $chip.PPI_CH23,
                $chip.PPI_CH24,
                $chip.PPI_CH25,
                $chip.PPI_CH26,
                $chip.PPI_CH27,
                $chip.PPI_CH28,
                $chip.PPI_CH29,
            ),
            random,
            address: shared::static_address(),
            button: embassy_nrf::gpio::Input::new($chip.$button, embassy_nrf::gpio::Pull::Up),
            flash: $chip.NVMC,
        };
        shared::Board {
            front_end: $front_end,
            attitude: $attitude,
            transport,
            watchdog: $chip.WDT,
            boot_id,
            reset_reason: shared::reset_reason(),
        }
    }};
}

/// Reads why the chip started, and clears it: the reasons add up otherwise.
pub(super) fn reset_reason() -> ResetReason {
    let reasons = pac::POWER.resetreas().read();
    pac::POWER.resetreas().write_value(reasons);
    reset::reason(reasons.0)
}

/// The factory's random number as a static random address: its two highest bits must be set.
#[cfg(feature = "ble")]
pub(super) fn static_address() -> Address {
    let low = pac::FICR.deviceaddr(0).read().to_le_bytes();
    let high = pac::FICR.deviceaddr(1).read().to_le_bytes();
    Address::random([low[0], low[1], low[2], low[3], high[0], high[1] | 0xc0])
}
