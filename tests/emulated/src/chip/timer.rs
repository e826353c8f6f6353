//! TIMER: counts the 16 MHz clock, or what PPI tells it to (PS 6.30).

use super::{Around, Common, Peripheral};

const COMPARE: u32 = 16;
const CHANNELS: usize = 6;

/// One timer.
#[derive(Clone, Debug)]
pub struct Timer {
    common: Common,
    /// Whether COUNT counts, not the clock.
    counts_tasks: bool,
    width: u32,
    prescaler: u32,
    compare: [u32; CHANNELS],
    running: bool,
    /// Value at the cycle `since`.
    base: u32,
    since: u64,
    checked: u64,
}

impl Timer {
    /// The timer at `base`, stopped.
    #[must_use]
    pub fn new(base: u32) -> Self {
        Self {
            common: Common::new(base, 0x3F_0000, 0x3F3F),
            counts_tasks: false,
            width: 0,
            prescaler: 4,
            compare: [0; CHANNELS],
            running: false,
            base: 0,
            since: 0,
            checked: 0,
        }
    }

    /// PS 6.30, register BITMODE: 16, 8, 24 or 32 bits.
    fn mask(&self) -> u32 {
        match self.width {
            0 => 0xFFFF,
            1 => 0xFF,
            2 => 0xFF_FFFF,
            _ => u32::MAX,
        }
    }

    /// Cycles per count: the 16 MHz clock by two to the prescaler.
    fn step(&self) -> u64 {
        4 << self.prescaler
    }

    fn clocked(&self) -> bool {
        self.running && !self.counts_tasks
    }

    fn count(&self, now: u64) -> u32 {
        let passed = if self.clocked() {
            (now - self.since) / self.step()
        } else {
            0
        };
        (u64::from(self.base) + passed) as u32 & self.mask()
    }

    /// Goes on counting from `value` at `now`.
    fn restart(&mut self, value: u32, now: u64) {
        self.base = value;
        self.since = now;
        self.checked = now;
    }

    /// Cycle at which the count becomes that of channel `n`.
    fn matches_at(&self, n: usize) -> u64 {
        let passed = (self.checked - self.since) / self.step();
        let reached = u64::from(self.base) + passed;
        let ahead =
            u64::from(self.compare[n].wrapping_sub(reached as u32).wrapping_sub(1) & self.mask())
                + 1;
        self.since + (passed + ahead) * self.step()
    }

    /// What a match does: event, and the two shorts.
    fn matched(&mut self, n: usize, now: u64, around: &mut Around<'_>) {
        self.common.raise(COMPARE + n as u32, around);
        if self.common.shorts >> n & 1 == 1 {
            self.restart(0, now);
        }
        if self.common.shorts >> (8 + n) & 1 == 1 {
            self.base = self.count(now);
            self.running = false;
        }
    }
}

impl Peripheral for Timer {
    fn read(&mut self, offset: u32, _now: u64, _around: &mut Around<'_>) -> Option<u32> {
        match offset {
            0x504 => Some(u32::from(self.counts_tasks) * 2),
            0x508 => Some(self.width),
            0x510 => Some(self.prescaler),
            0x540..=0x554 => self.compare.get((offset as usize - 0x540) / 4).copied(),
            _ => self.common.read(offset),
        }
    }

    fn write(&mut self, offset: u32, value: u32, now: u64, around: &mut Around<'_>) -> Option<()> {
        let count = self.count(now);
        match offset {
            0x000 => {
                self.restart(count, now);
                self.running = true;
            }
            0x004 => {
                self.restart(count, now);
                self.running = false;
            }
            0x008 if self.counts_tasks && self.running => {
                self.base = count.wrapping_add(1) & self.mask();
                for n in (0..CHANNELS)
                    .filter(|n| self.compare[*n] == self.base)
                    .collect::<Vec<_>>()
                {
                    self.matched(n, now, around);
                }
            }
            0x00C => self.restart(0, now),
            0x010 => {
                self.restart(0, now);
                self.running = false;
            }
            0x040..=0x054 => *self.compare.get_mut((offset as usize - 0x40) / 4)? = count,
            0x504 => self.counts_tasks = value & 3 != 0,
            0x508 => self.width = value & 3,
            0x510 => self.prescaler = value.min(9),
            0x540..=0x554 => {
                self.restart_check(now);
                *self.compare.get_mut((offset as usize - 0x540) / 4)? = value;
            }
            _ => return self.common.write(offset, value),
        }
        Some(())
    }

    fn deadline(&self) -> Option<u64> {
        self.clocked()
            .then(|| (0..CHANNELS).map(|n| self.matches_at(n)).min())
            .flatten()
    }

    fn fire(&mut self, at: u64, around: &mut Around<'_>) {
        let due: Vec<usize> = (0..CHANNELS)
            .filter(|n| self.matches_at(*n) == at)
            .collect();
        self.checked = at;
        for n in due {
            self.matched(n, at, around);
        }
    }

    fn line(&self) -> bool {
        self.common.line()
    }
}

impl Timer {
    /// A compare value takes effect for counts after the present one.
    fn restart_check(&mut self, now: u64) {
        self.checked = self.checked.max(now);
    }
}
