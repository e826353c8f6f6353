//! GPIOTE: events from pins and tasks to pins (PS 6.10).

use super::{Around, Common, Peripheral};

/// Address.
pub const BASE: u32 = 0x4000_6000;
const CHANNELS: usize = 8;
const PORT: u32 = 31;

/// Eight channels and the port event.
#[derive(Clone, Debug)]
pub struct Gpiote {
    common: Common,
    configuration: [u32; CHANNELS],
    seen: [u32; 2],
    detected: bool,
}

impl Default for Gpiote {
    fn default() -> Self {
        Self {
            common: Common::new(BASE, 0x8000_00FF, 0),
            configuration: [0; CHANNELS],
            seen: [0; 2],
            detected: false,
        }
    }
}

impl Gpiote {
    /// Port and pin of a channel in event mode, with its polarity: 1 rising, 2 falling, 3 both.
    fn watched(&self, channel: usize) -> Option<(usize, u32, u32)> {
        let word = self.configuration[channel];
        (word & 3 == 1).then_some(((word >> 13 & 1) as usize, word >> 8 & 31, word >> 16 & 3))
    }

    /// Raises what the pins' new levels mean.
    pub fn look(&mut self, around: &mut Around<'_>) {
        let levels = around.world.pins.levels;
        for channel in 0..CHANNELS {
            let Some((port, pin, polarity)) = self.watched(channel) else {
                continue;
            };
            let (before, after) = (self.seen[port] >> pin & 1, levels[port] >> pin & 1);
            if before != after && polarity >> (1 - after) & 1 == 1 {
                self.common.raise(channel as u32, around);
            }
        }
        self.seen = levels;
        // PS 6.10, "Port event": PORT rises with DETECT, which is up while any latch is.
        let detected = around.world.pins.latched.iter().any(|latch| *latch != 0);
        if detected && !self.detected {
            self.common.raise(PORT, around);
        }
        self.detected = detected;
    }
}

impl Peripheral for Gpiote {
    fn read(&mut self, offset: u32, _now: u64, _around: &mut Around<'_>) -> Option<u32> {
        match offset {
            0x510..0x530 => Some(self.configuration[(offset as usize - 0x510) / 4]),
            _ => self.common.read(offset),
        }
    }

    fn write(&mut self, offset: u32, value: u32, _now: u64, around: &mut Around<'_>) -> Option<()> {
        match offset {
            0x510..0x530 => {
                // Task mode drives a pin from PPI: the image does not use it.
                if value & 3 == 3 {
                    return None;
                }
                self.configuration[(offset as usize - 0x510) / 4] = value;
                self.seen = around.world.pins.levels;
            }
            _ => {
                return self.common.write(offset, value);
            }
        }
        Some(())
    }

    fn line(&self) -> bool {
        self.common.line()
    }
}
