//! Why something could not be kept or given back.

use core::fmt::Debug;

use super::partitions::Name;

/// What went wrong with the flash or with what lies in it; `E` is the flash's own error.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub enum StorageError<E: Debug> {
    /// The flash itself failed; trying again may help.
    #[error("flash failed in {partition:?} at {offset:#x}: {error:?}")]
    Flash {
        /// Where.
        partition: Name,
        /// Address of the access.
        offset: u32,
        /// What the flash says.
        error: E,
    },
    /// The flash is not one that the tables describe.
    #[error("expected a flash of {expected:?} bytes in all, per page and per word, got {got:?}")]
    WrongFlash {
        /// Bytes in all (at least), per page, per word.
        expected: [u32; 3],
        /// The same of this flash.
        got: [u32; 3],
    },
    /// An access would leave its partition: a mistake of this module, refused before it does harm.
    #[error("{partition:?} ends at {expected:#x}, access up to {got:#x} refused")]
    OutsidePartition {
        /// Whose bounds.
        partition: Name,
        /// Where it ends.
        expected: u32,
        /// Where the access would have ended.
        got: u32,
    },
    /// What was once written whole no longer is. It is not given out; write it anew.
    #[error(
        "{partition:?} at {offset:#x} is damaged: checksum {expected:#x} expected, {got:#x} found"
    )]
    Damaged {
        /// What is damaged.
        partition: Name,
        /// Address of the damaged record or slot.
        offset: u32,
        /// Checksum that was written with it: CRC-32, or the first four bytes of a model's SHA-256.
        expected: u32,
        /// Checksum of what lies there now.
        got: u32,
    },
    /// What was just written reads back differently: that page of the flash is worn out.
    #[error("{partition:?} at {offset:#x} did not keep what was written")]
    NotKept {
        /// Where.
        partition: Name,
        /// Address of what was written.
        offset: u32,
    },
    /// Too many bytes, or none.
    #[error("{partition:?} takes 1 to {expected} bytes, got {got}")]
    WrongLength {
        /// What they were meant for.
        partition: Name,
        /// The most it takes.
        expected: u32,
        /// What was offered.
        got: u32,
    },
    /// No upload has begun.
    #[error("no model is being received; begin an upload first")]
    NotReceiving,
    /// A piece does not follow on what was received.
    #[error("the next piece starts at {expected}, got one for {got}")]
    WrongOffset {
        /// Bytes received so far.
        expected: u32,
        /// Where the piece was to go.
        got: u32,
    },
    /// A piece goes beyond the length that was announced.
    #[error("a model of {expected} bytes was announced, a piece ends at {got}")]
    TooMuch {
        /// Bytes announced.
        expected: u32,
        /// Where the piece ends.
        got: u32,
    },
    /// The upload cannot be finished yet.
    #[error("{got} of {expected} bytes received; send the rest first")]
    Incomplete {
        /// Bytes announced.
        expected: u32,
        /// Bytes received.
        got: u32,
    },
    /// All bytes came as announced, and they are no model that this build can run. The upload is abandoned.
    #[error("the model is whole but not one for this build; export it for this firmware")]
    NotFitting,
    /// All bytes came, and they are not those announced. The upload is abandoned.
    #[error("SHA-256 begins with {expected:08x} as announced, {got:08x} as received; upload anew")]
    HashMismatch {
        /// First four bytes announced.
        expected: u32,
        /// First four bytes of what lies in the flash.
        got: u32,
    },
}
