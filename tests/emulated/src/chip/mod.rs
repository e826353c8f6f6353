//! Models of the nRF52840's peripherals. "PS" is Nordic's nRF52840 product specification, version 1.7.
//!
//! A model holds registers and what is under way. Tasks, events and interrupts are the chip's common scheme (PS 6.1):
//! a task is a write of 1 to an offset below 0x100, event *n* lies at 0x100 + 4 *n* and is bit *n* of INTEN, SHORTS is
//! at 0x200, INTEN, INTENSET and INTENCLR at 0x300, 0x304 and 0x308. Time is counted in cycles of the 64 MHz clock.

pub mod clock;
pub mod gpio;
pub mod gpiote;
pub mod information;
pub mod noise;
pub mod nvmc;
pub mod ppi;
pub mod registers;
pub mod reset;
pub mod rng;
pub mod rtc;
pub mod saadc;
pub mod spim;
pub mod timer;
pub mod twim;
pub mod uarte;
pub mod watchdog;

use crate::error::MachineError;
use crate::flash::Operation;
use crate::world::World;

pub use reset::Reset;

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
    /// Does something to the flash.
    ///
    /// # Errors
    /// `Flash`, and the emulator's.
    fn flash(&mut self, operation: Operation) -> Result<(), MachineError>;
    /// Lets the processor write to flash, or not.
    ///
    /// # Errors
    /// The emulator's.
    fn open_flash(&mut self, writable: bool) -> Result<(), MachineError>;
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
