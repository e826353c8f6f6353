//! Models of the nRF52840's peripherals. "PS" is Nordic's nRF52840 product specification, version 1.7.
//!
//! A model holds registers and what is under way. Tasks, events and interrupts are the chip's common scheme (PS 6.1):
//! a task is a write of 1 to an offset below 0x100, event *n* lies at 0x100 + 4 *n* and is bit *n* of INTEN, SHORTS is
//! at 0x200, INTEN, INTENSET and INTENCLR at 0x300, 0x304 and 0x308. Time is counted in cycles of the 64 MHz clock.

pub mod clock;
pub mod gpio;
pub mod gpiote;
pub mod information;
pub mod nvmc;
pub mod ppi;
pub mod rng;
pub mod rtc;
pub mod saadc;
pub mod spim;
pub mod timer;
pub mod twim;
pub mod uarte;
pub mod watchdog;

use crate::error::MachineError;
use crate::world::World;

/// Cycles of the processor in one second.
pub const CYCLES_PER_S: u64 = 64_000_000;
/// Cycles in one microsecond.
pub const CYCLES_PER_US: u64 = 64;

/// Cycle at which a number of periods of the 32,768 Hz clock is over.
#[must_use]
pub const fn slow_to_cycles(periods: u64) -> u64 {
    (periods * 15_625).div_ceil(8)
}

/// Periods of the 32,768 Hz clock that are over at a cycle.
#[must_use]
pub const fn cycles_to_slow(cycle: u64) -> u64 {
    cycle * 8 / 15_625
}

/// What a peripheral reaches by DMA.
pub trait Memory {
    /// Fills `bytes` from RAM.
    ///
    /// # Errors
    /// `DmaOutsideRam`.
    fn load(&mut self, address: u32, bytes: &mut [u8]) -> Result<(), MachineError>;
    /// Writes `bytes` to RAM.
    ///
    /// # Errors
    /// `DmaOutsideRam`.
    fn store(&mut self, address: u32, bytes: &[u8]) -> Result<(), MachineError>;
    /// Fills a part of the flash with one byte.
    ///
    /// # Errors
    /// The emulator's.
    fn erase(&mut self, address: u32, length: usize) -> Result<(), MachineError>;
    /// Lets the processor write to flash, or not.
    ///
    /// # Errors
    /// The emulator's.
    fn open_flash(&mut self, writable: bool) -> Result<(), MachineError>;
}

/// Why the chip started again (PS 5.3, register RESETREAS).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reset {
    /// The watchdog was not fed.
    Watchdog,
    /// The image asked for it.
    Software,
}

/// What a model may touch besides itself.
pub struct Around<'a> {
    /// RAM and flash.
    pub memory: &'a mut dyn Memory,
    /// What is connected to the chip.
    pub world: &'a mut World,
    /// What happens in consequence.
    pub effects: &'a mut Effects,
}

/// What follows from an access or a deadline.
#[derive(Debug, Default)]
pub struct Effects {
    /// Addresses of events that were raised: for PPI.
    pub raised: Vec<u32>,
    /// Cycles during which the processor stands still.
    pub stall_cycles: u64,
    /// The chip starts anew.
    pub reset: Option<Reset>,
    /// What the image did wrong.
    pub fault: Option<MachineError>,
}

/// One peripheral. `None` from an access means that it has no such register.
pub trait Peripheral {
    /// A load at an offset below 0x1000.
    fn read(&mut self, offset: u32, now: u64, around: &mut Around<'_>) -> Option<u32>;
    /// A store, or a task.
    fn write(&mut self, offset: u32, value: u32, now: u64, around: &mut Around<'_>) -> Option<()>;
    /// Cycle of the next thing that happens by itself.
    fn deadline(&self) -> Option<u64> {
        None
    }
    /// Lets happen what is due at `at`, which was the deadline.
    fn fire(&mut self, _at: u64, _around: &mut Around<'_>) {}
    /// Whether the interrupt line is up.
    fn line(&self) -> bool {
        false
    }
}

/// The registers that every peripheral has in the same places.
#[derive(Clone, Debug)]
pub struct Common {
    base: u32,
    /// Bit n: there is an event n.
    known: u32,
    /// Bit n: event n happened and was not cleared.
    pub events: u32,
    /// Bit n: event n interrupts.
    pub enabled: u32,
    /// SHORTS, for those that have it.
    pub shorts: u32,
    known_shorts: u32,
}

impl Common {
    /// Registers of the peripheral at `base`, with the events and shorts whose bits are set.
    #[must_use]
    pub const fn new(base: u32, known: u32, known_shorts: u32) -> Self {
        Self {
            base,
            known,
            events: 0,
            enabled: 0,
            shorts: 0,
            known_shorts,
        }
    }

    /// Raises event `number`.
    pub fn raise(&mut self, number: u32, around: &mut Around<'_>) {
        self.events |= 1 << number;
        around.effects.raised.push(self.base + 0x100 + 4 * number);
    }

    fn event(&self, offset: u32) -> Option<u32> {
        let number = (offset.checked_sub(0x100)?) / 4;
        (offset.is_multiple_of(4) && number < 32 && self.known >> number & 1 == 1).then_some(number)
    }

    /// A load from one of these registers.
    #[must_use]
    pub fn read(&self, offset: u32) -> Option<u32> {
        match offset {
            0x200 if self.known_shorts != 0 => Some(self.shorts),
            0x300 | 0x304 | 0x308 => Some(self.enabled),
            _ => self.event(offset).map(|number| self.events >> number & 1),
        }
    }

    /// A store to one of these registers.
    pub fn write(&mut self, offset: u32, value: u32) -> Option<()> {
        match offset {
            0x200 if value & !self.known_shorts == 0 => self.shorts = value,
            // Bits without an event are cleared by drivers that clear everything; setting one is an error.
            0x300 if value & !self.known == 0 => self.enabled = value,
            0x304 if value & !self.known == 0 => self.enabled |= value,
            0x308 => self.enabled &= !value,
            _ => {
                let number = self.event(offset)?;
                self.events = self.events & !(1 << number) | (value & 1) << number;
            }
        }
        Some(())
    }

    /// Whether any event that interrupts has happened.
    #[must_use]
    pub const fn line(&self) -> bool {
        self.events & self.enabled != 0
    }
}

/// Registers that only keep what is written, by offset: configuration that the model does not need or reads itself.
#[derive(Clone, Debug)]
pub struct Kept(Vec<(u32, u32)>);

impl Kept {
    /// Offsets and values at reset.
    #[must_use]
    pub fn new(registers: &[(u32, u32)]) -> Self {
        Self(registers.to_vec())
    }

    /// The value, if there is such a register.
    #[must_use]
    pub fn get(&self, offset: u32) -> Option<u32> {
        self.0
            .iter()
            .find(|(at, _)| *at == offset)
            .map(|(_, value)| *value)
    }

    /// Keeps a value, if there is such a register.
    pub fn set(&mut self, offset: u32, value: u32) -> Option<()> {
        let register = self.0.iter_mut().find(|(at, _)| *at == offset)?;
        register.1 = value;
        Some(())
    }

    /// The value of a register that the model itself declared.
    #[must_use]
    pub fn value(&self, offset: u32) -> u32 {
        self.get(offset).unwrap_or_default()
    }
}
