//! `tonus listen` on a pseudo-terminal, as on a board's serial port.
#![allow(clippy::unwrap_used, clippy::panic, reason = "test suite")]

use std::io::{BufRead as _, BufReader, ErrorKind, Read as _};
use std::os::fd::AsRawFd;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;
use serial2::SerialPort;
use tonus_shared::wire::cobs::{MAX_BLOCK_BYTES, Unframer, enclose};
use tonus_shared::wire::{Frame, Packet, Ping, decode};
use tonus_tests::frames::{HEADER, bytes_of, golden_stream};

/// The wearable's end of a line, the host's (which must stay open until the program has it), and its name.
fn line() -> (SerialPort, SerialPort, PathBuf) {
    let (wearable, host) = SerialPort::pair().unwrap();
    let name = std::fs::read_link(format!("/proc/self/fd/{}", host.as_raw_fd())).unwrap();
    (wearable, host, name)
}

/// The block of a stream packet with this number.
fn block(sequence: u32) -> Vec<u8> {
    block_at(sequence, HEADER.device_us, &golden_stream())
}

/// The block of any packet, sent at this time of the wearable's clock.
fn block_at(sequence: u32, device_us: u64, packet: &Packet) -> Vec<u8> {
    let mut header = HEADER;
    (header.sequence, header.device_us) = (sequence, device_us);
    let frame = bytes_of(&header, packet).unwrap();
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

/// A wearable whose clock began `AHEAD_US` before the test: a packet each 10 ms and an answer to each ping, which it keeps
/// for 2 ms, until the line is closed.
fn answering(wearable: &SerialPort, began: Instant) -> u32 {
    let now_us = || AHEAD_US + u64::try_from(began.elapsed().as_micros()).unwrap();
    let (mut unframer, mut answered, mut piece) = (<Unframer>::new(), 0, [0; 512]);
    for sequence in 0.. {
        let packet = block_at(2 * sequence, now_us(), &golden_stream());
        if wearable.write_all(&packet).is_err() {
            break;
        }
        let came = match wearable.read(&mut piece) {
            Err(error) if error.kind() == ErrorKind::TimedOut => continue,
            Err(_) => break,
            Ok(came) => came,
        };
        for byte in &piece[..came] {
            let Ok(Some(frame)) = unframer.push(*byte) else {
                continue;
            };
            let Ok(Frame {
                packet: Packet::Ping(Ping::Request { id, requested_us }),
                ..
            }) = decode(frame)
            else {
                panic!("not a ping: {frame:?}");
            };
            let received_us = now_us();
            std::thread::sleep(Duration::from_millis(2));
            let replied_us = now_us();
            let reply = Ping::Reply {
                id,
                requested_us,
                received_us,
                replied_us,
            };
            let reply = block_at(2 * sequence + 1, replied_us, &Packet::Ping(reply));
            answered += u32::from(wearable.write_all(&reply).is_ok());
        }
    }
    answered
}

const AHEAD_US: u64 = 5_000_000_000;

#[test]
fn the_clocks_are_compared_when_asked_for() {
    let (mut wearable, host, name) = line();
    wearable
        .set_read_timeout(Duration::from_millis(10))
        .unwrap();
    let began = Instant::now();
    let mut program = listening(&name, &["--clock", "--json", "--seconds", "3"]);
    let wearer = std::thread::spawn(move || answering(&wearable, began));
    let mut output = String::new();
    let mut printed = program.stdout.take().unwrap();
    printed.read_to_string(&mut output).unwrap();
    assert!(program.wait().unwrap().success());
    let lasted_us = began.elapsed().as_micros() as f64;
    drop(host);
    let answered = wearer.join().unwrap();

    let clocks: Vec<Value> = output
        .lines()
        .map(|line| serde_json::from_str::<Value>(line).unwrap()["clock"].clone())
        .filter(|clock| !clock.is_null())
        .collect();
    assert_eq!(clocks[0]["notice"], "started");
    let last = clocks.last().unwrap();
    assert!(clocks.len() >= 3 && answered >= 4, "{clocks:?}");
    // The program's clock began after the test's, and before the test was over.
    let ahead_us = -last["offset_us"].as_f64().unwrap() - AHEAD_US as f64;
    assert!((-1_000.0..lasted_us).contains(&ahead_us), "{last}");
    // A pseudo-terminal is quick, the machine may be busy.
    let round_trip_us = last["round_trip_us"].as_f64().unwrap();
    assert!((0.0..100_000.0).contains(&round_trip_us), "{last}");
}
