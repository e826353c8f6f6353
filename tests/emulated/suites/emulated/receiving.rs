//! What a host sends to the chip's serial port.

use tonus_emulated::{Machine, Stop};
use tonus_shared::wire::cobs::MAX_BLOCK_BYTES;
use tonus_shared::wire::{HandPosition, Packet, Ping};

use super::host::enclosed;
use super::{STARTED_US, frames, started};

fn block(sequence: u32) -> Vec<u8> {
    let packet = Packet::HandPosition(HandPosition {
        position_m: Some([0.25, 0.0, -0.5]),
    });
    enclosed(sequence, packet)
}

/// A machine to which the host has sent this, long enough ago.
fn told(bytes: &[u8]) -> Machine {
    let mut machine = started();
    machine.send(bytes);
    let line_us = 10 * bytes.len() as u64;
    assert_eq!(
        machine.run_until(STARTED_US + line_us + 20_000),
        Ok(Stop::Time)
    );
    machine
}

fn lines<'a>(machine: &'a Machine, part: &str) -> Vec<&'a String> {
    machine
        .log()
        .iter()
        .filter(|line| line.contains(part))
        .collect()
}

#[test]
fn a_flood_turns_the_ring_many_times_without_a_byte_lost() {
    // 400 frames are 20 kB through a ring of 512 bytes, twenty times as fast as a host may send.
    const SENT: u32 = 400;
    let machine = told(&(0..SENT).flat_map(block).collect::<Vec<u8>>());
    let dropped = lines(&machine, "dropped");
    assert!((1..SENT as usize).contains(&dropped.len()), "{dropped:#?}");
    let refused = |line: &&&String| line.contains("TooFast") || line.contains("Full");
    assert_eq!(
        dropped.iter().filter(refused).count(),
        dropped.len(),
        "{dropped:#?}"
    );
    let counts = format!("bytes_lost: 0, blocks: 0, refused: {}", dropped.len());
    let last = dropped.last().unwrap();
    assert!(last.contains(&counts), "{last}");
}

#[test]
fn every_ping_at_a_host_s_pace_is_answered() {
    const PINGS: u32 = 50;
    const PACE_US: u64 = 10_000;
    let mut machine = started();
    let mut now_us = STARTED_US;
    for id in 0..PINGS {
        let ping = Packet::Ping(Ping::Request {
            id,
            requested_us: now_us,
        });
        machine.send(&enclosed(id, ping));
        now_us += PACE_US;
        assert_eq!(machine.run_until(now_us), Ok(Stop::Time));
    }
    assert_eq!(machine.run_until(now_us + 100_000), Ok(Stop::Time));
    let replies = frames(&machine).into_iter();
    let replies = replies.filter_map(|(_, frame)| match frame.packet {
        Packet::Ping(Ping::Reply {
            id,
            received_us,
            replied_us,
            ..
        }) => Some((id, received_us, replied_us)),
        _ => None,
    });
    let replies: Vec<_> = replies.collect();
    assert_eq!(replies.len(), PINGS as usize, "{:#?}", machine.log());
    let first_us = replies[0].1;
    for (number, (id, received_us, replied_us)) in (0..).zip(replies) {
        assert_eq!(id, number);
        // A request waits for the end of a buffer of scans.
        let expected_us = first_us + u64::from(number) * PACE_US;
        assert!(received_us.abs_diff(expected_us) <= 5_100, "{received_us}");
        assert!((received_us..received_us + 1_000).contains(&replied_us));
    }
    assert_eq!(lines(&machine, "dropped").len(), 0);
}

#[test]
fn garbage_is_counted_by_the_chip() {
    let mut changed = block(1);
    changed[8] ^= 0x10;
    let garbage = [0x55; 3 * MAX_BLOCK_BYTES];
    let line = [&[0][..], &changed, &garbage, &[0], &block(2)].concat();
    let machine = told(&line);
    let dropped = lines(&machine, "dropped");
    assert_eq!(dropped.len(), 2, "{:#?}", machine.log());
    assert!(dropped[0].contains("BadCrc"), "{}", dropped[0]);
    assert!(dropped[1].contains("TooLong"), "{}", dropped[1]);
}
