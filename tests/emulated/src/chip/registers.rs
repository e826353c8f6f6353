//! The registers that peripherals have in common, and those that only keep what is written.

use super::Around;

/// Registers of one peripheral: tasks aside, everything that follows the chip's common scheme (PS 6.1), and
/// configuration that the model does not need or reads itself.
#[derive(Clone, Debug)]
pub struct Registers {
    base: u32,
    /// Bit n: there is an event n.
    known_events: u32,
    known_shorts: u32,
    events: u32,
    enabled: u32,
    shorts: u32,
    /// Offset and value.
    kept: Vec<(u32, u32)>,
}

impl Registers {
    /// Of the peripheral at `base`: which events and shorts it has, by bit, and its other registers, by offset, with
    /// their values at reset.
    #[must_use]
    pub fn new(base: u32, known_events: u32, known_shorts: u32, kept: &[(u32, u32)]) -> Self {
        Self {
            base,
            known_events,
            known_shorts,
            events: 0,
            enabled: 0,
            shorts: 0,
            kept: kept.to_vec(),
        }
    }

    /// Raises event `number`.
    pub fn raise(&mut self, number: u32, around: &mut Around<'_>) {
        self.events |= 1 << number;
        around.effects.raised.push(self.base + 0x100 + 4 * number);
    }

    /// Whether short `number` is set.
    #[must_use]
    pub const fn short(&self, number: u32) -> bool {
        self.shorts >> number & 1 == 1
    }

    /// Events that interrupt, by bit.
    #[must_use]
    pub const fn enabled(&self) -> u32 {
        self.enabled
    }

    /// Whether any event that interrupts has happened.
    #[must_use]
    pub const fn line(&self) -> bool {
        self.events & self.enabled != 0
    }

    /// A kept register that the model itself declared.
    #[must_use]
    pub fn value(&self, offset: u32) -> u32 {
        self.kept(offset).unwrap_or_default()
    }

    /// Puts a value into a kept register, if there is such a one.
    pub fn keep(&mut self, offset: u32, value: u32) -> Option<()> {
        let register = self.kept.iter_mut().find(|(at, _)| *at == offset)?;
        register.1 = value;
        Some(())
    }

    fn kept(&self, offset: u32) -> Option<u32> {
        let register = self.kept.iter().find(|(at, _)| *at == offset);
        register.map(|(_, value)| *value)
    }

    fn event(&self, offset: u32) -> Option<u32> {
        let number = (offset.checked_sub(0x100)?) / 4;
        let known = number < 32 && self.known_events >> number & 1 == 1;
        (offset.is_multiple_of(4) && known).then_some(number)
    }

    /// A load, if there is such a register.
    #[must_use]
    pub fn read(&self, offset: u32) -> Option<u32> {
        match offset {
            0x200 if self.known_shorts != 0 => Some(self.shorts),
            0x300 | 0x304 | 0x308 if self.known_events != 0 => Some(self.enabled),
            _ => match self.event(offset) {
                Some(number) => Some(self.events >> number & 1),
                None => self.kept(offset),
            },
        }
    }

    /// A store, if there is such a register.
    pub fn write(&mut self, offset: u32, value: u32) -> Option<()> {
        // Setting a bit without an event is an error; drivers that clear everything clear such bits too.
        let has_events = self.known_events != 0;
        let known = has_events && value & !self.known_events == 0;
        match offset {
            0x200 if self.known_shorts != 0 => {
                (value & !self.known_shorts == 0).then(|| self.shorts = value)
            }
            0x300 if has_events => known.then(|| self.enabled = value),
            0x304 if has_events => known.then(|| self.enabled |= value),
            0x308 if has_events => {
                self.enabled &= !value;
                Some(())
            }
            _ => match self.event(offset) {
                Some(number) => {
                    self.events = self.events & !(1 << number) | (value & 1) << number;
                    Some(())
                }
                None => self.keep(offset, value),
            },
        }
    }
}
