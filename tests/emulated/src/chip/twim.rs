//! TWIM0: I2C with DMA, the chip as controller (PS 6.31).

use super::{Around, CYCLES_PER_S, Common, Kept, Peripheral};

/// Address.
pub const BASE: u32 = 0x4000_3000;
const STOPPED: u32 = 1;
const ERROR: u32 = 9;
const SUSPENDED: u32 = 18;
const RECEIVE_STARTED: u32 = 19;
const SEND_STARTED: u32 = 20;
const LAST_RECEIVED: u32 = 23;
const LAST_SENT: u32 = 24;
const ERRORSRC: u32 = 0x4C4;
const ADDRESS_REFUSED: u32 = 1 << 1;
const FREQUENCY: u32 = 0x524;
const RECEIVE_POINTER: u32 = 0x534;
const RECEIVE_MAXIMUM: u32 = 0x538;
const SEND_POINTER: u32 = 0x544;
const SEND_MAXIMUM: u32 = 0x548;
const ADDRESS: u32 = 0x588;
/// PSEL.SCL, SDA.
const WIRES: [u32; 2] = [0x508, 0x50C];
/// A byte and its acknowledgement.
const BITS: u64 = 9;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Sending,
    Receiving,
    Stopping,
}

/// The controller.
#[derive(Clone, Debug)]
pub struct Twim {
    common: Common,
    kept: Kept,
    errors: u32,
    amounts: [u32; 2],
    under_way: Option<(u64, Phase)>,
}

impl Default for Twim {
    fn default() -> Self {
        let mut registers: Vec<(u32, u32)> = WIRES.map(|offset| (offset, u32::MAX)).to_vec();
        registers.push((FREQUENCY, 0x0400_0000));
        let zeros = [
            0x500,
            RECEIVE_POINTER,
            RECEIVE_MAXIMUM,
            0x540,
            SEND_POINTER,
            SEND_MAXIMUM,
            0x550,
            ADDRESS,
        ];
        registers.extend(zeros.map(|offset| (offset, 0)));
        Self {
            common: Common::new(BASE, 0x19C_0202, 0x1F80),
            kept: Kept::new(&registers),
            errors: 0,
            amounts: [0; 2],
            under_way: None,
        }
    }
}

impl Twim {
    /// PS 6.31, register FREQUENCY: 100, 250 or 400 kHz.
    fn bits_per_s(&self) -> u64 {
        match self.kept.value(FREQUENCY) {
            0x0198_0000 => 100_000,
            0x0640_0000 => 400_000,
            _ => 250_000,
        }
    }

    fn begin(&mut self, phase: Phase, now: u64) {
        let bytes = match phase {
            Phase::Sending => 1 + u64::from(self.kept.value(SEND_MAXIMUM)),
            Phase::Receiving => 1 + u64::from(self.kept.value(RECEIVE_MAXIMUM)),
            Phase::Stopping => 1,
        };
        self.under_way = Some((now + bytes * BITS * CYCLES_PER_S / self.bits_per_s(), phase));
    }

    fn transfer(
        &mut self,
        phase: Phase,
        at: u64,
        around: &mut Around<'_>,
    ) -> Result<(), crate::MachineError> {
        let wires = WIRES.map(|offset| self.kept.value(offset));
        let address = self.kept.value(ADDRESS) as u8;
        let acknowledged = if phase == Phase::Sending {
            let mut bytes = vec![0; self.kept.value(SEND_MAXIMUM) as usize];
            around
                .memory
                .load(self.kept.value(SEND_POINTER), &mut bytes)?;
            self.amounts[1] = bytes.len() as u32;
            around.world.i2c_write(wires, address, &bytes)
        } else {
            let mut bytes = vec![0; self.kept.value(RECEIVE_MAXIMUM) as usize];
            let acknowledged = around.world.i2c_read(wires, address, &mut bytes);
            around
                .memory
                .store(self.kept.value(RECEIVE_POINTER), &bytes)?;
            self.amounts[0] = bytes.len() as u32;
            acknowledged
        };
        if !acknowledged {
            self.errors |= ADDRESS_REFUSED;
            self.amounts = [0; 2];
            self.common.raise(ERROR, around);
            return Ok(());
        }
        let (last, first_short) = if phase == Phase::Sending {
            (LAST_SENT, 7)
        } else {
            (LAST_RECEIVED, 10)
        };
        self.common.raise(last, around);
        // SHORTS: last byte to start of the other direction, to suspension, to stop.
        let short = |number: u32| self.common.shorts >> (first_short + number) & 1 == 1;
        if short(0) {
            self.start(
                if phase == Phase::Sending {
                    Phase::Receiving
                } else {
                    Phase::Sending
                },
                at,
                around,
            );
        } else if short(1) {
            self.common.raise(SUSPENDED, around);
        } else if short(2) {
            self.begin(Phase::Stopping, at);
        }
        Ok(())
    }

    fn start(&mut self, phase: Phase, now: u64, around: &mut Around<'_>) {
        let started = if phase == Phase::Sending {
            SEND_STARTED
        } else {
            RECEIVE_STARTED
        };
        self.common.raise(started, around);
        self.begin(phase, now);
    }
}

impl Peripheral for Twim {
    fn read(&mut self, offset: u32, _now: u64, _around: &mut Around<'_>) -> Option<u32> {
        match offset {
            ERRORSRC => Some(self.errors),
            0x53C => Some(self.amounts[0]),
            0x54C => Some(self.amounts[1]),
            _ => self.common.read(offset).or_else(|| self.kept.get(offset)),
        }
    }

    fn write(&mut self, offset: u32, value: u32, now: u64, around: &mut Around<'_>) -> Option<()> {
        match offset {
            0x000 => self.start(Phase::Receiving, now, around),
            0x008 => self.start(Phase::Sending, now, around),
            0x014 => self.begin(Phase::Stopping, now),
            0x01C => self.common.raise(SUSPENDED, around),
            // What was suspended goes on with the next start.
            0x020 => {}
            ERRORSRC => self.errors &= !value,
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
        self.under_way.map(|(at, _)| at)
    }

    fn fire(&mut self, at: u64, around: &mut Around<'_>) {
        let Some((_, phase)) = self.under_way.take() else {
            return;
        };
        if phase == Phase::Stopping {
            self.common.raise(STOPPED, around);
        } else if let Err(fault) = self.transfer(phase, at, around) {
            around.effects.fault = Some(fault);
        }
    }

    fn line(&self) -> bool {
        self.common.line()
    }
}
