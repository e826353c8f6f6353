//! RNG, from a seeded generator instead of noise (PS 6.21).

use super::{Around, CYCLES_PER_US, Peripheral, noise::Noise, registers::Registers};

/// Address.
pub const BASE: u32 = 0x4000_D000;
const READY: u32 = 0;
/// PS 6.21, electrical specification: 30 us a byte, and 120 us with bias correction.
const BYTE_CYCLES: [u64; 2] = [30 * CYCLES_PER_US, 120 * CYCLES_PER_US];
const CONFIG: u32 = 0x504;

/// The generator.
#[derive(Clone, Debug)]
pub struct Rng {
    registers: Registers,
    noise: Noise,
    value: u32,
    next: Option<u64>,
}

impl Rng {
    /// Gives the same bytes for the same seed.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self {
            registers: Registers::new(BASE, 1, 1, &[(CONFIG, 0)]),
            noise: Noise::new(seed),
            value: 0,
            next: None,
        }
    }

    fn byte_cycles(&self) -> u64 {
        BYTE_CYCLES[(self.registers.value(CONFIG) & 1) as usize]
    }
}

impl Peripheral for Rng {
    fn read(&mut self, offset: u32, _now: u64, _around: &mut Around<'_>) -> Option<u32> {
        match offset {
            0x508 => Some(self.value),
            _ => self.registers.read(offset),
        }
    }

    fn write(&mut self, offset: u32, value: u32, now: u64, _around: &mut Around<'_>) -> Option<()> {
        match offset {
            0x000 => self.next = Some(now + self.byte_cycles()),
            0x004 => self.next = None,
            _ => {
                return self.registers.write(offset, value);
            }
        }
        Some(())
    }

    fn deadline(&self) -> Option<u64> {
        self.next
    }

    fn fire(&mut self, at: u64, around: &mut Around<'_>) {
        self.value = (self.noise.draw() & 0xFF) as u32;
        self.next = (!self.registers.short(0)).then(|| at + self.byte_cycles());
        self.registers.raise(READY, around);
    }

    fn line(&self) -> bool {
        self.registers.line()
    }
}
