//! The wire protocol on random bytes and random packets; sequence numbers on a random link.
#![allow(clippy::unwrap_used, reason = "test suite")]

use proptest::prelude::*;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use tonus_shared::wire::{
    Arrival, Frame, Header, Kind, LastWords, MAX_FRAME_BYTES, SequenceTracker, TABLE, VERSION,
    decode,
};
use tonus_tests::frames::{bytes_of, sealed};
use tonus_tests::seeded;

use strategies::{
    any_answer, any_calibration, any_configuration, any_inference, any_model_state, any_raw,
    any_small, any_stream, any_upload,
};

mod strategies;

proptest! {
    #![proptest_config(seeded(1_024))]

    #[test]
    fn random_bytes_never_panic(bytes in proptest::collection::vec(any::<u8>(), 0..300)) {
        prop_assert!(decode(&bytes).is_err());
    }

    /// A correct version, kind, length and checksum around random payloads: refused, or the very same bytes again.
    #[test]
    fn random_payloads_never_panic(
        row in 0_usize..TABLE.len(),
        header in any::<[u8; 16]>(),
        payload in proptest::collection::vec(any::<u8>(), 222),
        length in any::<prop::sample::Index>(),
        raw_shape in (1_u8..=8, 1_u8..=9),
        step in 0_u8..4,
    ) {
        let row = TABLE[row];
        let mut length = row.payload_min + length.index(row.payload_max - row.payload_min + 1);
        let mut payload = payload;
        if row.kind == Kind::RawSemg {
            payload[4] = raw_shape.0;
            payload[5] = raw_shape.1;
            length = 6 + 3 * usize::from(raw_shape.0) * usize::from(raw_shape.1);
        }
        match row.kind {
            Kind::ModelUpload if step == 1 => payload[0] = 1,
            Kind::ModelUpload => {
                payload[0] = step;
                length = if step == 0 { 37 } else { 1 };
            }
            Kind::LastWords => {
                payload[0] = (length - 1) as u8;
                payload[1..].iter_mut().for_each(|byte| *byte &= 0x7F);
            }
            _ => {}
        }
        let mut body = vec![VERSION, row.kind as u8];
        body.extend(header);
        body.extend(&payload[..length]);
        let bytes = sealed(body);
        if let Ok(frame) = decode(&bytes) {
            prop_assert_eq!(bytes_of(&frame.header, &frame.packet).unwrap(), bytes);
        }
    }

    #[test]
    fn a_packet_comes_back_as_it_went(
        packet in prop_oneof![any_stream(), any_configuration(), any_raw(), any_inference(), any_small(),
            any_calibration(), any_upload(), any_model_state(), any_answer()],
        boot_id in any::<u32>(),
        sequence in any::<u32>(),
        device_us in any::<u64>(),
    ) {
        let header = Header { boot_id, sequence, device_us };
        let bytes = bytes_of(&header, &packet).unwrap();
        prop_assert!(bytes.len() <= MAX_FRAME_BYTES);
        prop_assert_eq!(decode(&bytes).unwrap(), Frame { header, packet });
    }
}

#[test]
fn last_words_are_cut_before_a_character() {
    let kept = |bytes: &[u8]| LastWords::from_bytes(bytes).words.as_str().to_owned();
    assert_eq!(kept(b"panicked at 7"), "panicked at 7");
    assert_eq!(kept("ab\u{e9}".as_bytes()), "ab\u{e9}");
    assert_eq!(kept(b"ab\xc3"), "ab", "half a character");
    assert_eq!(
        kept(b"ab\xffcd"),
        "ab",
        "what follows a broken byte is not trusted"
    );
    assert_eq!(kept(b"\xff"), "");
    let long = format!("{}\u{26a0}\u{26a0}", "x".repeat(124));
    assert_eq!(
        kept(long.as_bytes()),
        format!("{}\u{26a0}", "x".repeat(124)),
        "127 bytes, no part of the next"
    );
}

/// A link that loses 10 %, repeats 5 % and delays 10 % by up to five packets, across the wrap of the
/// numbers: the tracker's totals are those that the link itself counted.
#[test]
fn the_tracker_counts_what_the_link_did() {
    let mut rng = ChaCha8Rng::seed_from_u64(20_260_101);
    let first = u32::MAX - 2_000;
    let mut arrivals: Vec<(u32, u32)> = Vec::new();
    let (mut lost, mut repeated) = (0_u64, 0_u64);
    for n in 0..10_000_u32 {
        let at = 10 * n;
        let ends = n == 0 || n == 9_999;
        match rng.random_range(0..100) {
            _ if ends => arrivals.push((at, n)),
            0..10 => lost += 1,
            10..15 => {
                repeated += 1;
                arrivals.extend([(at, n), (at + rng.random_range(1..50), n)]);
            }
            15..25 => arrivals.push((at + rng.random_range(1..50), n)),
            _ => arrivals.push((at, n)),
        }
    }
    arrivals.sort_by_key(|(at, _)| *at);
    let mut tracker = SequenceTracker::new();
    let mut newest = None;
    for (_, n) in &arrivals {
        let arrival = tracker.observe(7, first.wrapping_add(*n));
        assert_eq!(
            arrival.is_newest(),
            newest.is_none_or(|newest| *n > newest),
            "packet {n}"
        );
        newest = newest.max(Some(*n));
    }
    let counts = tracker.counts();
    assert_eq!(
        (counts.lost, counts.duplicate, counts.stale),
        (lost, repeated, 0)
    );
    assert_eq!(counts.received + counts.late, 10_000 - lost);
    assert!(counts.late > 0 && counts.boots == 1);
}

#[test]
fn a_restart_is_told_from_a_jump() {
    let mut tracker = SequenceTracker::new();
    let seen: Vec<_> = [
        (7, u32::MAX),
        (7, 0),
        (7, 3),
        (7, 1),
        (7, 1),
        (9, 0),
        (7, 4),
        (9, 1),
        (9, u32::MAX),
    ]
    .into_iter()
    .map(|(boot_id, sequence)| tracker.observe(boot_id, sequence))
    .collect();
    let expected = [
        Arrival::NewBoot,
        Arrival::Newer { lost: 0 },
        Arrival::Newer { lost: 2 },
        Arrival::Late,
        Arrival::Duplicate,
        Arrival::NewBoot,
        Arrival::Stale,
        Arrival::Newer { lost: 0 },
        Arrival::Stale,
    ];
    assert_eq!(seen, expected);
    let counts = tracker.counts();
    assert_eq!((counts.received, counts.lost, counts.late), (5, 1, 1));
    assert_eq!((counts.duplicate, counts.stale, counts.boots), (1, 2, 2));
}

#[test]
fn a_long_silence_is_counted_whole() {
    let mut tracker = SequenceTracker::new();
    tracker.observe(1, 10);
    assert_eq!(
        tracker.observe(1, 1_000_010),
        Arrival::Newer { lost: 999_999 }
    );
    assert_eq!(tracker.observe(1, 1_000_010 - 63), Arrival::Late);
    assert_eq!(tracker.observe(1, 1_000_010 - 64), Arrival::Stale);
    assert_eq!(tracker.counts().lost, 999_998);
}
