//! The wire protocol against bytes built outside Rust, and each refusal by name.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "test suite"
)]

mod names;

use std::io::Write as _;
use std::process::{Command, Stdio};

use serde_json::{Value, json};
use tonus_shared::wire::{
    CRC_BYTES, Configuration, HEADER_BYTES, HandPosition, Inference, Kind, MAX_LAST_WORDS_BYTES,
    MAX_PIECE_BYTES, MAX_RAW_COUNTS, Muscle, Orientation, Packet, Ping, RawSemg, ResetReason,
    SkillPosterior, Status, StatusFlags, TABLE, decode,
};
use tonus_tests::frames::{
    HEADER, bytes_of, golden, golden_calibrations, golden_management, golden_stream, quality,
};

/// The packets that the golden script wrote, in its order.
fn golden_packets() -> Vec<Packet> {
    let [first, second] = golden_configurations().map(Packet::Configuration);
    vec![
        first,
        second,
        golden_stream(),
        Packet::RawSemg(RawSemg {
            first_index: 0xFFFF_FFFE,
            channels: 3,
            counts: [0, 1, -1, 8_388_607, -8_388_608, 1_000]
                .into_iter()
                .collect(),
        }),
        Packet::RawSemg(RawSemg {
            first_index: 9,
            channels: 8,
            counts: (0..72).map(|n| 1_000 * n - 36_000).collect(),
        }),
        Packet::Orientation(Orientation {
            xyzw: [0.5, -0.5, 0.5, -0.5],
        }),
        Packet::HandPosition(HandPosition {
            position_m: Some([0.25, -0.4, 0.125]),
        }),
        Packet::HandPosition(HandPosition { position_m: None }),
        Packet::Ping(Ping::Request {
            id: 77,
            requested_us: 123_456_789_012,
        }),
        Packet::Ping(Ping::Reply {
            id: 77,
            requested_us: 123_456_789_012,
            received_us: 5_000_000,
            replied_us: 5_000_250,
        }),
        golden_inference(),
    ]
    .into_iter()
    .chain(golden_statuses().map(Packet::Status))
    .chain(golden_management())
    .collect()
}

fn golden_statuses() -> [Status; 2] {
    [
        Status {
            uptime_s: 3_600,
            battery_mv: Some(3_987),
            reset_reason: ResetReason::Watchdog,
            overruns: 1,
            gaps: 2,
            missed_scans: 30,
            refused: 4,
            dropped_packets: 5,
            quality: quality([0, 1, 2, 4, 8, 15, 0, 0]),
            flags: StatusFlags::LOW_BATTERY
                .with(StatusFlags::LAST_WORDS_WAIT, true)
                .with(StatusFlags::FRONT_END_FAILED, false)
                .with(StatusFlags::NO_MODEL, true),
            dropped_hypotheses: 70_000,
            refused_requests: 8,
            links: 513,
            lost_reports: 9,
        },
        Status {
            uptime_s: 1,
            battery_mv: None,
            reset_reason: ResetReason::Unknown,
            overruns: 0,
            gaps: 0,
            missed_scans: 0,
            refused: 0,
            dropped_packets: 0,
            quality: quality([0; 8]),
            flags: StatusFlags::default(),
            dropped_hypotheses: 0,
            refused_requests: 0,
            links: 0,
            lost_reports: 0,
        },
    ]
}

fn golden_configurations() -> [Configuration; 2] {
    use Muscle::{Absent, BicepsLong, BicepsShort, Other, TricepsLateral, TricepsLong};
    [
        Configuration {
            semg_hz: 1111.11,
            stream_hz: 100.0,
            volts_per_count: 2.5e-6,
            offset_counts: -7,
            chain_delay_us: 63_500,
            channels: 4,
            muscles: [
                BicepsShort,
                BicepsLong,
                TricepsLateral,
                TricepsLong,
                Absent,
                Absent,
                Absent,
                Absent,
            ],
            mains_hz: Some(50),
            raw: true,
            firmware_hash: [0xA0, 0xA1, 0xA2, 0xA3, 0xA4, 0xA5, 0xA6, 0xA7],
        },
        Configuration {
            semg_hz: 200.0,
            stream_hz: 100.0,
            volts_per_count: 1.0,
            offset_counts: 0,
            chain_delay_us: 85_000,
            channels: 8,
            muscles: [
                Other,
                Other,
                Other,
                Other,
                BicepsShort,
                BicepsLong,
                TricepsLateral,
                TricepsLong,
            ],
            mains_hz: None,
            raw: false,
            firmware_hash: [0; 8],
        },
    ]
}

fn golden_inference() -> Packet {
    let top = [(2, -0.0625), (0, -2.75)].map(|(skill, log_posterior)| SkillPosterior {
        skill,
        log_posterior,
    });
    Packet::Inference(Inference {
        skills: 3,
        top: top.into_iter().collect(),
        phase: 0.375,
        stiffness_n_per_m: [410.0, 380.5, 120.25],
    })
}

/// What `docs/wire_decode.py` must print for each golden frame, header aside.
fn golden_json() -> Vec<Value> {
    let exact = |value: f32| Value::from(f64::from(value));
    vec![
        json!({"kind": "configuration", "semg_hz": exact(1111.11), "stream_hz": 100.0,
            "volts_per_count": exact(2.5e-6), "offset_counts": -7, "chain_delay_us": 63_500,
            "muscles": ["biceps_short", "biceps_long", "triceps_lateral", "triceps_long"],
            "mains_hz": 50, "raw": true, "firmware_hash": "a0a1a2a3a4a5a6a7"}),
        json!({"kind": "configuration", "semg_hz": 200.0, "stream_hz": 100.0,
            "volts_per_count": 1.0, "offset_counts": 0, "chain_delay_us": 85_000,
            "muscles": ["other", "other", "other", "other",
                "biceps_short", "biceps_long", "triceps_lateral", "triceps_long"],
            "mains_hz": null, "raw": false, "firmware_hash": "0000000000000000"}),
        json!({"kind": "stream", "describes_us": 1_108_152_157_446_u64 - 78_500,
            "envelopes": [exact(0.1), 0.25, exact(0.001), 1.0], "activation": 0.5,
            "co_contraction": 1.75, "stiffness_n_per_m": [310.5, 222.25, 95.125],
            "quality": [0, 1, 2, 0], "flags": ["hand_seen", "gap", "near_singular"]}),
        json!({"kind": "raw_semg", "first_index": 4_294_967_294_u32,
            "scans": [[0, 1, -1], [8_388_607, -8_388_608, 1_000]]}),
        json!({"kind": "raw_semg", "first_index": 9, "scans": (0..9)
            .map(|scan| (0..8).map(|at| 1_000 * (8 * scan + at) - 36_000).collect())
            .collect::<Vec<Vec<i32>>>()}),
        json!({"kind": "orientation", "xyzw": [0.5, -0.5, 0.5, -0.5]}),
        json!({"kind": "hand_position", "position_m": [0.25, exact(-0.4), 0.125]}),
        json!({"kind": "hand_position", "position_m": null}),
        json!({"kind": "ping", "role": "request", "id": 77, "requested_us": 123_456_789_012_u64}),
        json!({"kind": "ping", "role": "reply", "id": 77, "requested_us": 123_456_789_012_u64,
            "received_us": 5_000_000, "replied_us": 5_000_250}),
        json!({"kind": "inference", "skills": 3, "top": [[2, -0.0625], [0, -2.75]], "phase": 0.375,
            "stiffness_n_per_m": [410.0, 380.5, 120.25]}),
        json!({"kind": "status", "uptime_s": 3_600, "battery_mv": 3_987, "reset_reason": "watchdog",
            "overruns": 1, "gaps": 2, "missed_scans": 30, "refused": 4, "dropped_packets": 5,
            "quality": [0, 1, 2, 4, 8, 15, 0, 0],
            "flags": ["low_battery", "last_words_wait", "no_model"], "dropped_hypotheses": 70_000,
            "refused_requests": 8, "links": 513, "lost_reports": 9}),
        json!({"kind": "status", "uptime_s": 1, "battery_mv": null, "reset_reason": "unknown",
            "overruns": 0, "gaps": 0, "missed_scans": 0, "refused": 0, "dropped_packets": 0,
            "quality": [0, 0, 0, 0, 0, 0, 0, 0], "flags": [], "dropped_hypotheses": 0,
            "refused_requests": 0, "links": 0, "lost_reports": 0}),
    ]
    .into_iter()
    .chain(golden_management_json())
    .collect()
}

/// The same for the packets that set the wearable up.
fn golden_management_json() -> Vec<Value> {
    let exact = |value: f32| Value::from(f64::from(value));
    let levels = |values: [f32; 4]| values.map(exact);
    let bytes_hex = |bytes: std::ops::Range<u8>| bytes.map(|byte| format!("{byte:02x}"));
    let [first, second] = golden_calibrations();
    vec![
        json!({"kind": "control", "command": "raw", "value": 1}),
        json!({"kind": "control", "command": "send_calibration", "value": 0}),
        json!({"kind": "control", "command": "send_model_state", "value": 0}),
        json!({"kind": "control", "command": "restart", "value": 0xFEDC_BA98_u32}),
        json!({"kind": "control", "command": "send_last_words", "value": 0}),
        json!({"kind": "calibration", "revision": first.revision,
            "muscles": ["biceps_short", "biceps_long", "triceps_lateral", "triceps_long"],
            "mains_hz": 60, "semg_hz": 1000.0, "rest_v": levels([1e-5, 2e-5, 0.0, 4e-6]),
            "mvc_v": levels([5e-4, 6e-4, 7e-4, 8e-4]), "activation_window_s": exact(0.025), "l1": 0.75, "l2": 1.5,
            "rest_stiffness_nm_per_rad": [13.0, 13.5, 12.0, 11.5], "body_mass_kg": 62.5, "body_height_m": 1.625}),
        json!({"kind": "calibration", "revision": second.revision,
            "muscles": ["other", "other", "biceps_short", "biceps_short", "biceps_long", "triceps_lateral",
                "triceps_long", "triceps_long"],
            "mains_hz": null, "semg_hz": 2000.0, "rest_v": vec![0.125; 8], "mvc_v": vec![1.0; 8],
            "activation_window_s": 0.5, "l1": 0.0, "l2": 2.25,
            "rest_stiffness_nm_per_rad": [1.0, 2.0, 3.0, 4.0], "body_mass_kg": 20.0, "body_height_m": 2.5}),
        json!({"kind": "model_upload", "step": "begin", "total_bytes": 90_001,
            "sha256": bytes_hex(0x40..0x60).collect::<String>()}),
        json!({"kind": "model_upload", "step": "piece", "offset_bytes": 66_288, "bytes": "0001feff80"}),
        json!({"kind": "model_upload", "step": "piece", "offset_bytes": 0,
            "bytes": bytes_hex(0..216).collect::<String>()}),
        json!({"kind": "model_upload", "step": "finish"}),
        json!({"kind": "model_upload", "step": "abandon"}),
        json!({"kind": "model_state", "active": {"hash": "0102030405060708", "skills": 3, "dofs": 12,
                "functions": 30, "rank": 16},
            "receiving": {"hash": "8182838485868788", "received_bytes": 4_320, "total_bytes": 90_001},
            "capacity_bytes": 163_840}),
        json!({"kind": "model_state", "active": null, "receiving": null, "capacity_bytes": 163_840}),
        json!({"kind": "reply", "answered": "model_upload", "answered_sequence": 0x0506_0708, "outcome": "done",
            "reason": null, "detail": 4_320}),
        json!({"kind": "reply", "answered": "calibration", "answered_sequence": 7, "outcome": "refused",
            "reason": "out_of_range", "detail": 0}),
        json!({"kind": "last_words", "words": "main.rs:7: Größe 3 > 2 ⚠"}),
        json!({"kind": "last_words", "words": "x".repeat(128)}),
        json!({"kind": "last_words", "words": ""}),
    ]
}

#[test]
fn every_packet_has_the_bytes_that_python_built() {
    let golden = golden();
    let packets = golden_packets();
    assert_eq!(golden.len(), packets.len());
    for ((name, bytes), packet) in golden.iter().zip(&packets) {
        assert_eq!(&bytes_of(&HEADER, packet).unwrap(), bytes, "{name}");
        let frame = decode(bytes).unwrap();
        assert_eq!((frame.header, &frame.packet), (HEADER, packet), "{name}");
    }
    for row in TABLE {
        let shown = packets.iter().any(|packet| packet.kind() == row.kind);
        assert!(shown, "{} has no golden frame", row.name);
    }
}

/// Runs Python with these arguments and this input; a machine without Python fails here.
fn python(arguments: &[&str], input: &str) -> String {
    let mut child = Command::new("python3")
        .args(arguments)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("python3 must be installed: the decoder in docs/ is part of the protocol");
    let mut stdin = child.stdin.take().unwrap();
    stdin.write_all(input.as_bytes()).unwrap();
    drop(stdin);
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success(), "python3 {arguments:?} failed");
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn the_golden_file_is_what_its_script_writes() {
    let written = python(&["golden/wire_golden.py"], "");
    assert_eq!(written, include_str!("../../golden/wire_golden.txt"));
}

#[test]
fn the_decoder_in_the_docs_reads_the_golden_frames() {
    let source = include_str!("../../../docs/wire_decode.py");
    assert!(source.lines().count() <= 60, "the page promises 60 lines");
    let hex: String = include_str!("../../golden/wire_golden.txt")
        .lines()
        .map(|line| format!("{}\n", line.split_once(' ').unwrap().1))
        .collect();
    let printed = python(&["../docs/wire_decode.py"], &hex);
    let expected = golden_json();
    assert_eq!(printed.lines().count(), expected.len());
    for (line, mut expected) in printed.lines().zip(expected) {
        expected["boot_id"] = HEADER.boot_id.into();
        expected["sequence"] = HEADER.sequence.into();
        expected["device_us"] = HEADER.device_us.into();
        assert_eq!(serde_json::from_str::<Value>(line).unwrap(), expected);
    }
}

#[test]
fn the_page_names_every_size() {
    let page = include_str!("../../../docs/wire.md");
    for row in TABLE {
        let [min, max] = [row.payload_min, row.payload_max].map(|payload| payload + 22);
        let bytes = if min == max {
            format!("{min}")
        } else {
            format!("{min} to {max}")
        };
        let line = format!("| {} | {} | {bytes} |", row.kind as u8, row.name);
        assert!(page.contains(&line), "docs/wire.md lacks `{line}`");
    }
}

/// Bytes of a field of the page's tables; a list of counts is as long as the packet holds.
fn field_bytes(kind: &str) -> usize {
    match kind {
        "u8" => 1,
        "u16" => 2,
        "u32" | "i32" | "f32" => 4,
        "u64" => 8,
        "i24 each" => 3 * MAX_RAW_COUNTS,
        "8 bytes" => 8,
        "32 bytes" => 32,
        "1 to 216 bytes" => MAX_PIECE_BYTES,
        "0 to 128 bytes" => MAX_LAST_WORDS_BYTES,
        "4 x (u8, f32)" => 4 * (1 + 4),
        list => {
            let (count, each) = list
                .split_once(" x ")
                .unwrap_or_else(|| panic!("`{list}`?"));
            count.parse::<usize>().unwrap() * field_bytes(each)
        }
    }
}

/// Where the fields of one section of the page end, each beginning where the last ended.
fn documented_end(section: &str) -> usize {
    let rows = section
        .lines()
        .skip_while(|line| !line.starts_with("| byte | field | type |"))
        .skip(2)
        .take_while(|line| line.starts_with('|'))
        .map(|line| line.split('|').map(str::trim).collect::<Vec<_>>());
    rows.filter(|row| !row[3].is_empty()).fold(0, |end, row| {
        let at = row[1]
            .strip_prefix("end - ")
            .map_or_else(|| row[1].parse(), |_| Ok(end));
        assert_eq!(
            at,
            Ok(end),
            "`{}` does not follow the field before it",
            row[2]
        );
        end + field_bytes(row[3])
    })
}

#[test]
fn the_page_describes_every_byte() {
    let page = include_str!("../../../docs/wire.md");
    assert_eq!(documented_end(page), HEADER_BYTES + CRC_BYTES, "header");
    for row in TABLE {
        let title = format!("\n## {} {}\n", row.kind as u8, row.name);
        let (_, section) = page.split_once(&title).unwrap();
        assert_eq!(documented_end(section), row.payload_max, "{}", row.name);
        if row.kind == Kind::ModelUpload {
            let (_, begin) = section.split_once("The beginning, ").unwrap();
            let (_, end) = begin.split_once("The end, ").unwrap();
            assert_eq!([documented_end(begin), documented_end(end)], [37, 1]);
        }
    }
}

#[test]
fn every_single_bit_flip_is_refused() {
    for (name, bytes) in golden() {
        for bit in 0..8 * bytes.len() {
            let mut flipped = bytes.clone();
            flipped[bit / 8] ^= 1 << (bit % 8);
            assert!(decode(&flipped).is_err(), "{name}: bit {bit}");
        }
    }
}

#[test]
fn every_truncation_and_extension_is_refused() {
    for (name, bytes) in golden() {
        for length in 0..bytes.len() {
            assert!(decode(&bytes[..length]).is_err(), "{name}: {length} bytes");
        }
        let mut longer = bytes.clone();
        longer.push(0);
        assert!(decode(&longer).is_err(), "{name}: a byte too many");
    }
}
