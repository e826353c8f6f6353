//! The nRF52840 DK with an ADS1294 on SPI and an LSM6DSO on I2C: the only file that names its pins, and the timer and
//! the programmable interconnect (PPI) channel of its front end.

#[macro_use]
mod shared;

use embassy_nrf::{
    Peri,
    gpio::{AnyPin, Input, Pull},
    peripherals,
};
use tonus_firmware::{
    battery::Battery,
    imu::{Address as AttitudeAddress, Model},
    storage::partitions::{self, Layout},
};

pub(crate) use shared::{
    ACQUISITION_INTERRUPT, AttitudeSensor, Board, Irqs, SIGNAL_PATH_INTERRUPT, Transport,
};

/// As a host reads it.
#[cfg(feature = "ble")]
pub(crate) const MODEL: &str = "nRF52840 DK";

/// Where everything lies in the flash.
pub(crate) const LAYOUT: Layout = partitions::DK;

/// What supplies it, unless USB does.
pub(crate) const BATTERY: Battery = Battery::COIN_CELL;

/// Of the supply the chip's own converter sees a fifth.
pub(crate) const BATTERY_DIVIDER: [i64; 2] = [5, 1];

/// Which attitude sensor it is.
pub(crate) const ATTITUDE_MODEL: Model = Model::Lsm6dso;

/// SDO on its board is pulled up.
pub(crate) const ATTITUDE_ADDRESS: AttitudeAddress = AttitudeAddress::High;

/// Turns the sensor's axes into the upper arm's, which they are when its z axis points from elbow to shoulder and its y axis
/// to the left of a hanging arm.
pub(crate) const MOUNTING: [f32; 4] = [0.0, 0.0, 0.0, 1.0];

/// 10 us at 64 MHz.
const PULL_UP_CYCLES: u32 = 640;

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
    /// Whether the ADS1294 is to measure itself first.
    pub(crate) self_test: bool,
}

/// The chip's own converter, which measures its supply.
pub(crate) struct BatteryInput {
    pub(crate) converter: Peri<'static, peripherals::SAADC>,
}

/// Starts the chip and shares it out. Call once.
pub(crate) fn take() -> Board {
    let chip = shared::start();
    let front_end = FrontEnd {
        converter: Converter {
            spi: chip.SPI3,
            clock: chip.P0_27.into(),
            to_chip: chip.P0_26.into(),
            from_chip: chip.P0_04.into(),
            select: chip.P0_28.into(),
            data_ready: chip.P0_29.into(),
            start: chip.P0_30.into(),
            reset: chip.P0_31.into(),
            edge_channel: chip.GPIOTE_CH0,
            timer: chip.TIMER3,
            capture: chip.PPI_CH0,
            self_test: held(chip.P0_12.into()),
        },
        battery: BatteryInput {
            converter: chip.SAADC,
        },
    };
    let attitude = AttitudeSensor {
        bus: chip.TWISPI0,
        data: chip.P1_08.into(),
        clock: chip.P0_25.into(),
    };
    // Button 1; the serial port is the board's debugger's, which shows it to the host.
    share!(chip, front_end, attitude, button: P0_11, to_host: P0_06, from_host: P0_08)
}

/// Whether a button, Button 2 here, is held down as the chip starts.
fn held(button: Peri<'static, AnyPin>) -> bool {
    let button = Input::new(button, Pull::Up);
    // The pull-up of 13 kOhm charges the pin's and the wire's capacitance within microseconds.
    cortex_m::asm::delay(PULL_UP_CYCLES);
    button.is_low()
}
