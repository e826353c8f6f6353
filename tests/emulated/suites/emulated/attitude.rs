//! What becomes of attitudes when their sensor fails.

use tonus_emulated::device::lsm6dso::Lsm6dso;
use tonus_emulated::{Machine, Stop};
use tonus_shared::wire::{Control, Frame, Packet, Refusal, StatusFlags, StreamFlags};

use super::host::ask;
use super::{AT_REST, frames_since, last_status, started};

fn sensor(machine: &mut Machine) -> &mut Lsm6dso {
    machine.world_mut().unwrap().imu.as_mut().unwrap()
}

fn attitudes(frames: &[(u64, Frame)]) -> usize {
    let attitude = |(_, frame): &&(u64, Frame)| matches!(frame.packet, Packet::Orientation(_));
    frames.iter().filter(attitude).count()
}

fn streams(frames: &[(u64, Frame)]) -> usize {
    let stream = |(_, frame): &&(u64, Frame)| matches!(frame.packet, Packet::Stream(_));
    frames.iter().filter(stream).count()
}

/// Runs for six seconds, longer than the watchdog's time, and gives what came in the last four of them.
fn after_a_while(machine: &mut Machine) -> Vec<(u64, Frame)> {
    let from_us = machine.now_us();
    assert_eq!(machine.run_until(from_us + 6_000_000), Ok(Stop::Time));
    // A status comes each second.
    let frames = frames_since(machine, 0);
    let late = frames.into_iter();
    late.filter(|(at_us, _)| *at_us > from_us + 2_000_000)
        .collect()
}

/// Breaks the sensor, mends it, and asserts that scans go on, that the status tells, and that attitudes come back.
fn fails(breaks: impl Fn(&mut Lsm6dso, bool)) {
    let mut machine = started();
    breaks(sensor(&mut machine), true);
    let frames = after_a_while(&mut machine);
    assert_eq!(attitudes(&frames), 0);
    assert!(streams(&frames) > 390, "{}", streams(&frames));
    let status = last_status(&frames);
    assert!(status.flags.contains(StatusFlags::ATTITUDE_SENSOR_FAILED));
    assert_eq!((status.gaps, status.overruns), (0, 0));
    breaks(sensor(&mut machine), false);
    let frames = after_a_while(&mut machine);
    // It is left alone for a while before it is tried again.
    assert!(attitudes(&frames) > 200, "{}", attitudes(&frames));
    let flags = last_status(&frames).flags;
    assert!(!flags.contains(StatusFlags::ATTITUDE_SENSOR_FAILED));
}

#[test]
fn a_sensor_that_is_gone_is_told_and_taken_up_again() {
    fails(|sensor, broken| sensor.absent = broken);
}

#[test]
fn a_sensor_that_measures_nothing_new_is_told_and_taken_up_again() {
    fails(|sensor, broken| sensor.frozen = broken);
}

#[test]
fn a_sensor_that_holds_the_clock_is_told_and_taken_up_again() {
    fails(|sensor, broken| sensor.stalls = broken);
}

/// Whether the newest stream packet rests on the attitude.
fn counts(machine: &mut Machine) -> bool {
    let from_us = machine.now_us();
    assert_eq!(machine.run_until(from_us + 200_000), Ok(Stop::Time));
    let newest =
        frames_since(machine, from_us)
            .into_iter()
            .rev()
            .find_map(|(_, frame)| match frame.packet {
                Packet::Stream(stream) => Some(stream.flags),
                _ => None,
            });
    newest.unwrap().contains(StreamFlags::ORIENTATION_SEEN)
}

#[test]
fn an_attitude_counts_once_a_hanging_arm_was_told_to_face_forward() {
    let face = || Packet::Control(Control::FaceForward);
    let mut machine = started();
    // Lying: gravity along the arm's x axis; VQF takes some seconds to believe it.
    sensor(&mut machine).measure([0, 0, 0, AT_REST[5], 0, 0]);
    let until_us = machine.now_us() + 12_000_000;
    assert_eq!(machine.run_until(until_us), Ok(Stop::Time));
    let (outcome, _) = ask(&mut machine, 1, face()).expect("an answer");
    assert_eq!(outcome, Err(Refusal::OutOfRange));
    assert!(!counts(&mut machine));
    sensor(&mut machine).measure(AT_REST);
    let until_us = machine.now_us() + 12_000_000;
    assert_eq!(machine.run_until(until_us), Ok(Stop::Time));
    assert!(!counts(&mut machine));
    let (outcome, _) = ask(&mut machine, 2, face()).expect("an answer");
    assert_eq!(outcome, Ok(()));
    assert!(counts(&mut machine));
    sensor(&mut machine).absent = true;
    let until_us = machine.now_us() + 1_000_000;
    assert_eq!(machine.run_until(until_us), Ok(Stop::Time));
    let (outcome, _) = ask(&mut machine, 3, face()).expect("an answer");
    assert_eq!(outcome, Err(Refusal::WrongState));
    assert!(!counts(&mut machine));
}
