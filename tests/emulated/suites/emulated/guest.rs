//! Small programs for the bare machine, as GNU as 2.40 assembles them:
//!
//! ```asm
//! .syntax unified
//! .cpu cortex-m4
//! .thumb
//! .text
//! vectors:
//!   .word 0x20001000, reset + 1, 0, fault + 1
//! @ Counts its starts at the bottom of RAM and leaves RESETREAS beside the count.
//! begin:
//!   movs r0, #1
//!   lsls r0, r0, #29        @ RAM
//!   ldr r1, [r0]
//!   adds r1, #1
//!   str r1, [r0]
//!   ldr r2, =0x40000400     @ RESETREAS
//!   ldr r1, [r2]
//!   str r1, [r0, #4]
//!   bx lr
//! fault:
//!   movs r0, #1
//!   lsls r0, r0, #29
//!   ldr r1, =0xE000ED28     @ CFSR
//!   ldr r1, [r1]
//!   str r1, [r0, #8]
//!   udf #0
//! @ Asks for a reset, interrupts masked.
//! reset:
//!   bl begin
//!   cpsid i
//!   ldr r1, =0xE000ED0C     @ AIRCR
//!   ldr r2, =0x05FA0004
//!   str r2, [r1]
//! stay:
//!   b stay
//! @ Starts the watchdog, 328 periods, and hangs.
//! dog:
//!   bl begin
//!   ldr r1, =0x40010504     @ CRV
//!   ldr r2, =327
//!   str r2, [r1]
//!   ldr r1, =0x40010000     @ START
//!   movs r2, #1
//!   str r2, [r1]
//!   b stay
//! @ Executes what does not exist.
//! undefined:
//!   bl begin
//!   udf #1
//! @ Grows its stack out of RAM.
//! overflow:
//!   bl begin
//!   movs r1, #1
//!   lsls r1, r1, #29
//!   adds r1, #16
//!   mov sp, r1
//! more:
//!   push {r0, r1, r2, lr}
//!   b more
//! @ Erases a page and writes eight words to it: 0x01010101 times their number.
//! store:
//!   bl begin
//!   ldr r3, =0x4001E504     @ CONFIG
//!   movs r1, #2
//!   str r1, [r3]
//!   ldr r4, =0x000FC000
//!   str r4, [r3, #4]        @ ERASEPAGE
//!   movs r1, #1
//!   str r1, [r3]
//!   ldr r5, =0x4001E400     @ READY
//!   ldr r6, =0x01010101
//!   movs r1, #0
//! words:
//!   str r1, [r4]
//! wait:
//!   ldr r2, [r5]
//!   cmp r2, #0
//!   beq wait
//!   adds r4, #4
//!   adds r1, r1, r6
//!   lsrs r2, r4, #5
//!   lsls r2, r2, #5
//!   cmp r2, r4
//!   bne words
//!   movs r1, #0
//!   str r1, [r3]
//!   b stay
//! @ Writes half a word.
//! half:
//!   bl begin
//!   ldr r3, =0x4001E504
//!   movs r1, #1
//!   str r1, [r3]
//!   ldr r4, =0x000FC000
//!   strh r1, [r4]
//!   b stay
//! .ltorg
//! ```

use tonus_emulated::{Image, Machine, world::World};

/// Where each program begins.
pub(crate) const ASKS_FOR_A_RESET: u32 = 0x2E;
pub(crate) const HANGS_UNDER_THE_WATCHDOG: u32 = 0x3C;
pub(crate) const EXECUTES_WHAT_DOES_NOT_EXIST: u32 = 0x50;
pub(crate) const OVERFLOWS_ITS_STACK: u32 = 0x56;
pub(crate) const STORES: u32 = 0x66;
pub(crate) const STORES_HALF_A_WORD: u32 = 0x9C;

/// Code and constants.
const PROGRAM: [u32; 52] = [
    0x2000_1000,
    0x0000_002F,
    0x0000_0000,
    0x0000_0023,
    0x0740_2001,
    0x3101_6801,
    0x4A25_6001,
    0x6041_6811,
    0x2001_4770,
    0x4923_0740,
    0x6081_6809,
    0xF7FF_DE00,
    0xB672_FFEF,
    0x4A21_4920,
    0xE7FE_600A,
    0xFFE8_F7FF,
    0xF240_491F,
    0x600A_1247,
    0x2201_491E,
    0xE7F4_600A,
    0xFFDE_F7FF,
    0xF7FF_DE01,
    0x2101_FFDB,
    0x3110_0749,
    0xB507_468D,
    0xF7FF_E7FD,
    0x4B17_FFD3,
    0x6019_2102,
    0x247C_F44F,
    0x2101_605C,
    0x4D14_6019,
    0x3601_F04F,
    0x6021_2100,
    0x2A00_682A,
    0x3404_D0FC,
    0x0962_1989,
    0x42A2_0152,
    0x2100_D1F5,
    0xE7CE_6019,
    0xFFB8_F7FF,
    0x2101_4B09,
    0xF44F_6019,
    0x8021_247C,
    0x0000_E7C5,
    0x4000_0400,
    0xE000_ED28,
    0xE000_ED0C,
    0x05FA_0004,
    0x4001_0504,
    0x4001_0000,
    0x4001_E504,
    0x4001_E400,
];
/// Place of the reset vector.
const RESET_VECTOR: usize = 1;

/// What the programs leave at the bottom of RAM: starts since RAM held something else, RESETREAS at the last one, CFSR
/// at the last fault.
pub(crate) struct Left {
    pub(crate) starts: u32,
    pub(crate) reasons: u32,
    pub(crate) cause: u32,
}

/// A machine whose reset vector points to `program`.
pub(crate) fn machine(program: u32, seed: u64) -> Machine {
    let mut words = PROGRAM;
    words[RESET_VECTOR] = program | 1;
    let code: Vec<u8> = words.into_iter().flat_map(u32::to_le_bytes).collect();
    let world = World {
        seed,
        ..World::default()
    };
    Machine::new(Image::of_code(&code), world).unwrap()
}

pub(crate) fn left(machine: &Machine) -> Left {
    let bytes = machine.bytes(0x2000_0000, 12).unwrap();
    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
    Left {
        starts: word(0),
        reasons: word(4),
        cause: word(8),
    }
}
