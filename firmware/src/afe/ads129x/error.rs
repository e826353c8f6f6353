//! What can go wrong between processor and converter.

use embedded_hal::spi;

use super::registers::Register;

/// Why the converter gave no scan.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub enum Ads129xError {
    /// The bus reported an error.
    #[error("SPI failed ({0:?}): check SCLK, MOSI, MISO and CS")]
    Spi(#[cfg_attr(target_os = "none", defmt(Debug2Format))] spi::ErrorKind),
    /// A transfer did not end.
    #[error("SPI transfer did not end within {limit_us} us: check clock and supply")]
    SpiStuck {
        /// How long was waited, us.
        limit_us: u32,
    },
    /// Another chip, a chip without supply, or a bus that is not connected.
    #[error(
        "ID register reads {got:#04x} instead of {expected:#04x}: check chip, supply and wiring"
    )]
    WrongId {
        /// ID of the chip that was configured.
        expected: u8,
        /// What was read.
        got: u8,
    },
    /// A register does not hold what was written.
    #[error(
        "register {register} reads {got:#04x} instead of {expected:#04x}: lower the SPI clock, check the supply"
    )]
    ReadBack {
        /// Address.
        register: Register,
        /// What was written.
        expected: u8,
        /// What was read.
        got: u8,
    },
    /// The status word does not begin with 1100: bits slipped, or nobody drives the line.
    #[error("status word begins with {got:04b} instead of 1100: the frame is dropped")]
    Header {
        /// The first four bits.
        got: u8,
    },
    /// The frame has the wrong length for the channels.
    #[error("frame of {got} bytes instead of {expected}")]
    FrameLength {
        /// Bytes for these channels.
        expected: usize,
        /// Bytes given.
        got: usize,
    },
    /// No data-ready edge in time.
    #[error(
        "no data-ready edge within {limit_us} us: check DRDY, START and the converter's supply"
    )]
    NoEdge {
        /// How long was waited, us.
        limit_us: u32,
    },
}
