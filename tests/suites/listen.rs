//! `tonus listen` on a pseudo-terminal, as on a board's serial port.
#![allow(clippy::unwrap_used, clippy::panic, reason = "test suite")]

use std::io::{BufRead as _, BufReader, Read as _};
use std::os::fd::AsRawFd;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use serde_json::Value;
use serial2::SerialPort;
use tonus_shared::wire::cobs::{MAX_BLOCK_BYTES, enclose};
use tonus_tests::frames::{HEADER, bytes_of, golden_stream};

/// The wearable's end of a line, the host's (which must stay open until the program has it), and its name.
fn line() -> (SerialPort, SerialPort, PathBuf) {
    let (wearable, host) = SerialPort::pair().unwrap();
    let name = std::fs::read_link(format!("/proc/self/fd/{}", host.as_raw_fd())).unwrap();
    (wearable, host, name)
}

/// The block of a stream packet with this number.
fn block(sequence: u32) -> Vec<u8> {
    let mut header = HEADER;
    header.sequence = sequence;
    let frame = bytes_of(&header, &golden_stream()).unwrap();
    let mut block = [0; MAX_BLOCK_BYTES];
    let length = enclose(&frame, &mut block).unwrap();
    block[..length].to_vec()
}

/// Starts the program on a line.
fn listening(name: &Path, arguments: &[&str]) -> Child {
    Command::new(tonus_tests::program())
        .args(["listen", "--link", &format!("serial:{}", name.display())])
        .args(arguments)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

/// What it prints of bytes that wait on the line.
fn printed(bytes: &[u8], arguments: &[&str]) -> String {
    let (wearable, _host, name) = line();
    wearable.write_all(bytes).unwrap();
    let output = listening(&name, arguments).wait_with_output().unwrap();
    assert!(output.status.success(), "{output:?}");
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn packets_and_losses_are_printed() {
    let mut changed = block(4);
    changed[30] ^= 1;
    let bytes = [block(1), block(2), block(5), changed, block(6)].concat();
    let text = printed(&bytes, &["--seconds", "1.5", "--json"]);
    let lines: Vec<Value> = text
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    let sequences: Vec<u64> = lines
        .iter()
        .filter_map(|line| line["sequence"].as_u64())
        .collect();
    assert_eq!(sequences, [1, 2, 5, 6]);
    assert_eq!(lines[0]["kind"], "stream");
    let counts = &lines.last().unwrap()["counts"];
    assert_eq!(
        (&counts["received"], &counts["lost"], &counts["refused"]),
        (&4.into(), &2.into(), &1.into())
    );
}

#[test]
fn people_get_a_line_for_each_packet_and_a_summary() {
    let text = printed(&[block(1), block(3)].concat(), &["--seconds", "1.5"]);
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines.len(), 3, "{text}");
    assert!(
        lines[0].contains("stream") && lines[0].contains("N/m"),
        "{text}"
    );
    assert!(lines[2].starts_with("2 packets, 1 lost"), "{text}");
}

#[test]
fn an_unplugged_board_ends_it_with_an_error_behind_the_counts() {
    let (wearable, host, name) = line();
    let mut program = listening(&name, &[]);
    let mut output = BufReader::new(program.stdout.take().unwrap());
    let mut packet = String::new();
    // The program has the line when the first packet comes out.
    wearable.write_all(&block(1)).unwrap();
    output.read_line(&mut packet).unwrap();
    drop((wearable, host));
    let mut rest = String::new();
    output.read_to_string(&mut rest).unwrap();
    let ended = program.wait_with_output().unwrap();
    assert_eq!(ended.status.code(), Some(1));
    assert!(rest.starts_with("1 packets, 0 lost"), "{rest}");
    let errors = String::from_utf8(ended.stderr).unwrap();
    assert!(errors.contains("unplugged"), "{errors}");
}

#[test]
fn a_link_that_makes_no_sense_is_refused() {
    for link in ["serial:", "ble:1", "/dev/ttyACM0"] {
        let output = Command::new(tonus_tests::program())
            .args(["listen", "--link", link])
            .output()
            .unwrap();
        assert_eq!(output.status.code(), Some(2), "{link}");
    }
}
