//! CLOCK, POWER and APPROTECT, which share one address (PS 5.4, 5.3, 4.8).

use super::{Around, CYCLES_PER_US, Common, Kept, Peripheral};

/// Address.
pub const BASE: u32 = 0x4000_0000;
const HF_STARTED: u32 = 0;
const LF_STARTED: u32 = 1;
/// Start of the 64 MHz crystal oscillator: PS 5.4, electrical specification, typical 0.36 ms.
const HF_START_CYCLES: u64 = 360 * CYCLES_PER_US;
/// Start of the 32.768 kHz crystal oscillator: PS 5.4, electrical specification, typical 0.25 s.
const LF_START_CYCLES: u64 = 250_000 * CYCLES_PER_US;
const RESETREAS: u32 = 0x400;

/// Both clocks and the registers that survive a reset.
#[derive(Clone, Debug)]
pub struct Clock {
    common: Common,
    kept: Kept,
    starting: [Option<u64>; 2],
    running: [bool; 2],
}

impl Clock {
    /// Both on their internal oscillators; `reasons` is RESETREAS.
    #[must_use]
    pub fn new(reasons: u32) -> Self {
        // RESETREAS; GPREGRET, GPREGRET2; LFCLKSRC; APPROTECT.DISABLE; DCDCEN, DCDCEN0.
        let kept = [0x51C, 0x520, 0x518, 0x558, 0x578, 0x580].map(|offset| (offset, 0));
        let mut kept = Kept::new(&[&kept[..], &[(RESETREAS, reasons)]].concat());
        let _ = kept.set(0x558, 0);
        Self {
            // HFCLKSTARTED, LFCLKSTARTED, POFWARN, DONE, CTTO.
            common: Common::new(BASE, 0b1_1111, 0),
            kept,
            starting: [None; 2],
            running: [false; 2],
        }
    }

    /// Whether HFCLKRUN, HFCLKSTAT and so on say that a clock runs from its crystal.
    fn status(&self, clock: usize, source: u32) -> u32 {
        u32::from(self.running[clock]) << 16 | if self.running[clock] { source } else { 0 }
    }
}

impl Peripheral for Clock {
    fn read(&mut self, offset: u32, _now: u64, _around: &mut Around<'_>) -> Option<u32> {
        match offset {
            0x408 => Some(u32::from(self.running[0] || self.starting[0].is_some())),
            0x40C => Some(self.status(0, 1)),
            0x414 => Some(u32::from(self.running[1] || self.starting[1].is_some())),
            0x418 => Some(self.status(1, self.kept.value(0x518))),
            _ => self.common.read(offset).or_else(|| self.kept.get(offset)),
        }
    }

    fn write(&mut self, offset: u32, value: u32, now: u64, _around: &mut Around<'_>) -> Option<()> {
        match offset {
            0x000 => self.starting[0] = Some(now + HF_START_CYCLES),
            0x004 => (self.starting[0], self.running[0]) = (None, false),
            0x008 => self.starting[1] = Some(now + LF_START_CYCLES),
            0x00C => (self.starting[1], self.running[1]) = (None, false),
            // CONSTLAT and LOWPWR change latency and current only.
            0x078 | 0x07C => {}
            // Written ones clear.
            RESETREAS => self
                .kept
                .set(RESETREAS, self.kept.value(RESETREAS) & !value)?,
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
        self.starting.iter().flatten().min().copied()
    }

    fn fire(&mut self, at: u64, around: &mut Around<'_>) {
        for (clock, event) in [(0, HF_STARTED), (1, LF_STARTED)] {
            if self.starting[clock] == Some(at) {
                self.starting[clock] = None;
                self.running[clock] = true;
                self.common.raise(event, around);
            }
        }
    }

    fn line(&self) -> bool {
        self.common.line()
    }
}
