//! The processor's own peripherals: interrupt controller and system control (Armv7-M architecture reference manual,
//! sections B3.2 and B3.4). SysTick is not modelled: the image keeps time with RTC1.

use crate::chip::Kept;

/// Address.
pub const BASE: u32 = 0xE000_E000;
/// Interrupts of the chip (PS 4.1, "CPU and support module configuration"): 48.
const INTERRUPTS: u32 = 48;
/// Exception number of interrupt 0.
const FIRST: u32 = 16;
/// Thread mode: below every interrupt.
const THREAD_PRIORITY: u32 = 256;
const VTOR: u32 = 0xD08;
const AIRCR: u32 = 0xD0C;
const RESET_REQUEST: u32 = 0x05FA_0004;
const SCR: u32 = 0xD10;

/// Interrupts and what keeps them.
#[derive(Clone, Debug)]
pub struct System {
    kept: Kept,
    enabled: u64,
    /// Pended by software, or while the line was up.
    latched: u64,
    priority: [u8; INTERRUPTS as usize],
    /// Interrupts being served, outermost first.
    active: Vec<u32>,
    /// Lines of the peripherals.
    pub lines: u64,
    /// The image asked for a reset.
    pub reset_requested: bool,
}

impl Default for System {
    fn default() -> Self {
        let mut kept = vec![
            (0xD00, 0x410F_C241),
            (VTOR, 0),
            (AIRCR, 0xFA05_0000),
            (SCR, 0),
            (0xD14, 0x200),
        ];
        // SHPR1 to 3, SHCSR, CFSR, HFSR, MMFAR, BFAR, CPACR; DEMCR; FPCCR, FPCAR, FPDSCR.
        let zeros = [
            0xD18, 0xD1C, 0xD20, 0xD24, 0xD28, 0xD2C, 0xD34, 0xD38, 0xD88, 0xDFC, 0xF34, 0xF38,
            0xF3C,
        ];
        kept.extend(zeros.map(|offset| (offset, 0)));
        // DHCSR: no debugger.
        kept.push((0xDF0, 0));
        Self {
            kept: Kept::new(&kept),
            enabled: 0,
            latched: 0,
            priority: [0; INTERRUPTS as usize],
            active: Vec::new(),
            lines: 0,
            reset_requested: false,
        }
    }
}

impl System {
    fn active_bits(&self) -> u64 {
        self.active
            .iter()
            .fold(0, |bits, interrupt| bits | 1 << interrupt)
    }

    fn running_priority(&self) -> u32 {
        self.active
            .iter()
            .map(|interrupt| u32::from(self.priority[*interrupt as usize]))
            .min()
            .unwrap_or(THREAD_PRIORITY)
    }

    /// The interrupt that would be served now, were none masked.
    #[must_use]
    pub fn deliverable(&self) -> Option<u32> {
        let waiting = (self.latched | self.lines) & self.enabled & !self.active_bits();
        if waiting == 0 {
            return None;
        }
        let first = (0..INTERRUPTS)
            .filter(|interrupt| waiting >> interrupt & 1 == 1)
            .min_by_key(|interrupt| self.priority[*interrupt as usize])?;
        (u32::from(self.priority[first as usize]) < self.running_priority()).then_some(first)
    }

    /// Begins to serve an interrupt, and gives the address of its vector.
    pub fn enter(&mut self, interrupt: u32) -> u32 {
        self.latched &= !(1 << interrupt);
        self.active.push(interrupt);
        self.kept.value(VTOR) + 4 * (FIRST + interrupt)
    }

    /// Ends the innermost one.
    pub fn leave(&mut self) {
        self.active.pop();
    }

    /// Whether an interrupt is being served.
    #[must_use]
    pub fn in_handler(&self) -> bool {
        !self.active.is_empty()
    }

    /// 32 interrupts of a register of the controller: enabled, pending or active ones.
    fn bank(offset: u32, first: u32) -> u32 {
        (offset - first) / 4 * 32
    }

    /// A load.
    #[must_use]
    pub fn read(&self, offset: u32, size: usize) -> Option<u32> {
        Some(match offset {
            0x100..0x108 => (self.enabled >> Self::bank(offset, 0x100)) as u32,
            0x180..0x188 => (self.enabled >> Self::bank(offset, 0x180)) as u32,
            0x200..0x208 => ((self.latched | self.lines) >> Self::bank(offset, 0x200)) as u32,
            0x280..0x288 => ((self.latched | self.lines) >> Self::bank(offset, 0x280)) as u32,
            0x300..0x308 => (self.active_bits() >> Self::bank(offset, 0x300)) as u32,
            0x400..0x430 if size == 1 => u32::from(self.priority[offset as usize - 0x400]),
            // ICSR: number of the exception that is being served.
            0xD04 => self.active.last().map_or(0, |interrupt| FIRST + interrupt),
            _ => return self.kept.get(offset),
        })
    }

    /// A store.
    pub fn write(&mut self, offset: u32, value: u32, size: usize) -> Option<()> {
        let bits = |first| u64::from(value) << Self::bank(offset, first);
        match offset {
            0x100..0x108 => self.enabled |= bits(0x100),
            0x180..0x188 => self.enabled &= !bits(0x180),
            0x200..0x208 => self.latched |= bits(0x200),
            0x280..0x288 => self.latched &= !bits(0x280),
            // PS 4.1: three bits of priority.
            0x400..0x430 if size == 1 => {
                self.priority[offset as usize - 0x400] = value as u8 & 0xE0
            }
            0xF00 if value < INTERRUPTS => self.latched |= 1 << value,
            AIRCR if value == RESET_REQUEST => self.reset_requested = true,
            // Written ones clear: CFSR, HFSR.
            0xD28 | 0xD2C => self.kept.set(offset, self.kept.value(offset) & !value)?,
            _ => self.kept.set(offset, value)?,
        }
        Some(())
    }
}
