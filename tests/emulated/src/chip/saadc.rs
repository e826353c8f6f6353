//! SAADC: converts its inputs in turn into a buffer in RAM (PS 6.23).

use super::{Around, CYCLES_PER_US, Peripheral, registers::Registers};
use crate::world::{Converter, Supply};

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
/// PS 6.23, register CH[n].PSELP: the chip's own supplies; VDDH comes through a divider by five.
const VDD: u32 = 9;
const VDDH_BY_5: u32 = 13;
/// CONFIG.GAIN: 1/6, 1/5, 1/4, 1/3, 1/2, 1, 2, 4.
const GAIN_SIXTIETHS: [u64; 8] = [10, 12, 15, 20, 30, 60, 120, 240];
const INTERNAL_REFERENCE_MV: u64 = 600;
const RESOLUTION: u32 = 0x5F0;
const OVERSAMPLE: u32 = 0x5F4;

/// The converter.
#[derive(Clone, Debug)]
pub struct Saadc {
    registers: Registers,
    /// Where results go, and how many more, after START.
    pointer: u32,
    room: u32,
    amount: u32,
    sampled: Option<u64>,
    calibrated: Option<u64>,
}

impl Default for Saadc {
    fn default() -> Self {
        let mut kept = vec![
            (0x500, 0),
            (RESOLUTION, 1),
            (OVERSAMPLE, 0),
            (0x5F8, 0),
            (POINTER, 0),
            (MAXIMUM, 0),
        ];
        for channel in 0..CHANNELS {
            let at = 0x510 + 16 * channel;
            kept.extend([
                (at, 0),
                (at + 4, 0),
                (at + 8, 0x2_0000),
                (at + 12, 0x7FFF_8000),
            ]);
        }
        Self {
            registers: Registers::new(BASE, 0x3F_FFFF, 0, &kept),
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
            .map(|channel| (channel, self.registers.value(0x510 + 16 * channel)))
            .filter(|(_, input)| *input != 0)
            .collect()
    }

    fn configuration(&self, channel: u32) -> u32 {
        self.registers.value(0x518 + 16 * channel)
    }

    /// PS 6.23, "Digital output": RESULT = V GAIN / REFERENCE 2^(RESOLUTION - m), m = 1 for a difference; its ends are
    /// hard. The voltage is `mv` by `divider`.
    fn supply_count(&self, channel: u32, mv: u32, divider: u64, vdd_mv: u32) -> i16 {
        let configuration = self.configuration(channel);
        let gain = GAIN_SIXTIETHS[(configuration >> 8 & 7) as usize];
        // REFSEL: internal, or a quarter of VDD.
        let reference_quarters_mv = match configuration >> 12 & 1 {
            0 => 4 * INTERNAL_REFERENCE_MV,
            _ => u64::from(vdd_mv),
        };
        let bits = 8 + 2 * (self.registers.value(RESOLUTION) & 3) - (configuration >> 20 & 1);
        let count = (u64::from(mv) * gain * 4) << bits;
        let scale = 60 * divider * reference_quarters_mv.max(1);
        (count / scale).min((1 << bits) - 1) as i16
    }

    /// What a channel makes of its input.
    fn count(&self, channel: u32, input: u32, at: u64, converter: &mut Converter) -> i16 {
        let Supply { vdd_mv, vddh_mv } = converter.supply;
        match input {
            VDD => self.supply_count(channel, vdd_mv, 1, vdd_mv),
            VDDH_BY_5 => self.supply_count(channel, vddh_mv, 5, vdd_mv),
            _ => converter.next(input, at),
        }
    }

    /// Cycles that one round of all channels takes.
    fn round_cycles(&self) -> u64 {
        self.inputs()
            .iter()
            .map(|(channel, _)| {
                let acquisition = self.configuration(*channel) >> 16 & 7;
                let us = ACQUISITION_US
                    .get(acquisition as usize)
                    .copied()
                    .unwrap_or(40);
                // CONFIG.BURST: all samples of an average at one task.
                let burst = self.configuration(*channel) >> 24 & 1;
                let samples = 1 << (self.registers.value(OVERSAMPLE) * burst).min(8);
                samples * (us * CYCLES_PER_US + CONVERSION_CYCLES)
            })
            .sum()
    }

    fn convert(&mut self, at: u64, around: &mut Around<'_>) {
        for (channel, input) in self.inputs() {
            if self.room == 0 {
                break;
            }
            let count = self.count(channel, input, at, &mut around.world.converter);
            if let Err(fault) = around.memory.store(self.pointer, &count.to_le_bytes()) {
                around.effects.fault = Some(fault);
                return;
            }
            self.pointer += 2;
            self.room -= 1;
            self.amount += 1;
        }
        self.registers.raise(DONE, around);
        self.registers.raise(RESULT_DONE, around);
        if self.room == 0 {
            self.registers.raise(END, around);
        }
    }
}

impl Peripheral for Saadc {
    fn read(&mut self, offset: u32, _now: u64, _around: &mut Around<'_>) -> Option<u32> {
        match offset {
            0x400 => Some(u32::from(self.sampled.is_some())),
            0x634 => Some(self.amount),
            _ => self.registers.read(offset),
        }
    }

    fn write(&mut self, offset: u32, value: u32, now: u64, around: &mut Around<'_>) -> Option<()> {
        match offset {
            0x000 => {
                self.pointer = self.registers.value(POINTER);
                self.room = self.registers.value(MAXIMUM);
                self.amount = 0;
                self.registers.raise(STARTED, around);
            }
            // Without room, or while a round is under way, nothing is sampled.
            0x004 if self.room > 0 && self.sampled.is_none() => {
                self.sampled = Some(now + self.round_cycles());
            }
            0x004 => around.world.converter.missed += 1,
            0x008 => {
                self.room = 0;
                self.sampled = None;
                self.registers.raise(STOPPED, around);
            }
            0x00C => self.calibrated = Some(now + CALIBRATION_CYCLES),
            // Sampling by the converter's own timer is not modelled.
            0x5F8 if value >> 12 & 1 == 1 => return None,
            _ => {
                return self.registers.write(offset, value);
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
            self.registers.raise(CALIBRATED, around);
        }
        if self.sampled == Some(at) {
            self.sampled = None;
            self.convert(at, around);
        }
    }

    fn line(&self) -> bool {
        self.registers.line()
    }
}
