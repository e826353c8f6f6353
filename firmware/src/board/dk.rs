//! The nRF52840 DK with an ADS1294 on SPI and an LSM6DSO on I2C: the only file that names its pins, timers, programmable
//! interconnect (PPI) channels and interrupt priorities.
//!
//! With the radio, Nordic's libraries own RADIO, TIMER0, RTC0, CLOCK, TEMP and PPI 17 to 31. Priorities, urgent
//! first: 0 radio; 2 time driver, data-ready edge; 3 converter, sensor; 4 radio library's own work, serial port;
//! 5 acquisition; 6 signal path; then the thread.

#[cfg(feature = "wired")]
use embassy_nrf::buffered_uarte;
use embassy_nrf::{
    Peri, bind_interrupts,
    config::{Config, HfclkSource, LfclkSource},
    gpio::AnyPin,
    interrupt::{self, InterruptExt, Priority},
    pac, peripherals,
    rng::{self, Rng},
    saadc, spim, twim,
};
#[cfg(feature = "ble")]
use embassy_nrf::{
    gpio::{Input, Pull},
    mode::Async,
};
#[cfg(feature = "ble")]
use nrf_sdc::mpsl::{ClockInterruptHandler, HighPrioInterruptHandler, LowPrioInterruptHandler};
use tonus_firmware::{
    battery::Battery,
    imu::{Address as AttitudeAddress, Model},
    reset,
    storage::partitions::{self, Layout},
};
use tonus_shared::wire::ResetReason;
#[cfg(feature = "ble")]
use trouble_host::Address;

#[cfg(feature = "wired")]
bind_interrupts!(pub(crate) struct Irqs {
    RNG => rng::InterruptHandler<peripherals::RNG>;
    SAADC => saadc::InterruptHandler;
    SPIM3 => spim::InterruptHandler<peripherals::SPI3>;
    TWISPI0 => twim::InterruptHandler<peripherals::TWISPI0>;
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
    SPIM3 => spim::InterruptHandler<peripherals::SPI3>;
    TWISPI0 => twim::InterruptHandler<peripherals::TWISPI0>;
});

/// As a host reads it.
#[cfg(feature = "ble")]
pub(crate) const MODEL: &str = "nRF52840 DK";

/// Where everything lies in the flash.
pub(crate) const LAYOUT: Layout = partitions::DK;

/// What supplies it, unless USB does.
pub(crate) const BATTERY: Battery = Battery::COIN_CELL;

/// Which attitude sensor it is.
pub(crate) const ATTITUDE_MODEL: Model = Model::Lsm6dso;

/// SDO on its board is pulled up.
pub(crate) const ATTITUDE_ADDRESS: AttitudeAddress = AttitudeAddress::High;

/// Turns the sensor's axes into the upper arm's, which they are when its z axis points from elbow to shoulder and its y axis
/// to the left of a hanging arm.
pub(crate) const MOUNTING: [f32; 4] = [0.0, 0.0, 0.0, 1.0];

/// The software interrupt that runs the front end.
pub(crate) const ACQUISITION_INTERRUPT: interrupt::Interrupt = interrupt::EGU1_SWI1;

/// The software interrupt that runs the signal path above the thread.
pub(crate) const SIGNAL_PATH_INTERRUPT: interrupt::Interrupt = interrupt::EGU2_SWI2;

/// The front end's parts.
pub(crate) struct FrontEnd {
    pub(crate) converter: Converter,
    pub(crate) battery: BatteryInput,
}

/// The ADS1294, and a timer that its data-ready edges capture without the processor.
pub(crate) struct Converter {
    pub(crate) spi: Peri<'static, peripherals::SPI3>,
    pub(crate) clock: Peri<'static, AnyPin>,
    pub(crate) to_chip: Peri<'static, AnyPin>,
    pub(crate) from_chip: Peri<'static, AnyPin>,
    pub(crate) select: Peri<'static, AnyPin>,
    pub(crate) data_ready: Peri<'static, AnyPin>,
    pub(crate) start: Peri<'static, AnyPin>,
    pub(crate) reset: Peri<'static, AnyPin>,
    pub(crate) edge_channel: Peri<'static, peripherals::GPIOTE_CH0>,
    pub(crate) timer: Peri<'static, peripherals::TIMER3>,
    pub(crate) capture: Peri<'static, peripherals::PPI_CH0>,
}

/// The chip's own converter, which measures its supply.
pub(crate) struct BatteryInput {
    pub(crate) converter: Peri<'static, peripherals::SAADC>,
}

/// The LSM6DSO.
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
    /// Button 1; low while pressed.
    pub(crate) button: Input<'static>,
    pub(crate) flash: Peri<'static, peripherals::NVMC>,
}

/// What the serial port needs: its pins, and a counter of received bytes that runs without the processor; and the flash.
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

/// Starts clocks and time, sets every priority, and shares out the chip. Call once.
pub(crate) fn take() -> Board {
    let mut config = Config::default();
    config.hfclk_source = HfclkSource::ExternalXtal;
    config.lfclk_source = LfclkSource::ExternalXtal;
    config.gpiote_interrupt_priority = Priority::P2;
    config.time_interrupt_priority = Priority::P2;
    let p = embassy_nrf::init(config);
    interrupt::SAADC.set_priority(Priority::P3);
    interrupt::SPIM3.set_priority(Priority::P3);
    interrupt::TWISPI0.set_priority(Priority::P3);
    #[cfg(feature = "wired")]
    interrupt::UARTE0.set_priority(Priority::P4);
    ACQUISITION_INTERRUPT.set_priority(Priority::P5);
    SIGNAL_PATH_INTERRUPT.set_priority(Priority::P6);

    let front_end = FrontEnd {
        converter: Converter {
            spi: p.SPI3,
            clock: p.P0_27.into(),
            to_chip: p.P0_26.into(),
            from_chip: p.P0_04.into(),
            select: p.P0_28.into(),
            data_ready: p.P0_29.into(),
            start: p.P0_30.into(),
            reset: p.P0_31.into(),
            edge_channel: p.GPIOTE_CH0,
            timer: p.TIMER3,
            capture: p.PPI_CH0,
        },
        battery: BatteryInput { converter: p.SAADC },
    };
    let attitude = AttitudeSensor {
        bus: p.TWISPI0,
        data: p.P1_08.into(),
        clock: p.P0_25.into(),
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
        flash: p.NVMC,
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
        flash: p.NVMC,
    };
    Board {
        front_end,
        attitude,
        transport,
        watchdog: p.WDT,
        boot_id,
        reset_reason: reset_reason(),
    }
}

/// Reads why the chip started, and clears it: the reasons add up otherwise.
fn reset_reason() -> ResetReason {
    let reasons = pac::POWER.resetreas().read();
    pac::POWER.resetreas().write_value(reasons);
    reset::reason(reasons.0)
}

/// The factory's random number as a static random address: its two highest bits must be set.
#[cfg(feature = "ble")]
fn static_address() -> Address {
    let low = pac::FICR.deviceaddr(0).read().to_le_bytes();
    let high = pac::FICR.deviceaddr(1).read().to_le_bytes();
    Address::random([low[0], low[1], low[2], low[3], high[0], high[1] | 0xc0])
}
