//! NVMC: erases and writes flash, while the processor stands still (PS 4.3).

use super::{Around, CYCLES_PER_US, Peripheral};
use crate::image::FLASH_BYTES;

/// Address.
pub const BASE: u32 = 0x4001_E000;
const PAGE_BYTES: u32 = 4096;
/// PS 4.3, electrical specification: t_ERASEPAGE, at most 85 ms.
const ERASE_CYCLES: u64 = 85_000 * CYCLES_PER_US;
/// PS 4.3, electrical specification: t_WRITE, at most 41 us a word.
pub const WRITE_CYCLES: u64 = 41 * CYCLES_PER_US;

/// What CONFIG says may be done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Mode {
    #[default]
    Read,
    Write,
    Erase,
}

/// The controller.
#[derive(Clone, Debug, Default)]
pub struct Nvmc {
    mode: Mode,
    cache: u32,
}

impl Peripheral for Nvmc {
    fn read(&mut self, offset: u32, _now: u64, _around: &mut Around<'_>) -> Option<u32> {
        match offset {
            // READY, READYNEXT: the processor has stood still for as long as it took.
            0x400 | 0x408 => Some(1),
            0x504 => Some(self.mode as u32),
            0x540 => Some(self.cache),
            _ => None,
        }
    }

    fn write(&mut self, offset: u32, value: u32, _now: u64, around: &mut Around<'_>) -> Option<()> {
        let done = match offset {
            0x504 => {
                self.mode = match value {
                    0 => Mode::Read,
                    1 => Mode::Write,
                    2 => Mode::Erase,
                    _ => return None,
                };
                around.memory.open_flash(self.mode == Mode::Write)
            }
            0x508 if self.mode == Mode::Erase && (value as usize) < FLASH_BYTES => {
                around.effects.stall_cycles += ERASE_CYCLES;
                around
                    .memory
                    .erase(value & !(PAGE_BYTES - 1), PAGE_BYTES as usize)
            }
            0x540 => {
                self.cache = value;
                Ok(())
            }
            _ => return None,
        };
        around.effects.fault = done.err();
        Some(())
    }
}
