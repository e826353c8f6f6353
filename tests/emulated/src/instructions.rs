//! How many instructions a block of Thumb code holds.

use crate::image::FLASH_BYTES;

/// Counts by the block's address, because blocks run again and again.
#[derive(Clone, Debug)]
pub(crate) struct Counts(Vec<(u32, u32)>);

impl Counts {
    pub(crate) fn new() -> Self {
        Self(vec![(0, 0); FLASH_BYTES / 2])
    }

    /// The code has changed.
    pub(crate) fn forget(&mut self) {
        self.0.fill((0, 0));
    }

    /// Instructions in `size` bytes of `flash` at `address`.
    pub(crate) fn of(&mut self, flash: &[u8], address: u32, size: u32) -> u64 {
        let Some(known) = self.0.get_mut(address as usize / 2) else {
            return u64::from(size) / 2;
        };
        if known.0 != size {
            let block = flash.get(address as usize..(address + size) as usize);
            *known = (size, count(block.unwrap_or_default()));
        }
        u64::from(known.1)
    }
}

/// Armv7-M architecture reference manual, A5.1: an instruction is of two halfwords when the first begins with 0b11101,
/// 0b11110 or 0b11111.
fn count(block: &[u8]) -> u32 {
    let mut halfwords = block.chunks_exact(2);
    let mut instructions = 0;
    while let Some(&[_, high]) = halfwords.next() {
        if high >> 3 >= 0b11101 {
            halfwords.next();
        }
        instructions += 1;
    }
    instructions
}

#[cfg(test)]
mod tests {
    use super::count;

    #[test]
    fn wide_instructions_count_once() {
        // movs r0, #1; bl .; movw r0, #0; bx lr
        let code = [
            0x01, 0x20, 0xFF, 0xF7, 0xFE, 0xFF, 0x40, 0xF2, 0x00, 0x00, 0x70, 0x47,
        ];
        assert_eq!(count(&code), 4);
    }
}
