//! The attitude sensor on the upper arm: ST LSM6DSO (beside the DK, I2C) and LSM6DS3TR-C (on the XIAO).
//!
//! Both chips share the eight registers that are needed, bit for bit, and differ in WHO_AM_I; so one small driver serves
//! both. (The crates `lsm6dso` and `lsm6ds3tr` each check for their own chip, and the latter blocks the bus.)
//! Datasheets: ST DS12140 (LSM6DSO) and DocID030071 (LSM6DS3TR-C), "Register description".
//!
//! | addr | register  | written | meaning |
//! |------|-----------|---------|---------|
//! | 0Fh  | WHO_AM_I  |         | 6Ch LSM6DSO, 6Ah LSM6DS3TR-C |
//! | 10h  | CTRL1_XL  | 58h     | ODR_XL 0101 = 208 Hz, FS_XL 10 = ±4 g |
//! | 11h  | CTRL2_G   | 58h     | ODR_G 0101 = 208 Hz, FS_G 10 = ±1000 °/s |
//! | 12h  | CTRL3_C   | 01h     | SW_RESET, clears itself |
//! |      |           | 44h     | BDU: no value changes half read; IF_INC: a burst goes on to the next address |
//! | 1Eh  | STATUS_REG|         | bit 0 XLDA, bit 1 GDA: new acceleration, new rate |
//! | 22h… | OUTX_L_G… |         | rate x, y, z, two bytes each, low byte first |
//! | 28h… | OUTX_L_A… |         | acceleration x, y, z |

pub mod attitude;
mod sampling;

pub use sampling::{ImuEvent, sample};

use embassy_futures::select::{Either, select};
use embedded_hal::i2c;
use embedded_hal_async::{delay::DelayNs, i2c::I2c};
use tonus_shared::stiffness::GRAVITY_M_S2;

const WHO_AM_I: u8 = 0x0f;
const CTRL1_XL: u8 = 0x10;
const CTRL2_G: u8 = 0x11;
const CTRL3_C: u8 = 0x12;
const STATUS_REG: u8 = 0x1e;

const SW_RESET: u8 = 1 << 0;
const BDU_IF_INC: u8 = 1 << 6 | 1 << 2;
const HZ_208: u8 = 0b0101 << 4;
const FS_4_G: u8 = 0b10 << 2;
const FS_1000_DPS: u8 = 0b10 << 2;
const NEW_DATA: u8 = 0b11;

/// STATUS_REG to the last acceleration, through an empty byte and the temperature.
const BURST_BYTES: usize = 0x2e - 0x1e;
const RATE_AT: usize = 0x22 - 0x1e;
const ACCELERATION_AT: usize = 0x28 - 0x1e;

/// From supply to the first command: 15 ms (LSM6DS3TR-C), 10 ms (LSM6DSO).
const BOOT_MS: u32 = 20;
/// A reset takes 50 us.
const RESET_US: u32 = 100;
const RESET_TRIES: u32 = 10;
/// A burst of 18 bytes takes 2 ms at 100 kHz, 0.5 ms at 400 kHz.
const TRANSFER_LIMIT_US: u32 = 5_000;

/// Acceleration per count at ±4 g: 0.122 mg.
const ACCELERATION_STEP_M_S2: f32 = (0.122e-3 * GRAVITY_M_S2) as f32;
/// Rate per count at ±1000 °/s: 35 mdps.
const RATE_STEP_RAD_S: f32 = (35e-3 * core::f64::consts::PI / 180.0) as f32;

/// Measurements a second. The chip's own oscillator is good to some per cent; who reads it takes the time of reading.
pub const RATE_HZ: u32 = 208;

/// Which chip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Model {
    /// On a board of its own.
    Lsm6dso,
    /// On the XIAO nRF52840 Sense.
    Lsm6ds3trC,
}

impl Model {
    const fn who_am_i(self) -> u8 {
        match self {
            Self::Lsm6dso => 0x6c,
            Self::Lsm6ds3trC => 0x6a,
        }
    }
}

/// Address on the bus, by the level of the pin SDO/SA0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Address {
    /// Low: 6Ah (also the XIAO's).
    Low = 0x6a,
    /// High: 6Bh.
    High = 0x6b,
}

/// One measurement, in the sensor's axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// Acceleration less gravity's, m/s^2: +g along the axis that points up at rest.
    pub acceleration_m_s2: [f32; 3],
    /// Rate of rotation, rad/s, right-handed.
    pub rate_rad_s: [f32; 3],
}

/// Why the sensor gave nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub enum ImuError {
    /// The bus reported an error; without acknowledgement nobody is at that address.
    #[error("I2C failed ({0:?}): check SDA, SCL, the address pin and the supply")]
    I2c(#[cfg_attr(target_os = "none", defmt(Debug2Format))] i2c::ErrorKind),
    /// A transfer did not end.
    #[error("I2C transfer did not end within {limit_us} us: somebody holds SCL low")]
    I2cStuck {
        /// How long was waited, us.
        limit_us: u32,
    },
    /// Another chip.
    #[error(
        "WHO_AM_I reads {got:#04x} instead of {expected:#04x}: check the board and the address pin"
    )]
    WrongId {
        /// That of the model.
        expected: u8,
        /// What was read.
        got: u8,
    },
    /// It does not come out of its reset.
    #[error("the sensor stays in reset: switch its supply off and on")]
    InReset,
    /// It answers, but measures nothing new.
    #[error("no new measurement in {polls} readings: the sensor lost its settings")]
    Stalled {
        /// Readings in a row without a new one.
        polls: u32,
    },
    /// A register does not hold what was written.
    #[error(
        "register {register:#04x} reads {got:#04x} instead of {expected:#04x}: check the bus's pull-ups"
    )]
    ReadBack {
        /// Address.
        register: u8,
        /// What was written.
        expected: u8,
        /// What was read.
        got: u8,
    },
}

/// An LSM6DSO or LSM6DS3TR-C.
///
/// After an error, [`Self::initialise`] again: the sensor may have lost its supply and its settings.
#[derive(Debug)]
pub struct Imu<B, D> {
    bus: B,
    delay: D,
    model: Model,
    address: u8,
}

impl<B: I2c, D: DelayNs> Imu<B, D> {
    /// Takes the bus; nothing is sent yet.
    pub const fn new(bus: B, delay: D, model: Model, address: Address) -> Self {
        Self {
            bus,
            delay,
            model,
            address: address as u8,
        }
    }

    /// Waits for its boot, checks which chip it is, resets it and starts both sensors at [`RATE_HZ`].
    ///
    /// # Errors
    /// [`ImuError`].
    pub async fn initialise(&mut self) -> Result<(), ImuError> {
        self.delay.delay_ms(BOOT_MS).await;
        let expected = self.model.who_am_i();
        let got = self.read(WHO_AM_I).await?;
        if got != expected {
            return Err(ImuError::WrongId { expected, got });
        }
        self.write(CTRL3_C, SW_RESET).await?;
        for attempt in 1.. {
            self.delay.delay_us(RESET_US).await;
            if self.read(CTRL3_C).await? & SW_RESET == 0 {
                break;
            }
            if attempt == RESET_TRIES {
                return Err(ImuError::InReset);
            }
        }
        for (register, value) in [
            (CTRL3_C, BDU_IF_INC),
            (CTRL1_XL, HZ_208 | FS_4_G),
            (CTRL2_G, HZ_208 | FS_1000_DPS),
        ] {
            self.write(register, value).await?;
            let got = self.read(register).await?;
            if got != value {
                return Err(ImuError::ReadBack {
                    register,
                    expected: value,
                    got,
                });
            }
        }
        Ok(())
    }

    /// The newest measurement, read in one burst; none when there is none since the last.
    ///
    /// # Errors
    /// [`ImuError::I2c`], [`ImuError::I2cStuck`].
    pub async fn measure(&mut self) -> Result<Option<Motion>, ImuError> {
        let mut burst = [0; BURST_BYTES];
        self.read_from(STATUS_REG, &mut burst).await?;
        if burst[0] & NEW_DATA != NEW_DATA {
            return Ok(None);
        }
        Ok(Some(Motion {
            acceleration_m_s2: vector(&burst, ACCELERATION_AT, ACCELERATION_STEP_M_S2),
            rate_rad_s: vector(&burst, RATE_AT, RATE_STEP_RAD_S),
        }))
    }

    async fn read(&mut self, register: u8) -> Result<u8, ImuError> {
        let mut value = [0];
        self.read_from(register, &mut value).await?;
        Ok(value[0])
    }

    async fn read_from(&mut self, register: u8, values: &mut [u8]) -> Result<(), ImuError> {
        let register = [register];
        let transfer = self.bus.write_read(self.address, &register, values);
        in_time(transfer, &mut self.delay).await
    }

    async fn write(&mut self, register: u8, value: u8) -> Result<(), ImuError> {
        let bytes = [register, value];
        let transfer = self.bus.write(self.address, &bytes);
        in_time(transfer, &mut self.delay).await
    }
}

async fn in_time<E: i2c::Error>(
    transfer: impl Future<Output = Result<(), E>>,
    delay: &mut impl DelayNs,
) -> Result<(), ImuError> {
    match select(transfer, delay.delay_us(TRANSFER_LIMIT_US)).await {
        Either::First(ended) => ended.map_err(|error| ImuError::I2c(error.kind())),
        Either::Second(()) => Err(ImuError::I2cStuck {
            limit_us: TRANSFER_LIMIT_US,
        }),
    }
}

/// Three little-endian words from `at`.
fn vector(burst: &[u8; BURST_BYTES], at: usize, step: f32) -> [f32; 3] {
    core::array::from_fn(|axis| {
        let low = at + 2 * axis;
        f32::from(i16::from_le_bytes([burst[low], burst[low + 1]])) * step
    })
}

#[cfg(test)]
mod tests;
