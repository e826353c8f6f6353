//! RAM, flash and registers as the processor's emulator has them.

use unicorn_engine::{Prot, uc_error};

use super::hooks::stop_if_broken_off;
use super::state::{Engine, engine_error, with_bus};
use crate::chip::{Memory, noise::Noise};
use crate::error::MachineError;
use crate::flash::Operation;
use crate::image::FLASH_BYTES;
use crate::system;

/// RAM (PS 4.2).
pub(super) const RAM: std::ops::Range<u32> = 0x2000_0000..0x2004_0000;
/// Where registers are, and bytes of it: FICR and UICR, peripherals, pins, the processor's own.
const REGISTERS: [(u32, u64); 4] = [
    (0x1000_0000, 0x2000),
    (0x4000_0000, 0x4_0000),
    (0x5000_0000, 0x1000),
    (system::BASE, 0x1000),
];

/// Access to RAM and flash past the processor.
pub(super) struct Direct<'a, 'b>(pub(super) &'a mut Engine<'b>);

impl Direct<'_, '_> {
    fn in_ram(address: u32, length: usize) -> Result<u64, MachineError> {
        let inside = RAM.contains(&address) && address as usize + length <= RAM.end as usize;
        inside
            .then_some(u64::from(address))
            .ok_or(MachineError::DmaOutsideRam { address, length })
    }
}

impl Memory for Direct<'_, '_> {
    fn load(&mut self, address: u32, bytes: &mut [u8]) -> Result<(), MachineError> {
        let at = Self::in_ram(address, bytes.len())?;
        self.0.mem_read(at, bytes).map_err(engine_error)
    }

    fn store(&mut self, address: u32, bytes: &[u8]) -> Result<(), MachineError> {
        let at = Self::in_ram(address, bytes.len())?;
        self.0.mem_write(at, bytes).map_err(engine_error)
    }

    fn flash(&mut self, operation: Operation) -> Result<(), MachineError> {
        let (address, length) = operation.extent();
        let mut bytes = vec![0; length];
        let at = u64::from(address);
        self.0.mem_read(at, &mut bytes).map_err(engine_error)?;
        let flash = &mut self.0.get_data_mut().flash;
        flash.perform(operation, &mut bytes)?;
        self.0.mem_write(at, &bytes).map_err(engine_error)
    }

    fn open_flash(&mut self, writable: bool) -> Result<(), MachineError> {
        let access = if writable {
            Prot::ALL
        } else {
            Prot::READ | Prot::EXEC
        };
        self.0
            .mem_protect(0, FLASH_BYTES as u64, access)
            .map_err(engine_error)
    }
}

/// Lays everything out; RAM holds what it happens to hold.
pub(super) fn map(engine: &mut Engine<'_>, flash: &[u8], seed: u64) -> Result<(), uc_error> {
    engine.mem_map(0, FLASH_BYTES as u64, Prot::ALL)?;
    engine.mem_write(0, flash)?;
    engine.mem_protect(0, FLASH_BYTES as u64, Prot::READ | Prot::EXEC)?;
    engine.mem_map(
        u64::from(RAM.start),
        u64::from(RAM.end - RAM.start),
        Prot::READ | Prot::WRITE,
    )?;
    scramble_ram(engine, seed)?;
    for (base, size) in REGISTERS {
        map_registers(engine, base, size)?;
    }
    Ok(())
}

/// Whether an address is in none of the regions that the chip has something in.
pub(super) fn is_nothing(address: u32) -> bool {
    let registers =
        |(base, size): (u32, u64)| address >= base && u64::from(address) < u64::from(base) + size;
    (address as usize) >= FLASH_BYTES
        && !RAM.contains(&address)
        && !REGISTERS.into_iter().any(registers)
}

/// What RAM holds when power comes is anything.
pub(super) fn scramble_ram(engine: &mut Engine<'_>, seed: u64) -> Result<(), uc_error> {
    let mut content = vec![0; RAM.len()];
    Noise::new(seed).fill(&mut content);
    engine.mem_write(u64::from(RAM.start), &content)
}

fn map_registers(engine: &mut Engine<'_>, base: u32, size: u64) -> Result<(), uc_error> {
    let read = move |engine: &mut Engine<'_>, offset: u64, size: usize| {
        let address = base + offset as u32;
        let value = with_bus(engine, |bus, cycle, memory| {
            bus.advance(cycle, memory);
            bus.read(address, size, cycle, memory)
        });
        stop_if_broken_off(engine);
        u64::from(value.unwrap_or_default())
    };
    let write = move |engine: &mut Engine<'_>, offset: u64, size: usize, value: u64| {
        let address = base + offset as u32;
        with_bus(engine, |bus, cycle, memory| {
            bus.advance(cycle, memory);
            bus.write(address, value as u32, size, cycle, memory);
        });
        stop_if_broken_off(engine);
    };
    engine.mmio_map(u64::from(base), size, Some(read), Some(write))
}
