//! The Seeed XIAO nRF52840 Sense with four analogue sEMG amplifiers: the only file that names its pins, and the timer
//! and the programmable interconnect (PPI) channels of its front end.

#[macro_use]
mod shared;

use embassy_nrf::{
    Peri,
    gpio::{Level, Output, OutputDrive},
    peripherals,
    saadc::{AnyInput, Input},
};
use tonus_firmware::{
    acquisition::CHANNELS,
    battery::Battery,
    imu::{Address as AttitudeAddress, Model},
    storage::partitions::{self, Layout},
};

pub(crate) use shared::{
    ACQUISITION_INTERRUPT, AttitudeSensor, Board, Irqs, SIGNAL_PATH_INTERRUPT, Transport,
};

/// As a host reads it.
#[cfg(feature = "ble")]
pub(crate) const MODEL: &str = "XIAO nRF52840 Sense";

/// Where everything lies in the flash.
pub(crate) const LAYOUT: Layout = partitions::XIAO;

/// What supplies it, unless USB does.
pub(crate) const BATTERY: Battery = Battery::LITHIUM_POLYMER;

/// Kilohms of the whole divider, and of the part that the converter sees.
pub(crate) const BATTERY_DIVIDER: [i64; 2] = [1_000 + 510, 510];

/// Which attitude sensor it is.
pub(crate) const ATTITUDE_MODEL: Model = Model::Lsm6ds3trC;

/// SDO is tied to ground on the board.
pub(crate) const ATTITUDE_ADDRESS: AttitudeAddress = AttitudeAddress::Low;

/// Turns the sensor's axes into the upper arm's: the board lies flat on the outer side of a hanging right arm, parts
/// outwards (sensor z to the right), sensor x up. The arm's axes are y to the left, z from elbow to shoulder.
pub(crate) const MOUNTING: [f32; 4] = [0.5, -0.5, 0.5, 0.5];

/// The chip's own converter, and a timer that paces it without the processor.
pub(crate) struct FrontEnd {
    pub(crate) converter: Peri<'static, peripherals::SAADC>,
    /// One amplifier for each channel.
    pub(crate) amplifiers: [AnyInput<'static>; CHANNELS],
    /// Behind [`BATTERY_DIVIDER`].
    pub(crate) battery: AnyInput<'static>,
    pub(crate) timer: Peri<'static, peripherals::TIMER3>,
    pub(crate) restart: Peri<'static, peripherals::PPI_CH0>,
    pub(crate) pace: Peri<'static, peripherals::PPI_CH1>,
}

/// Starts the chip and shares it out. Call once.
pub(crate) fn take() -> Board {
    let chip = shared::start();
    // Connects the divider, for ever: it takes 3 uA, and without it the battery's whole voltage is at the input.
    let divider_switch = chip.P0_14;
    Output::new(divider_switch, Level::Low, OutputDrive::Standard).persist();
    // The attitude sensor and its pull-ups hang on this pin. It is up in 3 ms, and nobody talks to the sensor before.
    let attitude_supply = chip.P1_08;
    Output::new(
        attitude_supply,
        Level::High,
        OutputDrive::Standard0HighDrive1,
    )
    .persist();
    let front_end = FrontEnd {
        converter: chip.SAADC,
        amplifiers: [
            chip.P0_02.degrade_saadc(),
            chip.P0_03.degrade_saadc(),
            chip.P0_28.degrade_saadc(),
            chip.P0_29.degrade_saadc(),
        ],
        battery: chip.P0_31.degrade_saadc(),
        timer: chip.TIMER3,
        restart: chip.PPI_CH0,
        pace: chip.PPI_CH1,
    };
    let attitude = AttitudeSensor {
        bus: chip.TWISPI0,
        data: chip.P0_07.into(),
        clock: chip.P0_27.into(),
    };
    share!(chip, front_end, attitude, button: P1_15, to_host: P1_11, from_host: P1_12)
}
