//! TI ADS1294 and ADS1298: four or eight amplifiers and 24-bit converters on one SPI bus (datasheet SBAS459).
//!
//! SPI mode 1 (clock idles low, data change on its rising edge), at most 4 MHz: the chip needs `4 t_CLK` (2 us) for
//! each byte of a command, which is then just the time that a byte takes ("Sending multi-byte commands").

mod error;
mod frame;
mod registers;
mod self_test;
mod settings;

pub use error::Ads129xError;
pub use frame::Conversion;
pub use registers::Register;
pub use self_test::{SelfTest, SelfTestError};
pub use settings::{
    Gain, Input, LeadOff, LeadOffCurrent, LeadOffThreshold, REFERENCE_V, Rate, Settings,
};

use core::convert::Infallible;

use embassy_futures::select::{Either, select};
use embedded_hal::{
    digital::OutputPin,
    spi::{Error as _, Operation},
};
use embedded_hal_async::{delay::DelayNs, spi::SpiDevice};
use tonus_shared::{pipeline::Board, sample::AdcScaleError};

use super::{DataReady, Edge};
use registers::command;

/// From supply to reset: `t_POR = 2^18 t_CLK`, 128 ms at 2.048 MHz, and room for a slow oscillator.
const POWER_ON_US: u32 = 150_000;
/// Reset pulse: at least `2 t_CLK`, 1 us.
const RESET_PULSE_US: u32 = 10;
/// From reset to the first command: `18 t_CLK`, 9 us.
const RESET_RECOVERY_US: u32 = 20;
/// Start-up of the internal reference: 150 ms, typical; twice that.
const REFERENCE_US: u32 = 300_000;
/// Between the last clock of a command and the end of chip select: `4 t_CLK`.
const HOLD_NS: u32 = 2_000;
/// A transfer takes at most 0.3 ms (27 bytes at 1 MHz).
const TRANSFER_LIMIT_US: u32 = 1_000;
/// An edge is waited for by two periods of the slowest oscillator, so that one lost edge costs one scan and
/// two count as a fault.
const EDGE_LIMIT_PERCENT: u32 = 210;
/// The digital filter settles within five periods of START.
const FIRST_EDGE_PERIODS: u32 = 8;
/// Registers in one block: two bytes of command, then CONFIG1 to CH8SET.
const BLOCK_BYTES: usize = 2 + 12;

/// What the signal path must know of a wearable with this front end, set so.
///
/// # Errors
/// None for any settings; the type is that of [`Gain::scale`].
pub fn board<const C: usize>(boot_id: u32, settings: &Settings<C>) -> Result<Board, AdcScaleError> {
    Ok(Board {
        boot_id,
        firmware_hash: [0; 8],
        adc: settings.gain.scale()?,
        rates_hz: match settings.rate {
            Rate::Hz1000 => const { &[Rate::Hz1000.hz()] },
            Rate::Hz2000 => const { &[Rate::Hz2000.hz()] },
        },
    })
}

/// A converter with `C` channels: 4 for the ADS1294, 8 for the ADS1298.
///
/// `reset` is its RESET pin (low resets) and `start` its START pin; PWDN is tied to its digital supply.
#[derive(Debug)]
pub struct Ads129x<const C: usize, S, R, T, D> {
    spi: S,
    reset: R,
    start: T,
    delay: D,
    settings: Settings<C>,
    /// Whether an edge has come since the start.
    running: bool,
}

impl<const C: usize, S, R, T, D> Ads129x<C, S, R, T, D>
where
    S: SpiDevice,
    R: OutputPin<Error = Infallible>,
    T: OutputPin<Error = Infallible>,
    D: DelayNs,
{
    /// ID register: bits 7 to 5 are 100 for the family, bit 4 is 1, bits 2 to 0 count the channels (SBAS459,
    /// "ID").
    const ID: u8 = {
        assert!(C == 4 || C == 8, "ADS1294 has 4 channels, ADS1298 has 8");
        if C == 4 { 0x90 } else { 0x92 }
    };

    /// Takes the pins; nothing is sent yet.
    pub fn new(spi: S, reset: R, start: T, delay: D, settings: Settings<C>) -> Self {
        Self {
            spi,
            reset,
            start,
            delay,
            settings,
            running: false,
        }
    }

    /// The settings that [`Self::initialise`] writes.
    pub fn settings(&self) -> &Settings<C> {
        &self.settings
    }

    /// Waits until the supply has settled, then [`Self::initialise`]. 0.5 s.
    ///
    /// # Errors
    /// As [`Self::initialise`].
    pub async fn power_up(&mut self) -> Result<(), Ads129xError> {
        self.hold();
        let Ok(()) = self.reset.set_high();
        self.delay.delay_us(POWER_ON_US).await;
        self.initialise().await
    }

    /// Resets the chip, checks what it is, writes every register, reads each back, and starts conversions
    /// (SBAS459, "Initial flow at power-up"). 0.3 s, nearly all of it the reference's start.
    ///
    /// # Errors
    /// [`Ads129xError`]: a bus that fails, another chip, a register that does not hold its value.
    pub async fn initialise(&mut self) -> Result<(), Ads129xError> {
        let settings = self.settings;
        self.configure(&settings).await
    }

    async fn configure(&mut self, settings: &Settings<C>) -> Result<(), Ads129xError> {
        self.hold();
        let Ok(()) = self.reset.set_low();
        self.delay.delay_us(RESET_PULSE_US).await;
        let Ok(()) = self.reset.set_high();
        self.delay.delay_us(RESET_RECOVERY_US).await;

        self.transfer(&mut [command::SDATAC]).await?;
        let [id] = self.read(Register::ID).await?;
        if id != Self::ID {
            return Err(Ads129xError::WrongId {
                expected: Self::ID,
                got: id,
            });
        }
        // First the reference, which needs time.
        self.write(Register::CONFIG3, &[settings.config3()]).await?;
        self.delay.delay_us(REFERENCE_US).await;
        self.write_all(settings).await?;

        let Ok(()) = self.start.set_high();
        self.transfer(&mut [command::RDATAC]).await
    }

    /// Writes every register that differs from reset, and reads each back.
    async fn write_all(&mut self, settings: &Settings<C>) -> Result<(), Ads129xError> {
        let configs = [
            settings.config1(),
            settings.config2(),
            settings.config3(),
            settings.loff(),
        ];
        self.write_checked(Register::CONFIG1, &configs).await?;
        self.write_checked(Register::CH1SET, &settings.chnset())
            .await?;
        self.write_checked(Register::RLD_SENSP, &settings.senses())
            .await?;
        // Unused pins as outputs: as inputs, the reset state, they must not float.
        self.write_checked(Register::GPIO, &[0x00]).await?;
        self.write_checked(Register::CONFIG4, &[settings.config4()])
            .await
    }

    /// Waits for the next conversion and reads it.
    ///
    /// **Budget.** One period from edge to the last bit; the sheet lets a frame be read until the next edge.
    ///
    /// # Errors
    /// [`Ads129xError::NoEdge`] after two periods (after the start: eight); a bus that fails; a status word
    /// that does not begin with 1100.
    pub async fn next(
        &mut self,
        edges: &mut impl DataReady,
    ) -> Result<(Edge, Conversion<C>), Ads129xError> {
        let sensed = self.settings.lead_off_mask();
        self.next_sensed(edges, sensed).await
    }

    async fn next_sensed(
        &mut self,
        edges: &mut impl DataReady,
        sensed: u8,
    ) -> Result<(Edge, Conversion<C>), Ads129xError> {
        let period_us = self.settings.rate.period_us();
        let limit_us = if self.running {
            period_us * EDGE_LIMIT_PERCENT / 100
        } else {
            edges.clear();
            period_us * FIRST_EDGE_PERIODS
        };
        let edge = match select(edges.edge(), self.delay.delay_us(limit_us)).await {
            Either::First(edge) => edge,
            Either::Second(()) => return Err(Ads129xError::NoEdge { limit_us }),
        };
        self.running = true;
        let mut buffer = [0; frame::MAX_BYTES];
        // Both lengths fit: 15 or 27 bytes of 27.
        let frame = &mut buffer[..3 * (1 + C)];
        self.transfer(frame).await?;
        Ok((edge, frame::decode(frame, sensed)?))
    }

    /// Stops conversions at the pin.
    fn hold(&mut self) {
        let Ok(()) = self.start.set_low();
        self.running = false;
    }

    async fn write_checked(&mut self, first: Register, values: &[u8]) -> Result<(), Ads129xError> {
        self.write(first, values).await?;
        let mut block = [0; BLOCK_BYTES];
        let got = self.read_block(first, values.len(), &mut block).await?;
        for ((address, expected), got) in (first.0..).zip(values).zip(got) {
            let register = Register(address);
            if (expected ^ got) & register.written_bits() != 0 {
                return Err(Ads129xError::ReadBack {
                    register,
                    expected: *expected,
                    got: *got,
                });
            }
        }
        Ok(())
    }

    async fn write(&mut self, first: Register, values: &[u8]) -> Result<(), Ads129xError> {
        let mut block = [0; BLOCK_BYTES];
        let length = 2 + values.len();
        block[0] = command::WREG | first.0;
        block[1] = count(values.len());
        block[2..length].copy_from_slice(values);
        self.transfer(&mut block[..length]).await
    }

    async fn read<const N: usize>(&mut self, first: Register) -> Result<[u8; N], Ads129xError> {
        let mut block = [0; BLOCK_BYTES];
        let got = self.read_block(first, N, &mut block).await?;
        let mut values = [0; N];
        values.copy_from_slice(got);
        Ok(values)
    }

    async fn read_block<'b>(
        &mut self,
        first: Register,
        registers: usize,
        block: &'b mut [u8; BLOCK_BYTES],
    ) -> Result<&'b [u8], Ads129xError> {
        let length = 2 + registers;
        block[0] = command::RREG | first.0;
        block[1] = count(registers);
        self.transfer(&mut block[..length]).await?;
        Ok(&block[2..length])
    }

    /// One chip select: what is in `bytes` goes out, what comes in takes its place.
    async fn transfer(&mut self, bytes: &mut [u8]) -> Result<(), Ads129xError> {
        let mut operations = [
            Operation::TransferInPlace(bytes),
            Operation::DelayNs(HOLD_NS),
        ];
        let transfer = self.spi.transaction(&mut operations);
        match select(transfer, self.delay.delay_us(TRANSFER_LIMIT_US)).await {
            Either::First(ended) => ended.map_err(|error| Ads129xError::Spi(error.kind())),
            Either::Second(()) => Err(Ads129xError::SpiStuck {
                limit_us: TRANSFER_LIMIT_US,
            }),
        }
    }
}

/// Second byte of RREG and WREG: one less than the number of registers, which is at most 12.
#[allow(clippy::cast_possible_truncation, reason = "at most 12")]
const fn count(registers: usize) -> u8 {
    registers as u8 - 1
}

#[cfg(test)]
pub(crate) mod chip;
#[cfg(test)]
mod tests;
