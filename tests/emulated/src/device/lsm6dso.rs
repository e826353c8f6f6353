//! ST LSM6DSO on I2C: its registers (datasheet DS12140 revision 3, sections 5.1 and 8).

use crate::chip::CYCLES_PER_S;

/// WHO_AM_I and its value.
const IDENTITY: (u8, u8) = (0x0F, 0x6C);
/// CTRL1_XL and CTRL2_G: output rates of accelerometer and gyroscope.
const RATES: [u8; 2] = [0x10, 0x11];
/// CTRL3_C: IF_INC, on after reset, and SW_RESET.
const CONTROL: u8 = 0x12;
const INCREMENTS: u8 = 1 << 2;
const RESETS: u8 = 1;
/// STATUS_REG: XLDA, a new acceleration; GDA, a new rate.
const STATUS: u8 = 0x1E;
const BOTH_NEW: u8 = 0b11;
/// OUTX_L_G: three rates, then three accelerations, 16 bits each.
const OUTPUTS: u8 = 0x22;
const OUTPUTS_END: u8 = 0x2E;

/// One device at an address.
#[derive(Clone, Debug)]
pub struct Lsm6dso {
    /// Seven bits: 0x6A or 0x6B by the level of SA0.
    pub address: u8,
    /// SCL and SDA, as PSEL names pins.
    pub wires: [u32; 2],
    /// Rates about x, y, z, then accelerations, in counts: one measurement after another, repeated.
    pub signals: Vec<[i16; 6]>,
    /// It is not there, or broken: nothing answers at its address.
    pub absent: bool,
    /// It holds the clock low, as one that was reset in the middle of a transfer may.
    pub stalls: bool,
    /// It measures nothing new.
    pub frozen: bool,
    registers: [u8; 256],
    pointer: u8,
    /// Cycle at which it was told to measure.
    since: Option<u64>,
    /// Measurements that were there when the outputs were read last.
    taken: u64,
}

impl Lsm6dso {
    /// As after power came.
    #[must_use]
    pub fn new(address: u8, wires: [u32; 2]) -> Self {
        let mut device = Self {
            address,
            wires,
            signals: Vec::new(),
            absent: false,
            stalls: false,
            frozen: false,
            registers: [0; 256],
            pointer: 0,
            since: None,
            taken: 0,
        };
        device.reset();
        device
    }

    /// Its registers as after power came or a reset.
    pub fn reset(&mut self) {
        self.registers = [0; 256];
        for (register, value) in [IDENTITY, (CONTROL, INCREMENTS)] {
            self.registers[usize::from(register)] = value;
        }
        (self.pointer, self.since, self.taken) = (0, None, 0);
    }

    /// What it measures from now on: rates about x, y, z, then accelerations, in counts.
    pub fn measure(&mut self, counts: [i16; 6]) {
        self.signals = vec![counts];
    }

    /// A register, as the chip left it.
    #[must_use]
    pub fn register(&self, number: u8) -> u8 {
        self.registers[usize::from(number)]
    }

    /// ODR_XL of CTRL1_XL and ODR_G of CTRL2_G: 12.5 Hz, doubled with every code; nothing in power-down or unless both
    /// run alike.
    fn rate_mhz(&self) -> Option<u64> {
        let [code, other] = RATES.map(|register| self.registers[usize::from(register)] >> 4);
        // 12.5, 26, 52, 104, 208 Hz and so on.
        let rate = if code == 1 {
            12_500
        } else {
            13_000 << (code.max(1) - 1)
        };
        (code == other && (1..=10).contains(&code)).then_some(rate)
    }

    /// Measurements that were made until a cycle.
    fn measured(&self, now: u64) -> u64 {
        match (self.since, self.rate_mhz()) {
            (Some(since), Some(rate)) => {
                let cycles = u128::from(now.saturating_sub(since));
                (cycles * u128::from(rate) / (1000 * u128::from(CYCLES_PER_S))) as u64
            }
            _ => 0,
        }
    }

    /// Puts the newest measurement into the outputs and says in STATUS_REG whether it was read.
    fn update(&mut self, now: u64) {
        if self.frozen {
            return;
        }
        let measured = self.measured(now);
        let new = measured > self.taken;
        self.registers[usize::from(STATUS)] = if new { BOTH_NEW } else { 0 };
        let newest = measured
            .checked_sub(1)
            .zip(self.signals.len().checked_sub(1));
        let Some((number, last)) = newest else {
            return;
        };
        let counts = self.signals[(number % (last as u64 + 1)) as usize];
        let bytes = counts.into_iter().flat_map(i16::to_le_bytes);
        for (register, byte) in self.registers[usize::from(OUTPUTS)..].iter_mut().zip(bytes) {
            *register = byte;
        }
    }

    fn advance(&mut self) {
        if self.registers[usize::from(CONTROL)] & INCREMENTS != 0 {
            self.pointer = self.pointer.wrapping_add(1);
        }
    }

    /// The first byte is a register's number, what follows goes into it and the next ones.
    pub fn write(&mut self, bytes: &[u8], now: u64) {
        let Some((pointer, values)) = bytes.split_first() else {
            return;
        };
        self.pointer = *pointer;
        for value in values {
            if self.pointer == CONTROL && value & RESETS != 0 {
                self.reset();
                return;
            }
            // Identity, status and outputs are read-only.
            let read_only =
                self.pointer == IDENTITY.0 || (STATUS..OUTPUTS_END).contains(&self.pointer);
            if !read_only {
                self.registers[usize::from(self.pointer)] = *value;
            }
            if RATES.contains(&self.pointer) {
                (self.since, self.taken) = (Some(now), 0);
            }
            self.advance();
        }
    }

    /// Registers from the one that was named last.
    pub fn read(&mut self, bytes: &mut [u8], now: u64) {
        self.update(now);
        for byte in bytes {
            if (OUTPUTS..OUTPUTS_END).contains(&self.pointer) {
                self.taken = self.measured(now);
            }
            *byte = self.registers[usize::from(self.pointer)];
            self.advance();
        }
        self.update(now);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: u64 = CYCLES_PER_S;

    fn read<const N: usize>(device: &mut Lsm6dso, register: u8, now: u64) -> [u8; N] {
        device.write(&[register], now);
        let mut bytes = [0; N];
        device.read(&mut bytes, now);
        bytes
    }

    /// One that measures 208 times a second from cycle 0.
    fn running() -> Lsm6dso {
        let mut device = Lsm6dso::new(0x6A, [11, 12]);
        device.signals = vec![[1; 6], [-2, 3, 4, 5, 6, 7]];
        device.write(&[0x10, 0x58, 0x58], 0);
        device
    }

    #[test]
    fn identity_is_the_data_sheet_s_and_cannot_be_written() {
        let mut device = Lsm6dso::new(0x6A, [11, 12]);
        device.write(&[0x0F, 0], 0);
        assert_eq!(read(&mut device, 0x0F, 0), [0x6C]);
    }

    #[test]
    fn a_measurement_is_new_until_its_outputs_are_read() {
        let mut device = running();
        assert_eq!(read(&mut device, STATUS, SECOND / 209), [0]);
        assert_eq!(read(&mut device, STATUS, SECOND / 207), [3]);
        assert_eq!(read(&mut device, OUTPUTS, SECOND / 207), [1, 0]);
        assert_eq!(read(&mut device, STATUS, SECOND / 207), [0]);
        let burst: [u8; 16] = read(&mut device, STATUS, 2 * SECOND / 207);
        assert_eq!((burst[0], &burst[4..8]), (3, &[0xFE, 0xFF, 3, 0][..]));
        // The first again.
        assert_eq!(read(&mut device, OUTPUTS, 3 * SECOND / 207), [1, 0]);
    }

    #[test]
    fn without_a_rate_or_when_frozen_nothing_is_new() {
        let mut device = Lsm6dso::new(0x6A, [11, 12]);
        device.measure([1; 6]);
        assert_eq!(read(&mut device, STATUS, SECOND), [0]);
        let mut device = running();
        device.frozen = true;
        assert_eq!(read(&mut device, STATUS, SECOND), [0]);
    }

    #[test]
    fn a_reset_forgets_the_rate() {
        let mut device = running();
        device.write(&[CONTROL, RESETS], SECOND);
        assert_eq!(read(&mut device, 0x10, SECOND), [0, 0, INCREMENTS]);
        assert_eq!(read(&mut device, STATUS, 2 * SECOND), [0]);
    }
}
