//! SAADC: converts its inputs in turn into a buffer in RAM (PS 6.23).

use super::{Around, CYCLES_PER_US, Common, Kept, Peripheral};

/// Address.
pub const BASE: u32 = 0x4000_7000;
const STARTED: u32 = 0;
const END: u32 = 1;
const DONE: u32 = 2;
const RESULT_DONE: u32 = 3;
const CALIBRATED: u32 = 4;
const STOPPED: u32 = 5;
const CHANNELS: u32 = 8;
const POINTER: u32 = 0x62C;
const MAXIMUM: u32 = 0x630;
/// PS 6.23, electrical specification: tCONV, below 2 us, after the acquisition time.
const CONVERSION_CYCLES: u64 = 2 * CYCLES_PER_US;
/// The specification states no duration of the offset calibration; this is one of ours.
const CALIBRATION_CYCLES: u64 = 100 * CYCLES_PER_US;
/// PS 6.23, register CH[n].CONFIG: TACQ in us.
const ACQUISITION_US: [u64; 6] = [3, 5, 10, 15, 20, 40];

/// The converter.
#[derive(Clone, Debug)]
pub struct Saadc {
    common: Common,
    kept: Kept,
    /// Where results go, and how many more, after START.
    pointer: u32,
    room: u32,
    amount: u32,
    sampled: Option<u64>,
    calibrated: Option<u64>,
}

impl Default for Saadc {
    fn default() -> Self {
        let mut registers = vec![
            (0x500, 0),
            (0x5F0, 1),
            (0x5F4, 0),
            (0x5F8, 0),
            (POINTER, 0),
            (MAXIMUM, 0),
        ];
        for channel in 0..CHANNELS {
            let at = 0x510 + 16 * channel;
            registers.extend([
                (at, 0),
                (at + 4, 0),
                (at + 8, 0x2_0000),
                (at + 12, 0x7FFF_8000),
            ]);
        }
        Self {
            common: Common::new(BASE, 0x3F_FFFF, 0),
            kept: Kept::new(&registers),
            pointer: 0,
            room: 0,
            amount: 0,
            sampled: None,
            calibrated: None,
        }
    }
}

impl Saadc {
    /// Channels that have an input, with the input's number.
    fn inputs(&self) -> Vec<(u32, u32)> {
        (0..CHANNELS)
            .map(|channel| (channel, self.kept.value(0x510 + 16 * channel)))
            .filter(|(_, input)| *input != 0)
            .collect()
    }

    /// Cycles that one round of all channels takes.
    fn round_cycles(&self) -> u64 {
        self.inputs()
            .iter()
            .map(|(channel, _)| {
                let acquisition = self.kept.value(0x518 + 16 * channel) >> 16 & 7;
                let us = ACQUISITION_US
                    .get(acquisition as usize)
                    .copied()
                    .unwrap_or(40);
                us * CYCLES_PER_US + CONVERSION_CYCLES
            })
            .sum()
    }

    fn convert(&mut self, at: u64, around: &mut Around<'_>) {
        for (_, input) in self.inputs() {
            if self.room == 0 {
                break;
            }
            let count = around.world.converter.next(input, at);
            if let Err(fault) = around.memory.store(self.pointer, &count.to_le_bytes()) {
                around.effects.fault = Some(fault);
                return;
            }
            self.pointer += 2;
            self.room -= 1;
            self.amount += 1;
        }
        self.common.raise(DONE, around);
        self.common.raise(RESULT_DONE, around);
        if self.room == 0 {
            self.common.raise(END, around);
        }
    }
}

impl Peripheral for Saadc {
    fn read(&mut self, offset: u32, _now: u64, _around: &mut Around<'_>) -> Option<u32> {
        match offset {
            0x400 => Some(u32::from(self.sampled.is_some())),
            0x634 => Some(self.amount),
            _ => self.common.read(offset).or_else(|| self.kept.get(offset)),
        }
    }

    fn write(&mut self, offset: u32, value: u32, now: u64, around: &mut Around<'_>) -> Option<()> {
        match offset {
            0x000 => {
                self.pointer = self.kept.value(POINTER);
                self.room = self.kept.value(MAXIMUM);
                self.amount = 0;
                self.common.raise(STARTED, around);
            }
            // Without room, or while a round is under way, nothing is sampled.
            0x004 if self.room > 0 && self.sampled.is_none() => {
                self.sampled = Some(now + self.round_cycles());
            }
            0x004 => around.world.converter.missed += 1,
            0x008 => {
                self.room = 0;
                self.sampled = None;
                self.common.raise(STOPPED, around);
            }
            0x00C => self.calibrated = Some(now + CALIBRATION_CYCLES),
            // Sampling by the converter's own timer is not modelled.
            0x5F8 if value >> 12 & 1 == 1 => return None,
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
        [self.sampled, self.calibrated].into_iter().flatten().min()
    }

    fn fire(&mut self, at: u64, around: &mut Around<'_>) {
        if self.calibrated == Some(at) {
            self.calibrated = None;
            self.common.raise(CALIBRATED, around);
        }
        if self.sampled == Some(at) {
            self.sampled = None;
            self.convert(at, around);
        }
    }

    fn line(&self) -> bool {
        self.common.line()
    }
}
