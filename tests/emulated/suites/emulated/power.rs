//! Power that goes while the flash is written.

use tonus_emulated::chip::Reset;
use tonus_emulated::flash::torn;
use tonus_emulated::{Machine, Stop};
use tonus_firmware::acquisition::{MUSCLES, RATE_HZ};
use tonus_shared::pipeline::illustrative;
use tonus_shared::wire::{Calibration, Packet, StatusFlags};

use super::models::{self, Model};
use super::{STARTED_US, frames_since, host, image, last_status, quiet, started};

/// From power to where the image answers.
const ANSWERS_US: u64 = 900_000;

/// A calibration of this revision, whose numbers tell it from every other.
fn calibration(revision: u32) -> Calibration {
    Calibration {
        revision,
        body_mass_kg: 50.0 + revision as f32,
        ..illustrative(MUSCLES, RATE_HZ)
    }
}

fn keep(machine: &mut Machine, revision: u32) {
    let packet = Packet::Calibration(calibration(revision));
    let answer = host::ask(machine, revision, packet);
    assert_eq!(answer.map(|(outcome, _)| outcome), Some(Ok(())));
}

#[test]
fn a_calibration_outlasts_power_and_the_last_one_counts() {
    let mut machine = started();
    for revision in 1..4 {
        keep(&mut machine, revision);
        machine.cycle_power().unwrap();
        let from_us = machine.now_us();
        machine.run_through(from_us + STARTED_US).unwrap();
        assert_eq!(host::calibration(&mut machine), calibration(revision));
        let flags = last_status(&frames_since(&machine, from_us)).flags;
        assert!(!flags.contains(StatusFlags::NOT_CALIBRATED));
    }
}

/// Starts from what is left when power goes at every operation of keeping a calibration over another.
#[test]
fn power_that_goes_at_any_write_of_a_calibration_leaves_the_old_or_the_new() {
    let mut machine = started();
    keep(&mut machine, 1);
    let before = machine.flash().unwrap();
    let done = machine.flash_operations().len();
    keep(&mut machine, 2);
    let after = machine.flash().unwrap();
    let operations = machine.flash_operations()[done..].to_vec();
    assert!(operations.len() > 20, "{}", operations.len());
    let (mut old, mut new) = (0, 0);
    for count in 1..=operations.len() {
        let flash = torn(&before, &operations[..count], count as u64);
        machine.start_with_flash(&flash).unwrap();
        machine.run_through(machine.now_us() + ANSWERS_US).unwrap();
        let found = host::calibration(&mut machine);
        if found == calibration(1) {
            old += 1;
        } else {
            assert_eq!(found, calibration(2), "cut at {count}");
            new += 1;
        }
    }
    machine.start_with_flash(&after).unwrap();
    machine.run_through(machine.now_us() + ANSWERS_US).unwrap();
    assert_eq!(host::calibration(&mut machine), calibration(2));
    println!(
        "emulated: power cut at {} operations of a calibration: {old} old, {new} new",
        operations.len()
    );
    assert!(old > 0);
}

/// Between two cuts; every write is cut in the long run.
fn stride() -> usize {
    if std::env::var_os("TONUS_FULL").is_some() {
        1
    } else {
        7
    }
}

#[test]
fn power_that_goes_at_any_write_of_a_model_leaves_the_old_or_the_new_whole() {
    let (first, second) = (Model::golden(), Model::other());
    let mut machine = started();
    models::upload(&mut machine, &first);
    assert_eq!(models::active(&mut machine), Some(first.hash()));
    let before = machine.flash().unwrap();
    let done = machine.flash_operations().len();
    models::upload(&mut machine, &second);
    assert_eq!(models::active(&mut machine), Some(second.hash()));
    let after = machine.flash().unwrap();
    let operations = machine.flash_operations()[done..].to_vec();
    // The model's words alone.
    assert!(operations.len() > first.words(), "{}", operations.len());
    let (mut old, mut new) = (0, 0);
    // The last ones change over: all of them.
    let last = operations.len().saturating_sub(20)..=operations.len();
    for count in (1..*last.start()).step_by(stride()).chain(last) {
        let flash = torn(&before, &operations[..count], count as u64);
        machine.start_with_flash(&flash).unwrap();
        machine.run_through(machine.now_us() + ANSWERS_US).unwrap();
        let active = models::active(&mut machine);
        if active == Some(first.hash()) {
            old += 1;
        } else {
            assert_eq!(active, Some(second.hash()), "cut at {count}");
            new += 1;
        }
    }
    println!(
        "emulated: power cut at {} of {} operations of a model: {old} old, {new} new",
        old + new,
        operations.len()
    );
    assert!(old > 0);
    machine.start_with_flash(&after).unwrap();
    machine.run_through(machine.now_us() + ANSWERS_US).unwrap();
    assert_eq!(models::active(&mut machine), Some(second.hash()));
}

/// Power goes in the middle of an operation as it is done, not as it is told afterwards.
#[test]
fn power_that_goes_while_a_calibration_is_kept_lets_the_image_start_again_with_the_old() {
    for operation in [0, 1, 10, 30] {
        let mut machine = started();
        keep(&mut machine, 1);
        machine.cut_power_at(operation);
        machine.send(&host::enclosed(2, Packet::Calibration(calibration(2))));
        let from_us = machine.now_us();
        let stop = machine.run_until(from_us + 300_000);
        assert_eq!(stop, Ok(Stop::Reset(Reset::Power)), "cut at {operation}");
        machine.run_through(machine.now_us() + ANSWERS_US).unwrap();
        assert_eq!(host::calibration(&mut machine), calibration(1));
        // And it can be kept then.
        keep(&mut machine, 3);
        assert_eq!(host::calibration(&mut machine), calibration(3));
    }
}

/// Over calibrating and receiving a model; interrupts nest into whatever is deepest by chance, so some room must stay.
#[test]
fn the_stack_has_room_to_spare() {
    let mut machine = Machine::new(image(), quiet()).unwrap();
    let before = machine.bytes(STACK.start, STACK.len()).unwrap();
    assert_eq!(machine.run_until(STARTED_US), Ok(Stop::Time));
    keep(&mut machine, 1);
    models::upload(&mut machine, &Model::golden());
    machine.run_through(machine.now_us() + 500_000).unwrap();
    let after = machine.bytes(STACK.start, STACK.len()).unwrap();
    let untouched = before
        .iter()
        .zip(&after)
        .take_while(|(one, other)| one == other);
    let untouched = untouched.count();
    println!(
        "emulated: {untouched} of {} bytes of the stack were never touched",
        STACK.len()
    );
    assert!(untouched > 8192, "{untouched}");
}

/// memory.x.
const STACK: std::ops::Range<u32> = 0x2000_0000..0x2001_0000;
