//! The machine itself, under programs of a few instructions: resets, hard faults, flash, power cuts.

use tonus_emulated::chip::Reset;
use tonus_emulated::error::FlashMisuse;
use tonus_emulated::flash::{Operation, torn};
use tonus_emulated::{Machine, MachineError, Stop};

use super::guest::{self, left, machine};

/// First byte of the page that the program erases and writes, and its words.
const PAGE: u32 = 0xF_C000;
const WORDS: [u32; 8] = [
    0,
    0x0101_0101,
    0x0202_0202,
    0x0303_0303,
    0x0404_0404,
    0x0505_0505,
    0x0606_0606,
    0x0707_0707,
];
/// An erase and the writes.
const OPERATIONS: usize = 1 + WORDS.len();
const LONG_US: u64 = 1_000_000;

fn stored(flash: &[u8]) -> Vec<u32> {
    flash[PAGE as usize..][..4 * WORDS.len()]
        .chunks_exact(4)
        .map(|word| u32::from_le_bytes(word.try_into().unwrap()))
        .collect()
}

#[test]
fn a_reset_by_software_keeps_ram_and_says_so() {
    let mut machine = machine(guest::ASKS_FOR_A_RESET, 1);
    let first = u32::from_le_bytes(machine.bytes(0x2000_0000, 4).unwrap().try_into().unwrap());
    for resets in 1..=3 {
        assert_eq!(machine.run_until(LONG_US), Ok(Stop::Reset(Reset::Software)));
        let left = left(&machine);
        assert_eq!(left.starts, first.wrapping_add(resets));
        assert_eq!(left.reasons, if resets == 1 { 0 } else { 1 << 2 });
        assert_eq!(machine.resets().len(), resets as usize);
    }
}

#[test]
fn a_button_adds_its_reason_and_power_clears_all_and_ram_too() {
    let mut machine = machine(guest::ASKS_FOR_A_RESET, 1);
    machine.run_until(LONG_US).unwrap();
    machine.press_reset().unwrap();
    machine.run_until(LONG_US).unwrap();
    assert_eq!(left(&machine).reasons, 0b101);
    let before = machine.bytes(0x2000_0000, 0x4_0000).unwrap();
    machine.cycle_power().unwrap();
    let after = machine.bytes(0x2000_0000, 0x4_0000).unwrap();
    let equal = before.iter().zip(&after).filter(|(a, b)| a == b).count();
    // One byte in 256 by chance: 1024, within six standard deviations.
    assert!(equal.abs_diff(1024) < 192, "{equal}");
    machine.run_until(LONG_US).unwrap();
    assert_eq!(left(&machine).reasons, 0);
    let reasons: Vec<Reset> = machine.resets().iter().map(|(_, why)| *why).collect();
    let expected = [
        Reset::Software,
        Reset::Pin,
        Reset::Software,
        Reset::Power,
        Reset::Software,
    ];
    assert_eq!(reasons, expected);
}

#[test]
fn a_hang_ends_when_the_watchdog_expires() {
    let mut machine = machine(guest::HANGS_UNDER_THE_WATCHDOG, 1);
    machine.run_through(25_000).unwrap();
    let [(first_us, first), (second_us, second)] = machine.resets() else {
        panic!("{:?}", machine.resets());
    };
    assert_eq!([first, second], [&Reset::Watchdog; 2]);
    // 328 periods of 32,768 Hz are 10,009.8 us.
    assert!(first_us.abs_diff(10_010) <= 31, "{first_us}");
    assert!((second_us - first_us).abs_diff(10_010) <= 31, "{second_us}");
    assert_eq!(left(&machine).reasons, 1 << 1);
}

#[test]
fn a_hard_fault_ends_the_run_or_reaches_the_image_as_asked() {
    let mut unserved = machine(guest::EXECUTES_WHAT_DOES_NOT_EXIST, 1);
    let outcome = unserved.run_until(LONG_US);
    assert!(
        matches!(outcome, Err(MachineError::Undefined { .. })),
        "{outcome:?}"
    );
    let mut machine = machine(guest::EXECUTES_WHAT_DOES_NOT_EXIST, 1);
    machine.serve_faults();
    // Its handler faults too: a lockup.
    assert_eq!(machine.run_until(LONG_US), Ok(Stop::Reset(Reset::Lockup)));
    // UNDEFINSTR.
    assert_eq!(left(&machine).cause, 1 << 16);
    machine.run_until(LONG_US).unwrap();
    assert_eq!(left(&machine).reasons, 1 << 3);
}

#[test]
fn a_stack_that_leaves_ram_locks_the_processor_up() {
    let mut machine = machine(guest::OVERFLOWS_ITS_STACK, 1);
    machine.serve_faults();
    assert_eq!(machine.run_until(LONG_US), Ok(Stop::Reset(Reset::Lockup)));
}

#[test]
fn flash_is_erased_and_written_in_the_time_that_it_takes() {
    let mut machine = machine(guest::STORES, 1);
    assert_eq!(machine.run_until(85_000 + 7 * 41), Ok(Stop::Time));
    assert_eq!(machine.run_until(85_000 + 8 * 41 + 2), Ok(Stop::Time));
    assert_eq!(stored(&machine.flash().unwrap()), WORDS);
    let mut operations = vec![Operation::Erase {
        address: PAGE,
        share: 256,
    }];
    operations.extend((0..).zip(WORDS).map(|(number, value)| Operation::Write {
        address: PAGE + 4 * number,
        value,
    }));
    assert_eq!(machine.flash_operations(), operations);
}

#[test]
fn half_a_word_cannot_be_written() {
    let mut machine = machine(guest::STORES_HALF_A_WORD, 1);
    assert_eq!(
        machine.run_until(LONG_US),
        Err(MachineError::Flash {
            address: PAGE,
            misuse: FlashMisuse::NoWord
        })
    );
}

/// Stores until power goes at an operation; gives the machine as it starts again.
fn cut(operation: usize, seed: u64) -> Machine {
    let mut machine = machine(guest::STORES, seed);
    machine.cut_power_at(operation);
    assert_eq!(machine.run_until(LONG_US), Ok(Stop::Reset(Reset::Power)));
    assert_eq!(machine.flash_operations().len(), operation + 1);
    machine
}

#[test]
fn power_goes_in_the_middle_of_every_operation_and_the_image_starts_again() {
    let mut half = 0;
    for operation in 0..OPERATIONS {
        let mut machine = cut(operation, operation as u64);
        let words = stored(&machine.flash().unwrap());
        let written = operation.saturating_sub(1);
        assert_eq!(words[..written], WORDS[..written]);
        if operation > 0 {
            // Only bits that were to become zero did, and what follows is erased.
            assert_eq!(words[written] & WORDS[written], WORDS[written]);
            assert!(words[written + 1..].iter().all(|word| *word == u32::MAX));
            half += u32::from(![WORDS[written], u32::MAX].contains(&words[written]));
        }
        assert_eq!(machine.run_until(LONG_US), Ok(Stop::Time));
        assert_eq!(stored(&machine.flash().unwrap()), WORDS);
        assert_eq!(left(&machine).reasons, 0);
    }
    assert!(half >= 6, "{half} words were half written");
}

#[test]
fn two_cuts_at_the_same_place_are_the_same_and_other_seeds_cut_otherwise() {
    let flash = |seed| cut(3, seed).flash().unwrap();
    assert_eq!(flash(1), flash(1));
    assert!((2..10).any(|seed| flash(seed) != flash(1)));
}

#[test]
fn the_image_can_start_from_what_any_cut_would_have_left() {
    let mut machine = machine(guest::STORES, 1);
    let before = machine.flash().unwrap();
    assert_eq!(machine.run_until(LONG_US), Ok(Stop::Time));
    let operations = machine.flash_operations().to_vec();
    for count in 1..=operations.len() {
        let left = torn(&before, &operations[..count], count as u64);
        machine.start_with_flash(&left).unwrap();
        assert_eq!(stored(&machine.flash().unwrap()), stored(&left));
        let now_us = machine.now_us();
        assert_eq!(machine.run_until(now_us + LONG_US), Ok(Stop::Time));
        assert_eq!(stored(&machine.flash().unwrap()), WORDS);
    }
}
