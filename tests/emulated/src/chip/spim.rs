//! SPIM3: SPI with DMA, the chip as controller (PS 6.25).

use super::{Around, CYCLES_PER_S, Common, Kept, Peripheral};

/// Address.
pub const BASE: u32 = 0x4002_F000;
const END_RECEIVE: u32 = 4;
const END: u32 = 6;
const END_SEND: u32 = 8;
const STARTED: u32 = 19;
const STOPPED: u32 = 1;
const ENABLE: u32 = 0x500;
const FREQUENCY: u32 = 0x524;
const RECEIVE_POINTER: u32 = 0x534;
const RECEIVE_MAXIMUM: u32 = 0x538;
const SEND_POINTER: u32 = 0x544;
const SEND_MAXIMUM: u32 = 0x548;
const CONFIG: u32 = 0x554;
const FILLER: u32 = 0x5C0;
/// PSEL.SCK, MOSI, MISO.
const WIRES: [u32; 3] = [0x508, 0x50C, 0x510];

/// The controller.
#[derive(Clone, Debug)]
pub struct Spim {
    common: Common,
    kept: Kept,
    ends: Option<u64>,
    amounts: [u32; 2],
}

impl Default for Spim {
    fn default() -> Self {
        let mut registers: Vec<(u32, u32)> = WIRES.map(|offset| (offset, u32::MAX)).to_vec();
        // PSEL.CSN; ENABLE, lists, CONFIG, timing, PSELDCX, DCXCNT, ORC.
        registers.extend([
            (0x514, u32::MAX),
            (0x56C, u32::MAX),
            (FREQUENCY, 0x0400_0000),
            (0x560, 2),
            (0x564, 2),
        ]);
        let zeros = [
            ENABLE,
            RECEIVE_POINTER,
            RECEIVE_MAXIMUM,
            0x540,
            SEND_POINTER,
            SEND_MAXIMUM,
            0x550,
            CONFIG,
            0x568,
            0x570,
            FILLER,
        ];
        registers.extend(zeros.map(|offset| (offset, 0)));
        Self {
            common: Common::new(BASE, 0x8_0152, 0),
            kept: Kept::new(&registers),
            ends: None,
            amounts: [0; 2],
        }
    }
}

impl Spim {
    /// PS 6.25, register FREQUENCY: bits per second; 16 and 32 MHz have codes of their own.
    fn bits_per_s(&self) -> u64 {
        match self.kept.value(FREQUENCY) {
            0x0A00_0000 => 16_000_000,
            0x1400_0000 => 32_000_000,
            code => u64::from(code) * 125_000 / 0x0200_0000,
        }
    }

    fn bytes(&self) -> u32 {
        self.kept
            .value(RECEIVE_MAXIMUM)
            .max(self.kept.value(SEND_MAXIMUM))
    }

    fn start(&mut self, now: u64, around: &mut Around<'_>) {
        self.common.raise(STARTED, around);
        let bits = u64::from(self.bytes()) * 8;
        self.ends = Some(now + bits * CYCLES_PER_S / self.bits_per_s().max(1));
    }

    /// Moves all bytes; the clock has had its time.
    fn exchange(&mut self, at: u64, around: &mut Around<'_>) -> Result<(), crate::MachineError> {
        let (to_send, to_receive) = (
            self.kept.value(SEND_MAXIMUM),
            self.kept.value(RECEIVE_MAXIMUM),
        );
        let mut sent = vec![0; to_send as usize];
        around
            .memory
            .load(self.kept.value(SEND_POINTER), &mut sent)?;
        sent.resize(self.bytes() as usize, self.kept.value(FILLER) as u8);
        let wires = WIRES.map(|offset| self.kept.value(offset));
        // CONFIG: bit order, clock phase, clock polarity.
        let mode = self.kept.value(CONFIG) & 7;
        let mut received: Vec<u8> = sent
            .iter()
            .map(|byte| around.world.spi(wires, mode, *byte, at))
            .collect();
        received.truncate(to_receive as usize);
        around
            .memory
            .store(self.kept.value(RECEIVE_POINTER), &received)?;
        self.amounts = [to_receive, to_send];
        Ok(())
    }
}

impl Peripheral for Spim {
    fn read(&mut self, offset: u32, _now: u64, _around: &mut Around<'_>) -> Option<u32> {
        match offset {
            0x53C => Some(self.amounts[0]),
            0x54C => Some(self.amounts[1]),
            _ => self.common.read(offset).or_else(|| self.kept.get(offset)),
        }
    }

    fn write(&mut self, offset: u32, value: u32, now: u64, around: &mut Around<'_>) -> Option<()> {
        match offset {
            0x010 => self.start(now, around),
            0x014 => {
                self.ends = None;
                self.common.raise(STOPPED, around);
            }
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
        self.ends
    }

    fn fire(&mut self, at: u64, around: &mut Around<'_>) {
        self.ends = None;
        // DMA of nothing needs no buffer.
        if self.bytes() > 0
            && let Err(fault) = self.exchange(at, around)
        {
            around.effects.fault = Some(fault);
            return;
        }
        for event in [END_RECEIVE, END_SEND, END] {
            self.common.raise(event, around);
        }
    }

    fn line(&self) -> bool {
        self.common.line()
    }
}
