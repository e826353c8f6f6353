//! The wire protocol against bytes built outside Rust, and each refusal by name.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "test suite"
)]

use std::io::Write as _;
use std::process::{Command, Stdio};

use serde_json::{Value, json};
use tonus_shared::wire::{
    CRC_BYTES, Configuration, HEADER_BYTES, HandPosition, Inference, MAX_RAW_COUNTS, Muscle,
    Orientation, Packet, Ping, RawSemg, ResetReason, SkillPosterior, Status, StreamFlags, TABLE,
    decode,
};
use tonus_tests::frames::{HEADER, bytes_of, golden, golden_stream, quality};

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
        Packet::Status(Status {
            uptime_s: 3_600,
            battery_mv: Some(3_987),
            reset_reason: ResetReason::Watchdog,
            overruns: 1,
            gaps: 2,
            missed_scans: 30,
            refused: 4,
            dropped_packets: 5,
            quality: quality([0, 1, 2, 4, 8, 15, 0, 0]),
        }),
        Packet::Status(Status {
            uptime_s: 1,
            battery_mv: None,
            reset_reason: ResetReason::Unknown,
            overruns: 0,
            gaps: 0,
            missed_scans: 0,
            refused: 0,
            dropped_packets: 0,
            quality: quality([0; 8]),
        }),
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
            "quality": [0, 1, 2, 4, 8, 15, 0, 0]}),
        json!({"kind": "status", "uptime_s": 1, "battery_mv": null, "reset_reason": "unknown",
            "overruns": 0, "gaps": 0, "missed_scans": 0, "refused": 0, "dropped_packets": 0,
            "quality": [0, 0, 0, 0, 0, 0, 0, 0]}),
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
    assert_eq!(written, include_str!("../golden/wire_golden.txt"));
}

#[test]
fn the_decoder_in_the_docs_reads_the_golden_frames() {
    let source = include_str!("../../docs/wire_decode.py");
    assert!(source.lines().count() <= 40, "the page promises 40 lines");
    let hex: String = include_str!("../golden/wire_golden.txt")
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
    let page = include_str!("../../docs/wire.md");
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
    let page = include_str!("../../docs/wire.md");
    assert_eq!(documented_end(page), HEADER_BYTES + CRC_BYTES, "header");
    for row in TABLE {
        let title = format!("\n## {} {}\n", row.kind as u8, row.name);
        let (_, section) = page.split_once(&title).unwrap();
        assert_eq!(documented_end(section), row.payload_max, "{}", row.name);
    }
}

/// The golden frames show three flags; here each bit by itself must have the name that page and decoder give it.
#[test]
fn every_flag_and_reset_reason_has_its_documented_number() {
    let page = include_str!("../../docs/wire.md");
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
    let resets = [
        (ResetReason::Unknown, "unknown"),
        (ResetReason::PowerOn, "power_on"),
        (ResetReason::Pin, "pin"),
        (ResetReason::Watchdog, "watchdog"),
        (ResetReason::Software, "software"),
        (ResetReason::Lockup, "lockup"),
        (ResetReason::Wake, "wake"),
    ];
    let (mut lines, mut expected) = (String::new(), Vec::new());
    let mut send = |packet: &Packet, key: &'static str, value: Value| {
        for byte in bytes_of(&HEADER, packet).unwrap() {
            lines.push_str(&format!("{byte:02x}"));
        }
        lines.push('\n');
        expected.push((key, value));
    };
    for (flag, name) in flags {
        let row = format!("| {} | {name} |", flag.bits().trailing_zeros());
        assert!(page.contains(&row), "docs/wire.md lacks `{row}`");
        let Packet::Stream(mut stream) = golden_stream() else {
            unreachable!()
        };
        stream.flags = flag;
        send(&Packet::Stream(stream), "flags", json!([name]));
    }
    for (reset_reason, name) in resets {
        let told = format!("{} {}", reset_reason as u8, name.replace('_', " "));
        assert!(page.contains(&told), "docs/wire.md lacks `{told}`");
        let Some(Packet::Status(mut status)) = golden_packets().pop() else {
            unreachable!()
        };
        status.reset_reason = reset_reason;
        send(&Packet::Status(status), "reset_reason", json!(name));
    }
    let printed = python(&["../docs/wire_decode.py"], &lines);
    assert_eq!(printed.lines().count(), expected.len());
    for (line, (key, value)) in printed.lines().zip(expected) {
        assert_eq!(serde_json::from_str::<Value>(line).unwrap()[key], value);
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
