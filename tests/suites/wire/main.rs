//! The wire protocol against bytes built outside Rust, and each refusal by name.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "test suite"
)]

use std::io::Write as _;
use std::process::{Command, Stdio};

use serde_json::Value;
use tonus_shared::wire::{
    CRC_BYTES, HEADER_BYTES, Kind, MAX_LAST_WORDS_BYTES, MAX_PIECE_BYTES, MAX_RAW_COUNTS, TABLE,
    decode,
};
use tonus_tests::frames::{HEADER, bytes_of, golden};

use packets::golden_packets;
use printed::golden_json;

mod names;
mod packets;
mod printed;

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
