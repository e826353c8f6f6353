//! TI ADS1294 and ADS1298 on SPI: commands, registers, conversions (datasheet SBAS459K).
//!
//! Section titles are that datasheet's. Analogue behaviour is not modelled: a channel's counts are given,
//! its gain is not applied to them, but to the test signal.

use crate::chip::{CYCLES_PER_S, CYCLES_PER_US};

/// Registers 0x00 ID to 0x19 WCT2: "Register maps".
const REGISTERS: usize = 0x1A;
const MOST_CHANNELS: usize = 8;
const CONFIG1: usize = 0x01;
const CONFIG2: usize = 0x02;
const CHANNEL_1: usize = 0x05;
const LOFF_STATP: usize = 0x12;
const LOFF_STATN: usize = 0x13;
const GPIO: usize = 0x14;
/// DRDY is high for four periods of the 2.048 MHz clock before each new conversion, read or not: "Data Ready (DRDY)".
const READY_HIGH_CYCLES: u64 = 2 * CYCLES_PER_US;
/// Test signal at a gain of one: 1 mV of a reference of 2.4 V (CONFIG2), in counts of 2^23 by 2.4 V.
const TEST_COUNTS: i32 = 3495;

/// Which pins of the chip it is soldered to, as PSEL names pins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wires {
    /// SCLK, DIN, DOUT.
    pub bus: [u32; 3],
    /// Chip select, low while it listens.
    pub select: u32,
    /// Data ready, falls with each conversion.
    pub ready: u32,
    /// START; conversions run while it is high.
    pub start: Option<u32>,
    /// RESET and PWDN, low resets.
    pub reset: Option<u32>,
}

/// What one conversion made of the inputs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Conversion {
    /// Cycle at which DRDY fell, or should have.
    pub at: u64,
    /// Of each channel, signed 24 bits; zero beyond the device's channels.
    pub counts: [i32; MOST_CHANNELS],
}

/// One device.
#[derive(Clone, Debug)]
pub struct Ads129x {
    /// Where it is connected.
    pub wires: Wires,
    /// Counts of each channel, one conversion after another, repeated.
    pub signals: Vec<Vec<i32>>,
    /// Whether each electrode is off: positive and negative inputs, channel 1 in bit 0.
    pub lead_off: [u8; 2],
    /// Conversions whose falling edge of DRDY never comes: by number.
    pub missed_edges: Vec<u64>,
    /// DRDY is stuck at this level.
    pub stuck_ready: Option<bool>,
    /// DOUT is stuck at this level.
    pub dead: Option<bool>,
    /// What the ID register reads instead of its own value.
    pub wrong_identity: Option<u8>,
    /// Conversions that are sent shifted to the left, as after clock edges too many, and by how many bits.
    pub slipped: Vec<(u64, u32)>,
    /// Conversions so far.
    pub converted: Vec<Conversion>,
    channels: usize,
    registers: [u8; REGISTERS],
    continuous: bool,
    selected: bool,
    commanded: bool,
    pin_started: bool,
    ready_low: bool,
    next: Option<u64>,
    output: Vec<u8>,
    sent: usize,
    argument: Option<Argument>,
}

/// The second byte, and what follows, of a register command.
#[derive(Clone, Copy, Debug)]
enum Argument {
    Count { first: usize, write: bool },
    Values { next: usize, left: usize },
}

impl Ads129x {
    /// As after power came, with four or eight channels.
    #[must_use]
    pub fn new(wires: Wires, signals: Vec<Vec<i32>>) -> Self {
        let channels = if signals.len() <= 4 { 4 } else { 8 };
        let mut device = Self {
            wires,
            signals,
            lead_off: [0; 2],
            missed_edges: Vec::new(),
            stuck_ready: None,
            dead: None,
            wrong_identity: None,
            slipped: Vec::new(),
            converted: Vec::new(),
            channels,
            registers: [0; REGISTERS],
            continuous: true,
            selected: false,
            commanded: false,
            pin_started: false,
            ready_low: false,
            next: None,
            output: Vec::new(),
            sent: 0,
            argument: None,
        };
        device.reset();
        device
    }

    /// Values after a reset: "Register maps". It wakes in continuous mode: "RDATAC".
    fn reset(&mut self) {
        self.registers = [0; REGISTERS];
        self.registers[0] = if self.channels == 4 { 0x90 } else { 0x92 };
        self.registers[CONFIG1] = 0x06;
        self.registers[CONFIG2] = 0x40;
        self.registers[0x03] = 0x40;
        self.registers[GPIO] = 0x0F;
        self.continuous = true;
        self.commanded = false;
        self.argument = None;
        self.ready_low = false;
        self.next = None;
        self.output.clear();
    }

    /// Its registers as after power came; what is wrong with it stays wrong.
    pub fn cycle_power(&mut self) {
        self.reset();
        self.pin_started = false;
    }

    /// A register, as the chip left it.
    #[must_use]
    pub fn register(&self, number: usize) -> Option<u8> {
        self.registers.get(number).copied()
    }

    /// Level of DRDY.
    #[must_use]
    pub fn ready_level(&self) -> bool {
        self.stuck_ready.unwrap_or(!self.ready_low)
    }

    /// Conversions per second: CONFIG1, high resolution by CONFIG1 bit 7.
    #[must_use]
    pub fn rate_hz(&self) -> u64 {
        let config = self.registers[CONFIG1];
        let highest = if config & 0x80 == 0 { 16_000 } else { 32_000 };
        highest >> (config & 7).min(6)
    }

    /// Levels of START, RESET and chip select, whenever one of them changed.
    pub fn pins(&mut self, start: bool, reset: bool, selected: bool, now: u64) {
        if !reset {
            self.reset();
        }
        // While it is held in reset the level of START means nothing.
        let start = start && reset;
        if start != self.pin_started {
            self.pin_started = start;
            self.started(now);
        }
        if selected != self.selected {
            self.selected = selected;
            // Chip select high resets the serial interface: "Chip Select (CS)".
            self.argument = None;
            self.sent = 0;
        }
    }

    fn running(&self) -> bool {
        self.pin_started || self.commanded
    }

    /// Conversions start anew, or stop.
    fn started(&mut self, now: u64) {
        self.ready_low = false;
        // Settling takes four conversions and a little ("Settling Time"); the little is left out.
        self.next = self.running().then(|| now + 4 * self.period());
    }

    fn period(&self) -> u64 {
        CYCLES_PER_S / self.rate_hz()
    }

    /// Cycle at which DRDY changes next.
    #[must_use]
    pub fn deadline(&self) -> Option<u64> {
        let next = self.next?;
        Some(if self.ready_low {
            next - READY_HIGH_CYCLES
        } else {
            next
        })
    }

    /// DRDY rises ahead of a conversion, or falls with it.
    pub fn fire(&mut self, at: u64) {
        let Some(next) = self.next else {
            return;
        };
        if at < next {
            self.ready_low = false;
            return;
        }
        let number = self.converted.len() as u64;
        let counts = std::array::from_fn(|channel| self.count(channel, number));
        self.converted.push(Conversion { at, counts });
        self.output = self.frame(number);
        let slip = self.slipped.iter().find(|(slipped, _)| *slipped == number);
        if let Some((_, bits)) = slip {
            shift_left(&mut self.output, *bits);
        }
        self.sent = 0;
        self.ready_low = !self.missed_edges.contains(&number);
        self.next = Some(next + self.period());
    }

    /// Status word and channels: "Data Output (DOUT)".
    fn frame(&mut self, number: u64) -> Vec<u8> {
        let sensed = |register: usize, off: u8| self.registers[register] & off;
        let positive = sensed(0x0F, self.lead_off[0]);
        let negative = sensed(0x10, self.lead_off[1]);
        self.registers[LOFF_STATP] = positive;
        self.registers[LOFF_STATN] = negative;
        let status = 0xC0_0000
            | u32::from(positive) << 12
            | u32::from(negative) << 4
            | u32::from(self.registers[GPIO]) >> 4;
        let mut frame = status.to_be_bytes()[1..].to_vec();
        for channel in 0..self.channels {
            let [_, bytes @ ..] = self.count(channel, number).to_be_bytes();
            frame.extend(bytes);
        }
        frame
    }

    /// CHnSET: power-down, shorted, test signal, or the electrode.
    fn count(&self, channel: usize, number: u64) -> i32 {
        if channel >= self.channels {
            return 0;
        }
        let setting = self.registers[CHANNEL_1 + channel];
        if setting & 0x80 != 0 {
            return 0;
        }
        match setting & 7 {
            0 => {
                let signal = self
                    .signals
                    .get(channel)
                    .filter(|signal| !signal.is_empty());
                signal.map_or(0, |signal| signal[number as usize % signal.len()])
            }
            5 if self.registers[CONFIG2] & 0x10 != 0 => {
                // A square wave of fCLK / 2^21, or with TEST_FREQ 01 of fCLK / 2^20: 0.98 or 1.95 Hz.
                let clocks = 1_u64 << (20 - u64::from(self.registers[CONFIG2] & 1));
                let half = self.rate_hz() * clocks / 2_048_000;
                let size = (TEST_COUNTS << (self.registers[CONFIG2] >> 2 & 1)) * gain(setting);
                if (number / half.max(1)).is_multiple_of(2) {
                    size
                } else {
                    -size
                }
            }
            _ => 0,
        }
    }

    /// One byte in each direction.
    pub fn exchange(&mut self, byte: u8, now: u64) -> u8 {
        if let Some(level) = self.dead {
            return if level { 0xFF } else { 0 };
        }
        // The first clock puts DRDY up: "Data Ready (DRDY)".
        self.ready_low = false;
        let answer = self.output.get(self.sent).copied().unwrap_or_default();
        self.sent += 1;
        self.take(byte, now);
        answer
    }

    fn take(&mut self, byte: u8, now: u64) {
        match self.argument.take() {
            Some(Argument::Count { first, write }) => {
                let count = usize::from(byte & 0x1F) + 1;
                if write {
                    self.argument = Some(Argument::Values {
                        next: first,
                        left: count,
                    });
                } else {
                    let end = (first + count).min(REGISTERS);
                    self.output = self.registers[first.min(end)..end].to_vec();
                    self.sent = 0;
                    if let (0, Some(wrong), Some(identity)) =
                        (first, self.wrong_identity, self.output.first_mut())
                    {
                        *identity = wrong;
                    }
                }
            }
            Some(Argument::Values { next, left }) => {
                self.set(next, byte, now);
                if left > 1 {
                    self.argument = Some(Argument::Values {
                        next: next + 1,
                        left: left - 1,
                    });
                }
            }
            None => self.command(byte, now),
        }
    }

    fn set(&mut self, register: usize, value: u8, now: u64) {
        // ID and both lead-off states are read-only.
        if register == 0 || register == LOFF_STATP || register == LOFF_STATN {
            return;
        }
        if let Some(place) = self.registers.get_mut(register) {
            *place = value;
            // A write to CONFIG1 restarts the conversions: CONFIG1.
            if register == CONFIG1 && self.running() {
                self.started(now);
            }
        }
    }

    /// "SPI Command Definitions".
    fn command(&mut self, byte: u8, now: u64) {
        match byte {
            0x06 => {
                self.reset();
                // START still being high, conversions begin again.
                if self.pin_started {
                    self.started(now);
                }
            }
            0x08 => {
                self.commanded = true;
                self.started(now);
            }
            0x0A => {
                self.commanded = false;
                self.started(now);
            }
            0x10 => self.continuous = true,
            0x11 => self.continuous = false,
            // RDATA: the newest conversion again.
            0x12 if !self.continuous => {
                self.output = self.frame((self.converted.len() as u64).saturating_sub(1));
                self.sent = 0;
            }
            // Register commands are ignored in continuous mode: "RREG".
            0x20..=0x5F if !self.continuous => {
                self.argument = Some(Argument::Count {
                    first: usize::from(byte & 0x1F),
                    write: byte & 0x40 != 0,
                });
            }
            _ => {}
        }
    }
}

/// CHnSET, GAIN.
fn gain(setting: u8) -> i32 {
    match setting >> 4 & 7 {
        0b000 => 6,
        0b101 => 8,
        0b110 => 12,
        other => i32::from(other),
    }
}

/// Loses the first `bits`; zeros follow the last.
fn shift_left(bytes: &mut [u8], bits: u32) {
    for _ in 0..bits {
        let mut carry = 0;
        for byte in bytes.iter_mut().rev() {
            (*byte, carry) = (*byte << 1 | carry, *byte >> 7);
        }
    }
}

#[cfg(test)]
mod tests;
