//! PPI: events that trigger tasks without the processor (PS 6.16).

use super::{Around, Peripheral};

/// Address.
pub const BASE: u32 = 0x4001_F000;
const CHANNELS: usize = 20;
const GROUPS: usize = 6;

/// Channels and groups. The fixed channels 20 to 31 belong to the radio and are not modelled.
#[derive(Clone, Debug, Default)]
pub struct Ppi {
    enabled: u32,
    event: [u32; CHANNELS],
    task: [u32; CHANNELS],
    fork: [u32; CHANNELS],
    group: [u32; GROUPS],
}

impl Ppi {
    /// Tasks that an event triggers.
    pub fn tasks(&self, event: u32) -> impl Iterator<Item = u32> {
        (0..CHANNELS)
            .filter(move |n| self.enabled >> n & 1 == 1 && self.event[*n] == event)
            .flat_map(|n| [self.task[n], self.fork[n]])
            .filter(|task| *task != 0)
    }

    /// The register at an offset, if it is one of a channel or group.
    fn register(&mut self, offset: u32) -> Option<&mut u32> {
        let offset = offset as usize;
        match offset {
            0x510..0x5B0 if offset.is_multiple_of(8) => self.event.get_mut((offset - 0x510) / 8),
            0x510..0x5B0 => self.task.get_mut((offset - 0x514) / 8),
            0x800..0x818 => self.group.get_mut((offset - 0x800) / 4),
            0x910..0x960 => self.fork.get_mut((offset - 0x910) / 4),
            _ => None,
        }
    }
}

impl Peripheral for Ppi {
    fn read(&mut self, offset: u32, _now: u64, _around: &mut Around<'_>) -> Option<u32> {
        match offset {
            0x500 | 0x504 | 0x508 => Some(self.enabled),
            _ => self.register(offset).copied(),
        }
    }

    fn write(
        &mut self,
        offset: u32,
        value: u32,
        _now: u64,
        _around: &mut Around<'_>,
    ) -> Option<()> {
        match offset {
            0x000..0x030 => {
                let channels = *self.group.get(offset as usize / 8)?;
                if offset.is_multiple_of(8) {
                    self.enabled |= channels;
                } else {
                    self.enabled &= !channels;
                }
            }
            0x500 => self.enabled = value,
            0x504 => self.enabled |= value,
            0x508 => self.enabled &= !value,
            _ => *self.register(offset)? = value,
        }
        // Channels above are the radio's.
        (self.enabled >> CHANNELS == 0).then_some(())
    }
}
