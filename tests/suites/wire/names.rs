//! Each flag and each reason by itself: the golden frames show a few of them, here every number must have the name that
//! page and decoder give it.

use serde_json::{Value, json};
use tonus_shared::wire::{Kind, Packet, Refusal, Reply, ResetReason, StatusFlags, StreamFlags};
use tonus_tests::frames::{HEADER, bytes_of, golden_stream};

use super::packets::golden_statuses;
use super::python;

const PAGE: &str = include_str!("../../../docs/wire.md");

fn told(row: &str) {
    assert!(PAGE.contains(row), "docs/wire.md lacks `{row}`");
}

/// The decoder prints each packet with this value under this key.
fn printed_so(sent: Vec<(Packet, &str, Value)>) {
    let mut lines = String::new();
    for (packet, _, _) in &sent {
        for byte in bytes_of(&HEADER, packet).unwrap() {
            lines.push_str(&format!("{byte:02x}"));
        }
        lines.push('\n');
    }
    let printed = python(&["../docs/wire_decode.py"], &lines);
    assert_eq!(printed.lines().count(), sent.len());
    for (line, (_, key, value)) in printed.lines().zip(sent) {
        assert_eq!(serde_json::from_str::<Value>(line).unwrap()[key], value);
    }
}

#[test]
fn every_flag_has_its_documented_number() {
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
    let mut sent = Vec::new();
    for (flag, name) in flags {
        told(&format!("| {} | {name} |", flag.bits().trailing_zeros()));
        let Packet::Stream(mut stream) = golden_stream() else {
            unreachable!()
        };
        stream.flags = flag;
        sent.push((Packet::Stream(stream), "flags", json!([name])));
    }
    for (flag, name) in problems {
        told(&format!("| {} | {name} |", flag.bits().trailing_zeros()));
        let mut status = golden_statuses()[1];
        status.flags = flag;
        sent.push((Packet::Status(status), "flags", json!([name])));
    }
    printed_so(sent);
}

#[test]
fn every_reason_has_its_documented_number() {
    let resets = [
        (ResetReason::Unknown, "unknown"),
        (ResetReason::PowerOn, "power_on"),
        (ResetReason::Pin, "pin"),
        (ResetReason::Watchdog, "watchdog"),
        (ResetReason::Software, "software"),
        (ResetReason::Lockup, "lockup"),
        (ResetReason::Wake, "wake"),
    ];
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
    let mut sent = Vec::new();
    for (reset_reason, name) in resets {
        told(&format!(
            "{} {}",
            reset_reason as u8,
            name.replace('_', " ")
        ));
        let mut status = golden_statuses()[1];
        status.reset_reason = reset_reason;
        sent.push((Packet::Status(status), "reset_reason", json!(name)));
    }
    for (refusal, name) in refusals {
        told(&format!("| {} | {name} |", refusal as u8));
        let reply = Reply {
            answered: Kind::Control,
            sequence: 1,
            outcome: Err(refusal),
            detail: 0,
        };
        sent.push((Packet::Reply(reply), "reason", json!(name)));
    }
    printed_so(sent);
}
