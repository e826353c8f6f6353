//! Entering and leaving interrupts by hand (Armv7-M architecture reference manual, B1.5.6 to B1.5.8): the emulator
//! of the processor knows no interrupt controller.

use unicorn_engine::{RegisterARM, uc_error};

use crate::machine::Engine;

/// Words of the frame with floating-point registers: r0 to r3, r12, lr, pc, xPSR; s0 to s15, FPSCR, one unused.
const FRAME_WORDS: usize = 26;
/// EXC_RETURN values for a frame with floating-point registers on the main stack.
const TO_THREAD: u32 = 0xFFFF_FFE9;
const TO_HANDLER: u32 = 0xFFFF_FFE1;
/// A branch to this address or above is an exception's return.
pub(crate) const RETURNS: u32 = 0xFFFF_FFE0;
/// xPSR: the stack pointer was no multiple of eight.
const PADDED: u32 = 1 << 9;
/// xPSR: Thumb state.
const THUMB: u32 = 1 << 24;
/// xPSR: N, Z, C, V, Q and the four GE flags.
const FLAGS: u32 = 0xF80F_0000;

const LOW: [RegisterARM; 6] = [
    RegisterARM::R0,
    RegisterARM::R1,
    RegisterARM::R2,
    RegisterARM::R3,
    RegisterARM::R12,
    RegisterARM::LR,
];
const FLOATS: [RegisterARM; 16] = [
    RegisterARM::S0,
    RegisterARM::S1,
    RegisterARM::S2,
    RegisterARM::S3,
    RegisterARM::S4,
    RegisterARM::S5,
    RegisterARM::S6,
    RegisterARM::S7,
    RegisterARM::S8,
    RegisterARM::S9,
    RegisterARM::S10,
    RegisterARM::S11,
    RegisterARM::S12,
    RegisterARM::S13,
    RegisterARM::S14,
    RegisterARM::S15,
];

fn register(engine: &Engine<'_>, register: RegisterARM) -> Result<u32, uc_error> {
    Ok(engine.reg_read(register)? as u32)
}

/// Pushes the frame and points the processor at the handler whose vector is at `vector`; gives its address.
pub(crate) fn enter(
    engine: &mut Engine<'_>,
    pc: u32,
    vector: u32,
    nested: bool,
) -> Result<u32, uc_error> {
    let mut frame = [0; FRAME_WORDS];
    for (word, name) in frame.iter_mut().zip(LOW) {
        *word = register(engine, name)?;
    }
    let stack = register(engine, RegisterARM::SP)?;
    let padded = if stack % 8 == 0 { 0 } else { PADDED };
    let flags = register(engine, RegisterARM::APSR)? & FLAGS;
    frame[6] = pc & !1;
    frame[7] = flags | THUMB | padded;
    for (word, name) in frame[8..].iter_mut().zip(FLOATS) {
        *word = register(engine, name)?;
    }
    frame[24] = register(engine, RegisterARM::FPSCR)?;
    let stack = (stack - 4 * FRAME_WORDS as u32) & !7;
    let bytes: Vec<u8> = frame.iter().flat_map(|word| word.to_le_bytes()).collect();
    engine.mem_write(u64::from(stack), &bytes)?;
    engine.reg_write(RegisterARM::SP, u64::from(stack))?;
    let link = if nested { TO_HANDLER } else { TO_THREAD };
    engine.reg_write(RegisterARM::LR, u64::from(link))?;
    let mut word = [0; 4];
    engine.mem_read(u64::from(vector), &mut word)?;
    Ok(u32::from_le_bytes(word) & !1)
}

/// Pops the frame and gives the address at which to go on.
pub(crate) fn leave(engine: &mut Engine<'_>) -> Result<u32, uc_error> {
    let stack = register(engine, RegisterARM::SP)?;
    let mut bytes = [0; 4 * FRAME_WORDS];
    engine.mem_read(u64::from(stack), &mut bytes)?;
    let word = |place: usize| {
        bytes
            .get(4 * place..)
            .and_then(|from| from.first_chunk())
            .map_or(0, |word| u32::from_le_bytes(*word))
    };
    for (place, name) in LOW.into_iter().enumerate() {
        engine.reg_write(name, u64::from(word(place)))?;
    }
    for (place, name) in FLOATS.into_iter().enumerate() {
        engine.reg_write(name, u64::from(word(8 + place)))?;
    }
    engine.reg_write(RegisterARM::FPSCR, u64::from(word(24)))?;
    let flags = word(7);
    engine.reg_write(RegisterARM::APSR_NZCVQG, u64::from(flags & FLAGS))?;
    let padding = if flags & PADDED == 0 { 0 } else { 4 };
    let behind = stack + 4 * FRAME_WORDS as u32 + padding;
    engine.reg_write(RegisterARM::SP, u64::from(behind))?;
    Ok(word(6))
}
