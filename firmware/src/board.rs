//! The nRF52840 DK: the only file that names pins, timers, programmable interconnect (PPI) channels and
//! interrupt priorities.
//!
//! With the radio, Nordic's libraries own RADIO, TIMER0, RTC0, CLOCK, TEMP and PPI 17 to 31. Priorities, urgent
//! first: 0 radio; 2 time driver; 3 converter; 4 radio library's own work, serial port; 6 signal path; then the
//! thread.

#[cfg(feature = "wired")]
use embassy_nrf::buffered_uarte;
use embassy_nrf::{
    Peri, bind_interrupts,
    config::{Config, HfclkSource, LfclkSource},
    interrupt::{self, InterruptExt, Priority},
    peripherals,
    rng::{self, Rng},
    saadc,
};
#[cfg(feature = "ble")]
use embassy_nrf::{
    gpio::{Input, Pull},
    mode::Async,
    pac,
};
#[cfg(feature = "ble")]
use nrf_sdc::mpsl::{ClockInterruptHandler, HighPrioInterruptHandler, LowPrioInterruptHandler};
#[cfg(feature = "ble")]
use trouble_host::Address;

#[cfg(feature = "wired")]
bind_interrupts!(pub(crate) struct Irqs {
    RNG => rng::InterruptHandler<peripherals::RNG>;
    SAADC => saadc::InterruptHandler;
    UARTE0 => buffered_uarte::InterruptHandler<peripherals::UARTE0>;
});

#[cfg(feature = "ble")]
bind_interrupts!(pub(crate) struct Irqs {
    RNG => rng::InterruptHandler<peripherals::RNG>;
    EGU0_SWI0 => LowPrioInterruptHandler;
    CLOCK_POWER => ClockInterruptHandler;
    RADIO => HighPrioInterruptHandler;
    TIMER0 => HighPrioInterruptHandler;
    RTC0 => HighPrioInterruptHandler;
    SAADC => saadc::InterruptHandler;
});

/// As a host reads it.
#[cfg(feature = "ble")]
pub(crate) const MODEL: &str = "nRF52840 DK";

/// The software interrupt that runs the signal path above the thread.
pub(crate) const SIGNAL_PATH_INTERRUPT: interrupt::Interrupt = interrupt::EGU1_SWI1;

/// What the converter needs: its input, and a timer that starts every scan without the processor.
pub(crate) struct FrontEnd {
    pub(crate) converter: Peri<'static, peripherals::SAADC>,
    /// AIN0: the conditioned output of one sEMG electrode pair.
    pub(crate) electrodes: Peri<'static, peripherals::P0_02>,
    pub(crate) timer: Peri<'static, peripherals::TIMER1>,
    pub(crate) restart: Peri<'static, peripherals::PPI_CH0>,
    pub(crate) pace: Peri<'static, peripherals::PPI_CH1>,
}

/// What Nordic's libraries need.
#[cfg(feature = "ble")]
pub(crate) struct Transport {
    pub(crate) mpsl: nrf_sdc::mpsl::Peripherals<'static>,
    pub(crate) controller: nrf_sdc::Peripherals<'static>,
    pub(crate) random: Rng<'static, Async>,
    pub(crate) address: Address,
    /// Button 1; low while pressed.
    pub(crate) button: Input<'static>,
}

/// What the serial port needs: its pins, and a counter of received bytes that runs without the processor.
#[cfg(feature = "wired")]
pub(crate) struct Transport {
    pub(crate) port: Peri<'static, peripherals::UARTE0>,
    /// To the board's debugger, which shows it to the host as a serial port.
    pub(crate) to_host: Peri<'static, peripherals::P0_06>,
    pub(crate) from_host: Peri<'static, peripherals::P0_08>,
    pub(crate) byte_counter: Peri<'static, peripherals::TIMER2>,
    pub(crate) count: Peri<'static, peripherals::PPI_CH2>,
    pub(crate) restart: Peri<'static, peripherals::PPI_CH3>,
    pub(crate) restart_once: Peri<'static, peripherals::PPI_GROUP0>,
}

/// The chip, shared out.
pub(crate) struct Board {
    pub(crate) front_end: FrontEnd,
    pub(crate) transport: Transport,
    /// Random; tells one start from another.
    pub(crate) boot_id: u32,
}

/// Starts clocks and time, sets every priority, and shares out the chip. Call once.
pub(crate) fn take() -> Board {
    let mut config = Config::default();
    config.hfclk_source = HfclkSource::ExternalXtal;
    config.lfclk_source = LfclkSource::ExternalXtal;
    config.gpiote_interrupt_priority = Priority::P2;
    config.time_interrupt_priority = Priority::P2;
    let p = embassy_nrf::init(config);
    interrupt::SAADC.set_priority(Priority::P3);
    #[cfg(feature = "wired")]
    interrupt::UARTE0.set_priority(Priority::P4);
    SIGNAL_PATH_INTERRUPT.set_priority(Priority::P6);

    let front_end = FrontEnd {
        converter: p.SAADC,
        electrodes: p.P0_02,
        timer: p.TIMER1,
        restart: p.PPI_CH0,
        pace: p.PPI_CH1,
    };
    let mut random = Rng::new(p.RNG, Irqs);
    let boot_id = random.blocking_next_u32();
    #[cfg(feature = "wired")]
    let transport = Transport {
        port: p.UARTE0,
        to_host: p.P0_06,
        from_host: p.P0_08,
        byte_counter: p.TIMER2,
        count: p.PPI_CH2,
        restart: p.PPI_CH3,
        restart_once: p.PPI_GROUP0,
    };
    #[cfg(feature = "ble")]
    let transport = Transport {
        mpsl: nrf_sdc::mpsl::Peripherals::new(
            p.RTC0, p.TIMER0, p.TEMP, p.PPI_CH19, p.PPI_CH30, p.PPI_CH31,
        ),
        controller: nrf_sdc::Peripherals::new(
            p.PPI_CH17, p.PPI_CH18, p.PPI_CH20, p.PPI_CH21, p.PPI_CH22, p.PPI_CH23, p.PPI_CH24,
            p.PPI_CH25, p.PPI_CH26, p.PPI_CH27, p.PPI_CH28, p.PPI_CH29,
        ),
        random,
        address: static_address(),
        button: Input::new(p.P0_11, Pull::Up),
    };
    Board {
        front_end,
        transport,
        boot_id,
    }
}

#[cfg(feature = "ble")]
/// The factory's random number as a static random address: its two highest bits must be set.
fn static_address() -> Address {
    let low = pac::FICR.deviceaddr(0).read().to_le_bytes();
    let high = pac::FICR.deviceaddr(1).read().to_le_bytes();
    Address::random([low[0], low[1], low[2], low[3], high[0], high[1] | 0xc0])
}
