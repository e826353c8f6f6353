//! Frames on a serial line: the encoding against its authors' examples, and frames among any garbage.
#![allow(clippy::unwrap_used, reason = "test suite")]

use proptest::collection::vec;
use proptest::prelude::*;
use tonus_shared::wire::cobs::{BlockError, DELIMITER, MAX_BLOCK_BYTES, Unframer, enclose};
use tonus_shared::wire::{Frame, MAX_FRAME_BYTES, WireError, decode};
use tonus_tests::frames::golden;
use tonus_tests::seeded;

/// Room for frames longer than any of ours, to see runs of more than 254 bytes.
const ROOM: usize = 1024;

fn enclosed(frame: &[u8]) -> Vec<u8> {
    let mut block = [0; ROOM + ROOM / 254 + 2];
    let length = enclose(frame, &mut block).unwrap();
    block[..length].to_vec()
}

/// What a receiver makes of a line: frames that pass every check, and how many were refused.
fn frames(line: &[u8]) -> (Vec<Frame>, usize) {
    let (mut unframer, mut frames, mut refused) =
        (Unframer::<MAX_FRAME_BYTES>::new(), Vec::new(), 0);
    for byte in line {
        match unframer.push(*byte) {
            Ok(None) => {}
            Ok(Some(bytes)) => match decode(bytes) {
                Ok(frame) => frames.push(frame),
                Err(_) => refused += 1,
            },
            Err(_) => refused += 1,
        }
    }
    (frames, refused)
}

fn golden_frame(number: usize) -> Vec<u8> {
    let frames = golden();
    frames[number % frames.len()].1.clone()
}

/// The examples of the paper's table (Cheshire and Baker, 1999), as the encoding's description lists them.
#[test]
fn published_examples() {
    let count = |from: u8, to: u8| (from..=to).collect::<Vec<u8>>();
    let examples: [(Vec<u8>, Vec<u8>); 11] = [
        (vec![0x00], vec![0x01, 0x01]),
        (vec![0x00, 0x00], vec![0x01, 0x01, 0x01]),
        (vec![0x00, 0x11, 0x00], vec![0x01, 0x02, 0x11, 0x01]),
        (
            vec![0x11, 0x22, 0x00, 0x33],
            vec![0x03, 0x11, 0x22, 0x02, 0x33],
        ),
        (
            vec![0x11, 0x22, 0x33, 0x44],
            vec![0x05, 0x11, 0x22, 0x33, 0x44],
        ),
        (
            vec![0x11, 0x00, 0x00, 0x00],
            vec![0x02, 0x11, 0x01, 0x01, 0x01],
        ),
        (count(1, 254), [vec![0xFF], count(1, 254)].concat()),
        (count(0, 254), [vec![0x01, 0xFF], count(1, 254)].concat()),
        (
            count(1, 255),
            [vec![0xFF], count(1, 254), vec![0x02, 0xFF]].concat(),
        ),
        (
            [count(2, 255), vec![0x00]].concat(),
            [vec![0xFF], count(2, 255), vec![0x01, 0x01]].concat(),
        ),
        (
            [count(3, 255), vec![0x00, 0x01]].concat(),
            [vec![0xFE], count(3, 255), vec![0x02, 0x01]].concat(),
        ),
    ];
    for (frame, block) in examples {
        assert_eq!(
            enclosed(&frame),
            [block, vec![DELIMITER]].concat(),
            "{frame:02x?}"
        );
    }
    assert_eq!(enclosed(&[]), [0x01, DELIMITER]);
}

#[test]
fn a_buffer_that_is_too_small_is_refused_and_the_largest_suffices() {
    let frame = [7; MAX_FRAME_BYTES];
    assert_eq!(
        enclose(&frame, &mut [0; MAX_BLOCK_BYTES - 1]),
        Err(WireError::BufferTooSmall {
            needed: MAX_BLOCK_BYTES,
            got: MAX_BLOCK_BYTES - 1
        })
    );
    assert_eq!(
        enclose(&frame, &mut [0; MAX_BLOCK_BYTES]),
        Ok(MAX_BLOCK_BYTES)
    );
}

#[test]
fn each_broken_block_is_refused_once_and_by_name() {
    let mut unframer = Unframer::<4>::new();
    let outcomes: Vec<_> = [5, 1, 2, 0, 9, 1, 2, 3, 4, 5, 6, 7, 8, 0]
        .into_iter()
        .filter_map(|byte| unframer.push(byte).err())
        .collect();
    assert_eq!(
        outcomes,
        [
            BlockError::CutShort { missing: 2 },
            BlockError::TooLong { limit: 4 }
        ]
    );
}

proptest! {
    #![proptest_config(seeded(300))]

    #[test]
    fn any_bytes_come_back(frame in vec(prop_oneof![Just(0_u8), any::<u8>(), Just(255)], 1..ROOM)) {
        let block = enclosed(&frame);
        prop_assert_eq!(block.iter().position(|byte| *byte == DELIMITER), Some(block.len() - 1));
        let mut unframer = Unframer::<ROOM>::new();
        let (last, before) = block.split_last().unwrap();
        for byte in before {
            prop_assert_eq!(unframer.push(*byte), Ok(None));
        }
        prop_assert_eq!(unframer.push(*last), Ok(Some(&frame[..])));
    }

    #[test]
    fn a_frame_behind_any_garbage_and_a_delimiter_is_taken(
        garbage in vec(any::<u8>(), 0..600),
        number in 0_usize..20,
    ) {
        let frame = golden_frame(number);
        let (found, refused) = frames(&[&garbage[..], &[DELIMITER], &enclosed(&frame)].concat());
        prop_assert_eq!(found, [decode(&frame).unwrap()]);
        let pieces = garbage.split(|byte| *byte == DELIMITER).filter(|piece| !piece.is_empty());
        prop_assert!(refused <= pieces.count());
    }

    #[test]
    fn flips_and_cuts_never_make_another_frame(
        numbers in vec(0_usize..20, 3..12),
        damage in vec((any::<prop::sample::Index>(), 1_u8..=255), 1..6),
        cut in proptest::option::of((any::<prop::sample::Index>(), 1_usize..80)),
    ) {
        let sent: Vec<Vec<u8>> = numbers.into_iter().map(golden_frame).collect();
        let mut line: Vec<u8> = sent.iter().flat_map(|frame| enclosed(frame)).collect();
        for (place, mask) in damage {
            let place = place.index(line.len());
            line[place] ^= mask;
        }
        if let Some((place, length)) = cut {
            let place = place.index(line.len());
            line.drain(place..(place + length).min(line.len()));
        }
        line.push(DELIMITER);
        let whole = decode(&golden_frame(1)).unwrap();
        line.extend(enclosed(&golden_frame(1)));
        let (found, _) = frames(&line);
        prop_assert_eq!(found.last(), Some(&whole));
        // What arrives was sent, in the order in which it was sent.
        let mut left = sent.iter().map(|frame| decode(frame).unwrap());
        for frame in &found[..found.len() - 1] {
            prop_assert!(left.any(|other| other == *frame), "{:?} was never sent", frame);
        }
    }
}
