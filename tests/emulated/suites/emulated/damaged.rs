//! The image when it is reset, and when one of its functions does not do its work.

use tonus_emulated::chip::Reset;
use tonus_emulated::{Damage, MachineError, Stop};
use tonus_shared::wire::Frame;

use super::{STARTED_US, frames, frames_since, started};

/// What makes packets of scans; the compiler puts it into the task that calls it.
const SIGNAL_PATH: [&str; 2] = ["SignalPath", "push_scan"];

fn boot_ids(frames: &[(u64, Frame)]) -> Vec<u32> {
    let mut ids: Vec<u32> = frames
        .iter()
        .map(|(_, frame)| frame.header.boot_id)
        .collect();
    ids.dedup();
    ids
}

#[test]
fn the_image_starts_again_after_its_button_and_after_power_under_another_boot_id() {
    let mut machine = started();
    let first = boot_ids(&frames(&machine));
    machine.press_reset().unwrap();
    assert_eq!(machine.run_until(2 * STARTED_US), Ok(Stop::Time));
    let after_button = frames_since(&machine, STARTED_US);
    machine.cycle_power().unwrap();
    assert_eq!(machine.run_until(3 * STARTED_US), Ok(Stop::Time));
    let after_power = frames_since(&machine, 2 * STARTED_US);
    let ids = [first, boot_ids(&after_button), boot_ids(&after_power)].concat();
    let [first, second, third] = ids[..] else {
        panic!("one boot id each: {ids:?}");
    };
    assert!(first != second && second != third && first != third);
    for frames in [after_button, after_power] {
        assert_eq!(frames[0].1.header.sequence, 0);
    }
    assert_eq!(
        machine.resets(),
        [(STARTED_US, Reset::Pin), (2 * STARTED_US, Reset::Power)]
    );
    let bad = machine
        .log()
        .iter()
        .find(|line| line.starts_with("error") || line.contains("damaged"));
    assert_eq!(bad, None);
}

#[test]
fn a_function_that_hangs_ends_what_it_does_until_it_is_mended() {
    let mut machine = started();
    machine.damage(&SIGNAL_PATH, Damage::Hang).unwrap();
    assert_eq!(machine.run_until(2 * STARTED_US), Ok(Stop::Time));
    // What was under way may have come out.
    assert_eq!(frames_since(&machine, STARTED_US + 20_000).len(), 0);
    // A reset does not mend it.
    machine.press_reset().unwrap();
    assert_eq!(machine.run_until(3 * STARTED_US), Ok(Stop::Time));
    assert_eq!(frames_since(&machine, 2 * STARTED_US).len(), 0);
    machine.mend().unwrap();
    machine.press_reset().unwrap();
    assert_eq!(machine.run_until(4 * STARTED_US), Ok(Stop::Time));
    assert!(frames_since(&machine, 3 * STARTED_US).len() > 10);
}

#[test]
fn damage_is_undone_to_the_byte() {
    let mut machine = started();
    let before = machine.flash().unwrap();
    for damage in [Damage::Hang, Damage::Undefined, Damage::Panic] {
        machine.damage(&SIGNAL_PATH, damage).unwrap();
        assert_ne!(machine.flash().unwrap(), before);
    }
    machine.mend().unwrap();
    assert_eq!(machine.flash().unwrap(), before);
}

#[test]
fn an_undefined_instruction_ends_the_run_and_names_the_function() {
    let mut machine = started();
    // What hands packets to the transport: a function of its own.
    let names = machine.damage(&["signal_path", "leave"], Damage::Undefined);
    let names = names.unwrap();
    let Err(MachineError::Undefined { function, .. }) = machine.run_until(2 * STARTED_US) else {
        panic!("nothing happened: {:#?}", machine.log());
    };
    assert!(names.contains(&function), "{function}");
}

#[test]
fn a_function_that_is_not_there_cannot_be_damaged() {
    let mut machine = started();
    let parts = ["push_scan", "SignalPath"];
    assert_eq!(
        machine.damage(&parts, Damage::Hang),
        Err(MachineError::NoFunction {
            parts: parts.map(str::to_owned).to_vec()
        })
    );
}
