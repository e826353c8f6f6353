//! The flash as a thing that wears and that a power cut leaves half done (PS 4.3).

use crate::chip::noise::Noise;
use crate::error::{FlashMisuse, MachineError};
use crate::image::FLASH_BYTES;

/// What is erased at once.
pub const PAGE_BYTES: usize = 4096;
/// PS 4.3, electrical specification, nWRITE: how often a word may be written before its page is erased.
const MOST_WRITES: u8 = 2;
/// An operation that came to its end.
const WHOLE: u32 = 256;

/// What the controller does to the flash.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operation {
    /// A word is written: bits become zero, none becomes one.
    Write {
        /// Of the word.
        address: u32,
        /// What was to be written.
        value: u32,
    },
    /// All bits of a page become one.
    Erase {
        /// Of the page's first byte.
        address: u32,
        /// How much of the time that it takes has been spent on it, of 256: less when erased in parts.
        share: u32,
    },
}

impl Operation {
    /// First byte and number of bytes that it changes.
    #[must_use]
    pub const fn extent(self) -> (u32, usize) {
        match self {
            Self::Write { address, .. } => (address, 4),
            Self::Erase { address, .. } => (address, PAGE_BYTES),
        }
    }

    /// Does it to the bytes of its extent.
    pub fn complete(self, bytes: &mut [u8], noise: &mut Noise) {
        self.advance(bytes, WHOLE, noise);
    }

    /// Does it until power goes: a part of the bits, drawn at random, has changed.
    pub fn tear(self, bytes: &mut [u8], noise: &mut Noise) {
        let done = (noise.draw() % u64::from(WHOLE)) as u32;
        self.advance(bytes, done, noise);
    }

    /// Changes bits with a chance of `done` in 256 each.
    fn advance(self, bytes: &mut [u8], done: u32, noise: &mut Noise) {
        match self {
            Self::Write { value, .. } => {
                for (byte, written) in bytes.iter_mut().zip(value.to_le_bytes()) {
                    *byte &= written | !noise.bits(done);
                }
            }
            Self::Erase { share, .. } => {
                for byte in bytes {
                    *byte |= noise.bits(done * share / WHOLE);
                }
            }
        }
    }
}

/// What the flash had to bear, and whether power goes at some operation.
#[derive(Clone, Debug)]
pub struct Flash {
    /// Every operation since the machine was made, the torn one included.
    pub operations: Vec<Operation>,
    /// Power goes at the operation with this number.
    pub cut_at: Option<usize>,
    /// Power has gone.
    pub cut: bool,
    /// Of each word, since its page was erased.
    writes: Vec<u8>,
    noise: Noise,
}

impl Flash {
    /// A flash that holds `content`; what is not erased there was written once.
    #[must_use]
    pub fn new(content: &[u8], seed: u64) -> Self {
        let written = |word: &[u8]| u8::from(word != [0xFF; 4]);
        Self {
            operations: Vec::new(),
            cut_at: None,
            cut: false,
            writes: content.chunks_exact(4).map(written).collect(),
            noise: Noise::new(seed),
        }
    }

    /// Does an operation to the bytes of its extent, as far as power allows.
    ///
    /// # Errors
    /// `Flash` for a word that is written too often.
    pub fn perform(&mut self, operation: Operation, bytes: &mut [u8]) -> Result<(), MachineError> {
        if self.cut {
            return Ok(());
        }
        self.wear(operation)?;
        self.cut = self.cut_at == Some(self.operations.len());
        self.operations.push(operation);
        if self.cut {
            operation.tear(bytes, &mut self.noise);
        } else {
            operation.complete(bytes, &mut self.noise);
        }
        Ok(())
    }

    fn wear(&mut self, operation: Operation) -> Result<(), MachineError> {
        let (address, length) = operation.extent();
        let first = address as usize / 4;
        let Some(writes) = self.writes.get_mut(first..first + length / 4) else {
            return Ok(());
        };
        match operation {
            Operation::Write { .. } if writes.contains(&MOST_WRITES) => Err(MachineError::Flash {
                address,
                misuse: FlashMisuse::WrittenTooOften,
            }),
            Operation::Write { .. } => {
                writes.iter_mut().for_each(|count| *count += 1);
                Ok(())
            }
            Operation::Erase { share, .. } => {
                if share == WHOLE {
                    writes.fill(0);
                }
                Ok(())
            }
        }
    }

    /// Power is back.
    pub fn restore_power(&mut self) {
        self.cut = false;
        self.cut_at = None;
    }
}

/// What a flash holds after power went at the last of these operations: the earlier ones are whole, the last is torn.
#[must_use]
pub fn torn(before: &[u8], operations: &[Operation], seed: u64) -> Vec<u8> {
    let mut flash = before.to_vec();
    flash.resize(FLASH_BYTES, 0xFF);
    let mut noise = Noise::new(seed);
    for (left, operation) in (0..operations.len()).rev().zip(operations) {
        let (address, length) = operation.extent();
        let at = address as usize;
        if let Some(bytes) = flash.get_mut(at..at + length) {
            if left == 0 {
                operation.tear(bytes, &mut noise);
            } else {
                operation.complete(bytes, &mut noise);
            }
        }
    }
    flash
}

#[cfg(test)]
mod tests;
