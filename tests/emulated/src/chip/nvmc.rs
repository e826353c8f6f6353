//! NVMC: erases and writes flash, while the processor, which runs from it, stands still (PS 4.3).

use super::{Around, CYCLES_PER_US, Peripheral, registers::Registers};
use crate::flash::{Operation, PAGE_BYTES};
use crate::image::FLASH_BYTES;

/// Address.
pub const BASE: u32 = 0x4001_E000;
/// PS 4.3, electrical specification: t_ERASEPAGE, at most 85 ms.
pub const ERASE_CYCLES: u64 = 85_000 * CYCLES_PER_US;
/// PS 4.3, electrical specification: t_WRITE, at most 41 us a word.
pub const WRITE_CYCLES: u64 = 41 * CYCLES_PER_US;
/// PS 4.3, electrical specification, t_ERASEPAGEPARTIAL,acc: a part takes at most 1.05 times what it is set to.
const PART_PER_CENT: u64 = 105;
const MODE: u32 = 0x504;
const ERASE_PAGE: u32 = 0x508;
const ERASE_PART: u32 = 0x518;
const PART_MS: u32 = 0x51C;

/// What CONFIG.WEN says may be done.
const WRITE: u32 = 1;
const ERASE: u32 = 2;

/// The controller.
#[derive(Clone, Debug)]
pub struct Nvmc {
    registers: Registers,
    /// Page that is being erased in parts, and the time spent on it.
    in_parts: Option<(u32, u64)>,
}

impl Default for Nvmc {
    fn default() -> Self {
        // PS 4.3, register ERASEPAGEPARTIALCFG: a part takes 10 ms unless told otherwise; ICACHECNF.
        let kept = [(MODE, 0), (PART_MS, 10), (0x540, 0)];
        Self {
            registers: Registers::new(BASE, 0, 0, &kept),
            in_parts: None,
        }
    }
}

impl Nvmc {
    fn may_erase(&self, address: u32) -> bool {
        self.registers.value(MODE) == ERASE && (address as usize) < FLASH_BYTES
    }

    /// Erases a page, or goes on erasing it, for `cycles`.
    fn erase(&mut self, address: u32, cycles: u64, around: &mut Around<'_>) {
        let page = address & !(PAGE_BYTES as u32 - 1);
        let before = self.in_parts.filter(|(begun, _)| *begun == page);
        let spent = before.map_or(0, |(_, spent)| spent) + cycles;
        let whole = spent >= ERASE_CYCLES;
        self.in_parts = (!whole).then_some((page, spent));
        let operation = Operation::Erase {
            address: page,
            share: (256 * spent / ERASE_CYCLES).min(256) as u32,
        };
        around.effects.fault = around.memory.flash(operation).err();
    }
}

impl Peripheral for Nvmc {
    fn read(&mut self, offset: u32, _now: u64, _around: &mut Around<'_>) -> Option<u32> {
        match offset {
            // READY, READYNEXT: the processor has stood still for as long as it took.
            0x400 | 0x408 => Some(1),
            _ => self.registers.read(offset),
        }
    }

    fn write(&mut self, offset: u32, value: u32, _now: u64, around: &mut Around<'_>) -> Option<()> {
        match offset {
            MODE if value > ERASE => return None,
            MODE => {
                around.effects.fault = around.memory.open_flash(value == WRITE).err();
                self.registers.write(MODE, value)?;
            }
            ERASE_PAGE if self.may_erase(value) => {
                around.effects.stall_cycles += ERASE_CYCLES;
                self.erase(value, ERASE_CYCLES, around);
            }
            ERASE_PART if self.may_erase(value) => {
                let ms = u64::from(self.registers.value(PART_MS) & 0x7F);
                let cycles = ms * 1000 * CYCLES_PER_US;
                around.effects.stall_cycles += cycles * PART_PER_CENT / 100;
                self.erase(value, cycles, around);
            }
            _ => return self.registers.write(offset, value),
        }
        Some(())
    }
}
