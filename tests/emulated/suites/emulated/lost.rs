//! What outlives a task that hangs and a panic.

use tonus_emulated::chip::Reset;
use tonus_emulated::{Damage, Machine, Stop};
use tonus_shared::wire::{ResetReason, StatusFlags};

use super::{STARTED_US, frames_since, host, last_status, started};

/// Longer than the watchdog's time.
const LONG_US: u64 = 6_000_000;
/// A function of each task that has a handle of the watchdog: what runs in every turn of it.
const TASKS: [(&str, &[&str]); 6] = [
    ("acquisition", &["EdgeClock", "edge"]),
    ("signal path", &["SignalPath", "push_scan"]),
    ("attitude", &["tonus_firmware", "imu", "sample"]),
    ("keeper", &["tonus_firmware", "keeper", "run"]),
    ("recognition", &["tonus_firmware", "recognition", "serve"]),
    ("transport", &["tonus_firmware", "wired"]),
];

/// Mends the machine, lets it start again, and gives the time at which it did.
fn restarted(machine: &mut Machine) -> u64 {
    machine.mend().unwrap();
    let from_us = machine.now_us();
    assert_eq!(
        machine.run_until(from_us + STARTED_US + 500_000),
        Ok(Stop::Time)
    );
    from_us
}

#[test]
fn a_task_that_hangs_is_ended_by_the_watchdog_and_the_next_start_says_so() {
    for (task, function) in TASKS {
        let mut machine = started();
        machine.damage(function, Damage::Hang).unwrap();
        assert_eq!(
            machine.run_until(STARTED_US + LONG_US),
            Ok(Stop::Reset(Reset::Watchdog)),
            "{task}"
        );
        let from_us = restarted(&mut machine);
        let status = last_status(&frames_since(&machine, from_us));
        assert_eq!(status.reset_reason, ResetReason::Watchdog, "{task}");
    }
}

#[test]
fn a_panic_restarts_the_chip_and_its_message_can_be_read_after_it_once() {
    let mut machine = started();
    let place = machine.image().panic_place().unwrap();
    machine
        .damage(&["SignalPath", "push_scan"], Damage::Panic)
        .unwrap();
    assert_eq!(
        machine.run_until(STARTED_US + LONG_US),
        Ok(Stop::Reset(Reset::Software))
    );
    let from_us = restarted(&mut machine);
    let status = last_status(&frames_since(&machine, from_us));
    assert_eq!(status.reset_reason, ResetReason::Software);
    assert!(status.flags.contains(StatusFlags::LAST_WORDS_WAIT));
    let words = host::last_words(&mut machine);
    assert!(
        words.contains(&format!("panicked at {}", place.text)),
        "{words}"
    );
    // After the next start there are none.
    machine.press_reset().unwrap();
    let from_us = restarted(&mut machine);
    let status = last_status(&frames_since(&machine, from_us));
    assert_eq!(status.reset_reason, ResetReason::Pin);
    assert!(!status.flags.contains(StatusFlags::LAST_WORDS_WAIT));
    assert_eq!(host::last_words(&mut machine), "");
}

#[test]
fn a_hard_fault_is_a_panic_that_names_the_instruction() {
    let mut machine = started();
    machine.serve_faults();
    let function = ["SignalPath", "push_scan"];
    let places = machine.image().functions_named(&function).unwrap();
    machine.damage(&function, Damage::Undefined).unwrap();
    assert_eq!(
        machine.run_until(STARTED_US + LONG_US),
        Ok(Stop::Reset(Reset::Software))
    );
    restarted(&mut machine);
    let words = host::last_words(&mut machine);
    let named = places
        .iter()
        .any(|place| words.contains(&format!("hard fault at {:#010x}", place.start)));
    assert!(named, "{words}");
}

#[test]
fn what_ram_holds_after_power_came_is_no_message() {
    let mut machine = started();
    for _ in 0..3 {
        machine.cycle_power().unwrap();
        let from_us = restarted(&mut machine);
        let status = last_status(&frames_since(&machine, from_us));
        assert_eq!(status.reset_reason, ResetReason::PowerOn);
        assert!(!status.flags.contains(StatusFlags::LAST_WORDS_WAIT));
    }
}
