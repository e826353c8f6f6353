//! Why a frame was refused.

use super::table::{Kind, MIN_ATT_MTU, VERSION};

/// Why bytes are no frame, or a packet cannot become one. A receiver drops the frame and counts it.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum WireError {
    /// Fewer bytes than a header and a checksum.
    #[error(
        "frame of {got} bytes, at least {needed} needed: join the pieces of one notification first"
    )]
    TooShort {
        /// Bytes of the smallest frame.
        needed: usize,
        /// Bytes given.
        got: usize,
    },
    /// The sender speaks another version.
    #[error(
        "protocol version {got}, this side speaks {VERSION}: update the older of wearable and host"
    )]
    UnknownVersion {
        /// First byte of the frame.
        got: u8,
    },
    /// No such packet in this version.
    #[error("packet kind {got} does not exist in protocol version {VERSION}: drop the frame")]
    UnknownKind {
        /// Second byte of the frame.
        got: u8,
    },
    /// The number of bytes does not fit the kind.
    #[error(
        "{kind} frame of {got} bytes, {expected} expected: check that the ATT MTU is at least {MIN_ATT_MTU}"
    )]
    WrongLength {
        /// Which packet.
        kind: Kind,
        /// Bytes of the whole frame (of the nearest size allowed, for a packet that holds a list).
        expected: usize,
        /// Bytes given.
        got: usize,
    },
    /// The frame was changed on its way.
    #[error("checksum {got:#010x} where the frame's bytes give {expected:#010x}: drop the frame")]
    BadCrc {
        /// CRC-32 of the bytes that came.
        expected: u32,
        /// CRC-32 at the end of the frame.
        got: u32,
    },
    /// NaN or infinity.
    #[error("`{field}` is not a finite number: find where the sender made it")]
    NonFinite {
        /// Name of the field.
        field: &'static str,
    },
    /// A value that the field may not have.
    #[error("`{field}` is {got}, allowed {low:?} to {high:?}")]
    OutOfRange {
        /// Name of the field.
        field: &'static str,
        /// The value.
        got: f64,
        /// Smallest value allowed.
        low: f64,
        /// Largest value allowed.
        high: f64,
    },
    /// Text that is not UTF-8.
    #[error(
        "`{field}` is no UTF-8 after byte {valid_up_to}: cut it before a character, not within"
    )]
    NotText {
        /// Name of the field.
        field: &'static str,
        /// How many bytes of it are.
        valid_up_to: usize,
    },
    /// The caller's buffer is smaller than the frame.
    #[error("the frame needs {needed} bytes, the buffer has {got}: use MAX_FRAME_BYTES")]
    BufferTooSmall {
        /// Bytes of the frame.
        needed: usize,
        /// Bytes of the buffer.
        got: usize,
    },
}
