//! WDT: starts the chip anew when it is not fed (PS 6.36).

use super::{Around, Common, Kept, Peripheral, Reset, cycles_to_slow, slow_to_cycles};

/// Address.
pub const BASE: u32 = 0x4001_0000;
const TIMEOUT: u32 = 0;
/// PS 6.36, register RR[n]: what a reload request is written as.
const RELOAD: u32 = 0x6E52_4635;
/// PS 6.36: the reset follows the event by two periods of the 32,768 Hz clock.
const GRACE_PERIODS: u64 = 2;
const RELOAD_VALUE: u32 = 0x504;
const ENABLED: u32 = 0x508;

/// The watchdog and its eight handles.
#[derive(Clone, Debug)]
pub struct Watchdog {
    common: Common,
    kept: Kept,
    /// Period of the 32,768 Hz clock at which it expires.
    expires: Option<u64>,
    expired: bool,
    /// Handles that were not fed since the counter was reloaded.
    waiting: u32,
}

impl Default for Watchdog {
    fn default() -> Self {
        Self {
            common: Common::new(BASE, 1, 0),
            // CRV, RREN, CONFIG.
            kept: Kept::new(&[(RELOAD_VALUE, u32::MAX), (ENABLED, 1), (0x50C, 1)]),
            expires: None,
            expired: false,
            waiting: 0,
        }
    }
}

impl Watchdog {
    fn reload(&mut self, now: u64) {
        let periods = u64::from(self.kept.value(RELOAD_VALUE)) + 1;
        self.expires = Some(cycles_to_slow(now) + periods);
        self.waiting = self.kept.value(ENABLED);
    }
}

impl Peripheral for Watchdog {
    fn read(&mut self, offset: u32, _now: u64, _around: &mut Around<'_>) -> Option<u32> {
        match offset {
            0x400 => Some(u32::from(self.expires.is_some())),
            0x404 => Some(self.waiting),
            _ => self.common.read(offset).or_else(|| self.kept.get(offset)),
        }
    }

    fn write(&mut self, offset: u32, value: u32, now: u64, _around: &mut Around<'_>) -> Option<()> {
        match offset {
            0x000 if self.expires.is_none() => self.reload(now),
            0x000 => {}
            0x600..=0x61C => {
                if value == RELOAD {
                    self.waiting &= !(1 << ((offset - 0x600) / 4));
                }
                if self.expires.is_some() && self.waiting == 0 && !self.expired {
                    self.reload(now);
                }
            }
            // PS 6.36: configuration is locked while it runs.
            RELOAD_VALUE..=0x50C if self.expires.is_some() => {}
            _ => {
                return self
                    .common
                    .write(offset, value)
                    .or_else(|| self.kept.set(offset, value));
            }
        }
        Some(())
    }

    fn deadline(&self) -> Option<u64> {
        let grace = if self.expired { GRACE_PERIODS } else { 0 };
        self.expires.map(|period| slow_to_cycles(period + grace))
    }

    fn fire(&mut self, _at: u64, around: &mut Around<'_>) {
        if self.expired {
            self.expires = None;
            around.effects.reset = Some(Reset::Watchdog);
        } else {
            self.expired = true;
            self.common.raise(TIMEOUT, around);
        }
    }

    fn line(&self) -> bool {
        self.common.line()
    }
}
