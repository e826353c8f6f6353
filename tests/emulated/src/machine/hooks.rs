//! What happens before each block of instructions, and when one touches what it must not.

use unicorn_engine::{HookType, MemType, RegisterARM, uc_error};

use super::state::{Engine, engine_error, with_bus};
use crate::chip::{Memory, nvmc::WRITE_CYCLES};
use crate::error::{Access, FlashMisuse, MachineError};
use crate::exception;
use crate::flash::Operation;
use crate::image::{FLASH_BYTES, Image};

const SEV: u16 = 0xBF40;
/// `b .`: a loop of one instruction that does nothing.
pub(super) const ENDLESS_LOOP: u16 = 0xE7FE;
/// CPSR bits of an open IT block.
const IN_IT_BLOCK: u64 = 0x0600_FC00;

/// Sets all of them.
pub(super) fn set(engine: &mut Engine<'_>, image: &Image) -> Result<(), uc_error> {
    engine.add_block_hook(1, 0, before_block)?;
    for address in image.halfwords(SEV) {
        let at = u64::from(address);
        engine.add_code_hook(at, at, |engine, _, _| engine.get_data_mut().event = true)?;
    }
    engine.add_mem_hook(
        HookType::MEM_WRITE,
        0,
        FLASH_BYTES as u64 - 1,
        |engine, _, address, size, value| before_flash_write(engine, address as u32, size, value),
    )?;
    engine.add_mem_hook(
        HookType::MEM_UNMAPPED | HookType::MEM_WRITE_PROT,
        1,
        0,
        |engine, kind, address, _, value| {
            let access = match kind {
                MemType::WRITE_UNMAPPED | MemType::WRITE_PROT => Access::Write(value as u32),
                _ => Access::Read,
            };
            // A fetch from here is an exception's return, which the loop sees.
            if address < u64::from(exception::RETURNS) {
                engine.get_data_mut().fault = Some(MachineError::Unmodelled {
                    access,
                    address: address as u32,
                    pc: 0,
                    function: String::new(),
                });
            }
            false
        },
    )?;
    Ok(())
}

/// Lets peripherals act, stops for interrupts, counts.
fn before_block(engine: &mut Engine<'_>, address: u64, size: u32) {
    finish_flash_writes(engine);
    if engine.get_data().cycle >= engine.get_data().next() {
        with_bus(engine, |bus, cycle, memory| bus.advance(cycle, memory));
    }
    if stops_before(engine) {
        engine.get_data_mut().stopped_before = Some(address as u32);
        stop(engine);
        return;
    }
    let state = engine.get_data_mut();
    let count = state.counts.of(&state.code, address as u32, size);
    let at = address as usize;
    if size == 2 && state.code.get(at..at + 2) == Some(&ENDLESS_LOOP.to_le_bytes()) {
        // Nothing changes before something happens outside: the time until then passes at once.
        state.cycle = state.next().max(state.cycle + 1);
    } else {
        state.cycle += count * state.cycles_per_instruction;
    }
    state.instructions += count;
}

/// Whether the loop has something to do before this block.
fn stops_before(engine: &Engine<'_>) -> bool {
    let state = engine.get_data();
    if state.broken_off() {
        return true;
    }
    let over = state.cycle >= state.end;
    if !over && !state.interrupted() {
        return false;
    }
    let open = engine.reg_read(RegisterARM::CPSR).unwrap_or_default() & IN_IT_BLOCK != 0;
    let masked = engine.reg_read(RegisterARM::PRIMASK).unwrap_or_default() & 1 == 1;
    !open && (over || !masked)
}

fn stop(engine: &mut Engine<'_>) {
    if let Err(error) = engine.emu_stop() {
        engine.get_data_mut().fault = Some(engine_error(error));
    }
}

/// After an access that led to a fault or a reset nothing more is executed.
pub(super) fn stop_if_broken_off(engine: &mut Engine<'_>) {
    if engine.get_data().broken_off() {
        stop(engine);
    }
}

/// Notes what a word of the flash was; the write itself follows.
fn before_flash_write(engine: &mut Engine<'_>, address: u32, size: usize, value: i64) -> bool {
    if size != 4 || !address.is_multiple_of(4) {
        engine.get_data_mut().fault = Some(MachineError::Flash {
            address,
            misuse: FlashMisuse::NoWord,
        });
        return false;
    }
    let mut word = [0; 4];
    let read = engine.mem_read(u64::from(address), &mut word).is_ok();
    let written = (address, u32::from_le_bytes(word), value as u32);
    engine.get_data_mut().written.push(written);
    read
}

/// Makes of the words that the image wrote what flash makes of them (PS 4.3, "Writing to flash").
fn finish_flash_writes(engine: &mut Engine<'_>) {
    if engine.get_data().written.is_empty() {
        return;
    }
    let written = std::mem::take(&mut engine.get_data_mut().written);
    let mut restored = Ok(());
    for (address, before, _) in written.iter().rev() {
        let done = engine.mem_write(u64::from(*address), &before.to_le_bytes());
        restored = restored.and(done);
    }
    with_bus(engine, |bus, _, memory| {
        let mut done = restored.map_err(engine_error);
        for (address, _, value) in written {
            bus.effects.stall_cycles += WRITE_CYCLES;
            done = done.and_then(|()| memory.flash(Operation::Write { address, value }));
        }
        bus.effects.fault = done.err();
    });
}
