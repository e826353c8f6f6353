//! What a host sends to the chip's serial port.

use tonus_emulated::{Machine, Stop};
use tonus_firmware::wired::INBOX_FRAMES;
use tonus_shared::wire::cobs::{MAX_BLOCK_BYTES, enclose};
use tonus_shared::wire::{Frame, HandPosition, Header, MAX_FRAME_BYTES, Packet};

use super::{image, wearer};

const STARTED_US: u64 = 600_000;

fn block(sequence: u32) -> Vec<u8> {
    let frame = Frame {
        header: Header {
            boot_id: 7,
            sequence,
            device_us: 0,
        },
        packet: Packet::HandPosition(HandPosition {
            position_m: Some([0.25, 0.0, -0.5]),
        }),
    };
    let (mut bytes, mut block) = ([0; MAX_FRAME_BYTES], [0; MAX_BLOCK_BYTES]);
    let length = frame.encode(&mut bytes).unwrap();
    let length = enclose(&bytes[..length], &mut block).unwrap();
    block[..length].to_vec()
}

/// A machine to which the host has sent this, long enough ago.
fn told(bytes: &[u8]) -> Machine {
    let mut machine = Machine::new(image(), wearer(vec![1877])).unwrap();
    assert_eq!(machine.run_until(STARTED_US), Ok(Stop::Time));
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
fn frames_arrive_through_many_turns_of_the_ring_without_a_byte_lost() {
    // 400 frames are 20 kB through a ring of 512 bytes.
    const SENT: u32 = 400;
    let machine = told(&(0..SENT).flat_map(block).collect::<Vec<u8>>());
    let dropped = lines(&machine, "dropped");
    // Nothing in this image takes frames out of the inbox yet, so all but those that fit are dropped there, and
    // none anywhere else.
    assert_eq!(
        dropped.len(),
        SENT as usize - INBOX_FRAMES,
        "{:#?}",
        machine.log()
    );
    let last = dropped.last().unwrap();
    let counts = format!(
        "bytes_lost: 0, blocks: 0, frames: 0, inbox_full: {}",
        SENT as usize - INBOX_FRAMES
    );
    assert!(last.contains(&counts), "{last}");
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
