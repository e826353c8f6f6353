//! Every flag and every closed list by itself: its number on the page is the decoder's and the code's.

use serde_json::{Value, json};
use tonus_shared::wire::{
    Kind, Packet, Refusal, Reply, ResetReason, Status, StatusFlags, StreamFlags,
};
use tonus_tests::frames::{HEADER, bytes_of, golden_stream};

use super::{golden_statuses, python};

const PAGE: &str = include_str!("../../../docs/wire.md");

/// Frames to decode, and what the decoder should say of each under one key.
#[derive(Default)]
struct Sent {
    lines: String,
    expected: Vec<(&'static str, Value)>,
}

impl Sent {
    fn send(&mut self, packet: &Packet, key: &'static str, value: Value) {
        for byte in bytes_of(&HEADER, packet).unwrap() {
            self.lines.push_str(&format!("{byte:02x}"));
        }
        self.lines.push('\n');
        self.expected.push((key, value));
    }

    fn decoded_as_expected(self) {
        let printed = python(&["../docs/wire_decode.py"], &self.lines);
        assert_eq!(printed.lines().count(), self.expected.len());
        for (line, (key, value)) in printed.lines().zip(self.expected) {
            assert_eq!(serde_json::from_str::<Value>(line).unwrap()[key], value);
        }
    }
}

fn row(number: u32, name: &str) {
    let row = format!("| {number} | {name} |");
    assert!(PAGE.contains(&row), "docs/wire.md lacks `{row}`");
}

#[test]
fn flags_of_a_stream() {
    let flags = [
        (StreamFlags::HAND_SEEN, "hand_seen"),
        (StreamFlags::ORIENTATION_SEEN, "orientation_seen"),
        (StreamFlags::GAP, "gap"),
        (StreamFlags::POSTURE_CLAMPED, "posture_clamped"),
        (StreamFlags::STIFFNESS_HELD, "stiffness_held"),
        (StreamFlags::ACTIVATION_HELD, "activation_held"),
        (StreamFlags::BLENDING, "blending"),
        (StreamFlags::NEAR_SINGULAR, "near_singular"),
    ];
    let mut sent = Sent::default();
    for (flag, name) in flags {
        row(flag.bits().trailing_zeros(), name);
        let Packet::Stream(mut stream) = golden_stream() else {
            unreachable!()
        };
        stream.flags = flag;
        sent.send(&Packet::Stream(stream), "flags", json!([name]));
    }
    sent.decoded_as_expected();
}

#[test]
fn reasons_and_flags_of_a_status() {
    let resets = [
        (ResetReason::Unknown, "unknown"),
        (ResetReason::PowerOn, "power_on"),
        (ResetReason::Pin, "pin"),
        (ResetReason::Watchdog, "watchdog"),
        (ResetReason::Software, "software"),
        (ResetReason::Lockup, "lockup"),
        (ResetReason::Wake, "wake"),
    ];
    let problems = [
        (StatusFlags::LOW_BATTERY, "low_battery"),
        (StatusFlags::FRONT_END_FAILED, "front_end_failed"),
        (
            StatusFlags::ATTITUDE_SENSOR_FAILED,
            "attitude_sensor_failed",
        ),
        (StatusFlags::LAST_WORDS_WAIT, "last_words_wait"),
        (StatusFlags::NOT_CALIBRATED, "not_calibrated"),
        (StatusFlags::NO_MODEL, "no_model"),
    ];
    let (mut sent, [status, _]) = (Sent::default(), golden_statuses());
    for (reset_reason, name) in resets {
        let told = format!("{} {}", reset_reason as u8, name.replace('_', " "));
        assert!(PAGE.contains(&told), "docs/wire.md lacks `{told}`");
        let status = Status {
            reset_reason,
            ..status
        };
        sent.send(&Packet::Status(status), "reset_reason", json!(name));
    }
    for (flags, name) in problems {
        row(flags.bits().trailing_zeros(), name);
        let status = Status { flags, ..status };
        sent.send(&Packet::Status(status), "flags", json!([name]));
    }
    sent.decoded_as_expected();
}

#[test]
fn reasons_of_a_refusal() {
    let refusals = [
        (Refusal::Malformed, "malformed"),
        (Refusal::OutOfRange, "out_of_range"),
        (Refusal::WrongState, "wrong_state"),
        (Refusal::TooLarge, "too_large"),
        (Refusal::HashMismatch, "hash_mismatch"),
        (Refusal::WrongOffset, "wrong_offset"),
        (Refusal::StorageFailed, "storage_failed"),
        (Refusal::NotFitting, "not_fitting"),
        (Refusal::Busy, "busy"),
    ];
    let mut sent = Sent::default();
    for (refusal, name) in refusals {
        row(refusal as u32, name);
        let reply = Reply {
            answered: Kind::Control,
            sequence: 1,
            outcome: Err(refusal),
            detail: 0,
        };
        sent.send(&Packet::Reply(reply), "reason", json!(name));
    }
    sent.decoded_as_expected();
}
