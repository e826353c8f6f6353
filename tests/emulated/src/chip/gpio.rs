//! GPIO: pins of both ports (PS 6.9).

use super::{Around, Peripheral};

/// Address of port 0; port 1 lies 0x300 above it in the same page.
pub const BASE: u32 = 0x5000_0000;
const PORT_BYTES: u32 = 0x300;
/// Offset of the first register, OUT.
const FIRST: u32 = 0x500;

/// One port's registers.
#[derive(Clone, Debug, Default)]
struct Port {
    out: u32,
    direction: u32,
    latch: u32,
    detect_latched: u32,
    configuration: [u32; 32],
}

/// Both ports.
#[derive(Clone, Debug, Default)]
pub struct Gpio {
    ports: [Port; 2],
}

impl Gpio {
    /// Level on each pin of a port: the chip's where it drives, else what the world does.
    fn levels(&self, port: usize, around: &Around<'_>) -> u32 {
        let Port { out, direction, .. } = self.ports[port];
        out & direction | around.world.pins.driven(port) & !direction
    }

    /// Pins whose level is the one they sense: PIN_CNF.SENSE 2 high, 3 low.
    fn sensed(&self, port: usize, around: &Around<'_>) -> u32 {
        let levels = self.levels(port, around);
        (0..32).fold(0, |sensed, pin| {
            let meets = match self.ports[port].configuration[pin] >> 16 & 3 {
                2 => levels >> pin & 1 == 1,
                3 => levels >> pin & 1 == 0,
                _ => false,
            };
            sensed | u32::from(meets) << pin
        })
    }

    /// Tells the world what the chip drives, and latches what is sensed.
    pub fn settle(&mut self, now: u64, around: &mut Around<'_>) {
        for port in 0..2 {
            let Port { out, direction, .. } = self.ports[port];
            around.world.drive(port, out & direction, direction, now);
        }
        for port in 0..2 {
            self.ports[port].latch |= self.sensed(port, around);
            around.world.pins.latched[port] = self.ports[port].latch;
            around.world.pins.levels[port] = self.levels(port, around);
        }
    }
}

impl Peripheral for Gpio {
    fn read(&mut self, offset: u32, _now: u64, around: &mut Around<'_>) -> Option<u32> {
        let port = usize::from(offset >= FIRST + PORT_BYTES);
        let offset = offset - port as u32 * PORT_BYTES;
        let registers = &self.ports[port];
        Some(match offset {
            0x504 | 0x508 | 0x50C => registers.out,
            0x510 => self.levels(port, around),
            0x514 | 0x518 | 0x51C => registers.direction,
            0x520 => registers.latch | self.sensed(port, around),
            0x524 => registers.detect_latched,
            0x700..0x780 => registers.configuration[(offset as usize - 0x700) / 4],
            _ => return None,
        })
    }

    fn write(&mut self, offset: u32, value: u32, now: u64, around: &mut Around<'_>) -> Option<()> {
        let port = usize::from(offset >= FIRST + PORT_BYTES);
        let offset = offset - port as u32 * PORT_BYTES;
        let registers = &mut self.ports[port];
        match offset {
            0x504 => registers.out = value,
            0x508 => registers.out |= value,
            0x50C => registers.out &= !value,
            0x514 => registers.direction = value,
            0x518 => registers.direction |= value,
            0x51C => registers.direction &= !value,
            // PS 6.9, register LATCH: a latch cleared while the pin still has the level is set again at once.
            0x520 => registers.latch &= !value,
            0x524 => registers.detect_latched = value & 1,
            0x700..0x780 => {
                let pin = (offset - 0x700) / 4;
                registers.configuration[pin as usize] = value;
                // PIN_CNF.DIR is the same bit as in DIR.
                registers.direction = registers.direction & !(1 << pin) | (value & 1) << pin;
            }
            _ => return None,
        }
        self.settle(now, around);
        Some(())
    }
}
