//! RTC: the 24-bit real-time counter (PS 6.22).

use super::{Around, Common, Peripheral, cycles_to_slow, slow_to_cycles};

const OVERFLOW: u32 = 1;
const COMPARE: u32 = 16;
const MASK: u64 = 0xFF_FFFF;

/// One counter.
#[derive(Clone, Debug)]
pub struct Rtc {
    common: Common,
    /// EVTEN: events that PPI sees.
    routed: u32,
    /// 32,768 Hz period at which the counter was 0, while it runs.
    zero: Option<u64>,
    held: u64,
    prescaler: u32,
    compare: [u32; 4],
    /// First period at which each compare may match: PS 6.22, "Compare", a value of N or N + 1 written at N does not.
    armed: [u64; 4],
    checked: u64,
}

impl Rtc {
    /// The counter at `base`, stopped.
    #[must_use]
    pub fn new(base: u32) -> Self {
        Self {
            // TICK, OVRFLW, COMPARE[0..4].
            common: Common::new(base, 0xF_0003, 0),
            routed: 0,
            zero: None,
            held: 0,
            prescaler: 0,
            compare: [0; 4],
            armed: [0; 4],
            checked: 0,
        }
    }

    fn step(&self) -> u64 {
        u64::from(self.prescaler) + 1
    }

    fn count(&self, now: u64) -> u64 {
        self.zero.map_or(self.held, |zero| {
            ((cycles_to_slow(now) - zero) / self.step()) & MASK
        })
    }

    /// Period, counted from zero of the counter, at which it next has a value, not before `earliest`.
    fn next(&self, value: u64, earliest: u64) -> u64 {
        earliest + (value.wrapping_sub(earliest) & MASK)
    }

    /// The events due next, with their cycle.
    fn due(&self) -> Vec<(u64, u32)> {
        let Some(zero) = self.zero else {
            return Vec::new();
        };
        let wanted = self.common.enabled | self.routed;
        let passed = (cycles_to_slow(self.checked).max(zero) - zero) / self.step() + 1;
        let cycle = |count: u64| slow_to_cycles(zero + count * self.step());
        let overflow =
            (wanted >> OVERFLOW & 1 == 1).then(|| (cycle(self.next(0, passed)), OVERFLOW));
        let compares = (0..4)
            .filter(|n| wanted >> (COMPARE + *n as u32) & 1 == 1)
            .map(|n| {
                let earliest = passed.max(self.armed[n]);
                (
                    cycle(self.next(u64::from(self.compare[n]), earliest)),
                    COMPARE + n as u32,
                )
            });
        compares.chain(overflow).collect()
    }
}

impl Peripheral for Rtc {
    fn read(&mut self, offset: u32, now: u64, _around: &mut Around<'_>) -> Option<u32> {
        match offset {
            0x340 | 0x344 | 0x348 => Some(self.routed),
            0x504 => Some(self.count(now) as u32),
            0x508 => Some(self.prescaler),
            0x540..=0x54C => self.compare.get((offset as usize - 0x540) / 4).copied(),
            _ => self.common.read(offset),
        }
    }

    fn write(&mut self, offset: u32, value: u32, now: u64, _around: &mut Around<'_>) -> Option<()> {
        let count = self.count(now);
        self.checked = self.checked.max(now);
        match offset {
            0x000 => self.zero = Some(cycles_to_slow(now) - count * self.step()),
            0x004 => (self.held, self.zero) = (count, None),
            0x008 => {
                self.held = 0;
                self.zero = self.zero.map(|_| cycles_to_slow(now));
                self.armed = [0; 4];
            }
            0x340 => self.routed = value,
            0x344 => self.routed |= value,
            0x348 => self.routed &= !value,
            // PS 6.22, register PRESCALER: the prescaler can be written only while the counter stands.
            0x508 if self.zero.is_none() => self.prescaler = value & 0xFFF,
            0x540..=0x54C => {
                let n = (offset as usize - 0x540) / 4;
                *self.compare.get_mut(n)? = value & MASK as u32;
                let passed = self
                    .zero
                    .map_or(0, |zero| (cycles_to_slow(now) - zero) / self.step());
                self.armed[n] = passed + 2;
            }
            _ => return self.common.write(offset, value),
        }
        Some(())
    }

    fn deadline(&self) -> Option<u64> {
        self.due().into_iter().map(|(cycle, _)| cycle).min()
    }

    fn fire(&mut self, at: u64, around: &mut Around<'_>) {
        let due = self.due();
        self.checked = at;
        for (_, event) in due.into_iter().filter(|(cycle, _)| *cycle == at) {
            self.common.raise(event, around);
        }
    }

    fn line(&self) -> bool {
        self.common.line()
    }
}
