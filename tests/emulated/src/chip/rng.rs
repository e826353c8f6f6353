//! RNG, from a seeded generator instead of noise (PS 6.21).

use super::{Around, CYCLES_PER_US, Common, Kept, Peripheral};

/// Address.
pub const BASE: u32 = 0x4000_D000;
const READY: u32 = 0;
/// PS 6.21, electrical specification: 30 us a byte, and 120 us with bias correction.
const BYTE_CYCLES: [u64; 2] = [30 * CYCLES_PER_US, 120 * CYCLES_PER_US];
const CONFIG: u32 = 0x504;

/// The generator.
#[derive(Clone, Debug)]
pub struct Rng {
    common: Common,
    kept: Kept,
    state: u64,
    value: u32,
    next: Option<u64>,
}

impl Rng {
    /// Gives the same bytes for the same seed.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self {
            common: Common::new(BASE, 1, 1),
            kept: Kept::new(&[(CONFIG, 0)]),
            state: seed,
            value: 0,
            next: None,
        }
    }

    fn byte_cycles(&self) -> u64 {
        BYTE_CYCLES[(self.kept.value(CONFIG) & 1) as usize]
    }

    /// SplitMix64 (Steele, Lea and Flood, 2014).
    fn draw(&mut self) -> u32 {
        self.state = self.state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mixed = (self.state ^ self.state >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((mixed ^ mixed >> 31) & 0xFF) as u32
    }
}

impl Peripheral for Rng {
    fn read(&mut self, offset: u32, _now: u64, _around: &mut Around<'_>) -> Option<u32> {
        match offset {
            0x508 => Some(self.value),
            _ => self.common.read(offset).or_else(|| self.kept.get(offset)),
        }
    }

    fn write(&mut self, offset: u32, value: u32, now: u64, _around: &mut Around<'_>) -> Option<()> {
        match offset {
            0x000 => self.next = Some(now + self.byte_cycles()),
            0x004 => self.next = None,
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
        self.next
    }

    fn fire(&mut self, at: u64, around: &mut Around<'_>) {
        self.value = self.draw();
        self.next = (self.common.shorts & 1 == 0).then(|| at + self.byte_cycles());
        self.common.raise(READY, around);
    }

    fn line(&self) -> bool {
        self.common.line()
    }
}
