//! WDT: starts the chip anew when it is not fed (PS 6.36). Nothing stops it once it runs.

use super::{Around, Peripheral, Reset, cycles_to_slow, registers::Registers, slow_to_cycles};

/// Address.
pub const BASE: u32 = 0x4001_0000;
const TIMEOUT: u32 = 0;
/// PS 6.36, register RR[n]: what a reload request is written as.
const RELOAD: u32 = 0x6E52_4635;
/// PS 6.36, "Watchdog reset": when the event interrupts, the reset follows it by two periods of the 32,768 Hz clock;
/// else at once.
const GRACE_PERIODS: u64 = 2;
const RELOAD_VALUE: u32 = 0x504;
const ENABLED: u32 = 0x508;
const CONFIG: u32 = 0x50C;

/// The watchdog and its eight handles.
#[derive(Clone, Debug)]
pub struct Watchdog {
    registers: Registers,
    /// Period of the 32,768 Hz clock at which it expires.
    expires: Option<u64>,
    expired: bool,
    /// Handles that were not fed since the counter was reloaded.
    waiting: u32,
}

impl Default for Watchdog {
    fn default() -> Self {
        let kept = [(RELOAD_VALUE, u32::MAX), (ENABLED, 1), (CONFIG, 1)];
        Self {
            registers: Registers::new(BASE, 1, 0, &kept),
            expires: None,
            expired: false,
            waiting: 0,
        }
    }
}

impl Watchdog {
    /// What a reset makes of it: one by software does not stop it, and its configuration stays locked (PS 5.3, "Reset
    /// behavior").
    #[must_use]
    pub fn after(&self, reset: Reset) -> Self {
        if reset.spares_watchdog() {
            self.clone()
        } else {
            Self::default()
        }
    }

    /// PS 6.36: (CRV + 1) / 32,768 s.
    fn reload(&mut self, now: u64) {
        let periods = u64::from(self.registers.value(RELOAD_VALUE)) + 1;
        self.expires = Some(cycles_to_slow(now) + periods);
        self.waiting = self.registers.value(ENABLED) & 0xFF;
    }
}

impl Peripheral for Watchdog {
    fn read(&mut self, offset: u32, _now: u64, _around: &mut Around<'_>) -> Option<u32> {
        match offset {
            0x400 => Some(u32::from(self.expires.is_some())),
            0x404 => Some(self.waiting),
            _ => self.registers.read(offset),
        }
    }

    fn write(&mut self, offset: u32, value: u32, now: u64, _around: &mut Around<'_>) -> Option<()> {
        let running = self.expires.is_some();
        match offset {
            0x000 if !running => self.reload(now),
            0x000 => {}
            0x600..=0x61C => {
                if value == RELOAD {
                    self.waiting &= !(1 << ((offset - 0x600) / 4));
                }
                if running && self.waiting == 0 && !self.expired {
                    self.reload(now);
                }
            }
            // PS 6.36: configuration is locked while it runs.
            RELOAD_VALUE..=CONFIG if running => {}
            // A pause while the processor sleeps is not modelled.
            CONFIG if value & 1 == 0 => return None,
            _ => return self.registers.write(offset, value),
        }
        Some(())
    }

    fn deadline(&self) -> Option<u64> {
        let grace = if self.expired { GRACE_PERIODS } else { 0 };
        self.expires.map(|period| slow_to_cycles(period + grace))
    }

    fn fire(&mut self, _at: u64, around: &mut Around<'_>) {
        let interrupts = self.registers.enabled() >> TIMEOUT & 1 == 1;
        if self.expired || !interrupts {
            around.effects.reset = Some(Reset::Watchdog);
            return;
        }
        self.expired = true;
        self.registers.raise(TIMEOUT, around);
    }

    fn line(&self) -> bool {
        self.registers.line()
    }
}
