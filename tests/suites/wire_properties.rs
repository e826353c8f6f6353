//! The wire protocol on random bytes and random packets; sequence numbers on a random link.
#![allow(clippy::unwrap_used, reason = "test suite")]

use proptest::array::{uniform3, uniform4, uniform8};
use proptest::prelude::*;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use tonus_shared::wire::{
    ActiveModel, Arrival, Calibration, Configuration, Control, Frame, HandPosition, Header,
    Inference, Kind, LastWords, MAX_FRAME_BYTES, ModelState, ModelUpload, Muscle, Orientation,
    Packet, Ping, RawSemg, Reception, Refusal, Reply, ResetReason, SequenceTracker, SkillPosterior,
    Status, StatusFlags, Stream, StreamFlags, TABLE, VERSION, decode,
};
use tonus_tests::frames::{bytes_of, quality, sealed};
use tonus_tests::seeded;

fn used_slots<T: Copy + Default>(channels: u8, mut slots: [T; 8]) -> [T; 8] {
    slots[usize::from(channels)..].fill(T::default());
    slots
}

fn any_stream() -> impl Strategy<Value = Packet> {
    (
        1_u8..=8,
        any::<u32>(),
        uniform8(0_f32..1e3),
        (0_f32..4e3, 1_f32..1e3),
        uniform3(1e-3_f32..1e6),
        uniform8(0_u8..16).prop_map(quality),
        0_u16..256,
    )
        .prop_map(
            |(
                channels,
                describes_before_us,
                envelopes,
                factors,
                stiffness_n_per_m,
                quality,
                flags,
            )| {
                Packet::Stream(Stream {
                    describes_before_us,
                    envelopes: used_slots(channels, envelopes),
                    activation: factors.0,
                    co_contraction: factors.1,
                    stiffness_n_per_m,
                    quality: used_slots(channels, quality),
                    channels,
                    flags: StreamFlags::from_bits(flags),
                })
            },
        )
}

fn any_muscle() -> impl Strategy<Value = Muscle> {
    prop_oneof![
        Just(Muscle::BicepsShort),
        Just(Muscle::BicepsLong),
        Just(Muscle::TricepsLateral),
        Just(Muscle::TricepsLong),
        Just(Muscle::Other),
    ]
}

fn any_calibration() -> impl Strategy<Value = Packet> {
    (
        (1_u8..=8, uniform8(any_muscle()), any::<u32>()),
        prop_oneof![Just(None), Just(Some(50)), Just(Some(60))],
        (uniform8(0_f32..1.0), uniform8(0_f32..1.0)),
        (1e-3_f32..1e5, 1e-6_f32..10.0, 0_f32..1e3, 1e-6_f32..1e6),
        (uniform4(1e-6_f32..1e3), 1e-3_f32..1e3, 1e-3_f32..10.0),
    )
        .prop_map(|(map, mains_hz, (rest_v, mvc_v), curve, body)| {
            let (channels, muscles, revision) = map;
            let (semg_hz, activation_window_s, l1, l2) = curve;
            let (rest_stiffness_nm_per_rad, body_mass_kg, body_height_m) = body;
            Packet::Calibration(Calibration {
                revision,
                channels,
                muscles: used_slots(channels, muscles),
                mains_hz,
                semg_hz,
                rest_v: used_slots(channels, rest_v),
                mvc_v: used_slots(channels, mvc_v),
                activation_window_s,
                l1,
                l2,
                rest_stiffness_nm_per_rad,
                body_mass_kg,
                body_height_m,
            })
        })
}

fn any_upload() -> impl Strategy<Value = Packet> {
    let begin = (1_u32.., any::<[u8; 32]>()).prop_map(|(total_bytes, sha256)| ModelUpload::Begin {
        total_bytes,
        sha256,
    });
    let bytes = proptest::collection::vec(any::<u8>(), 1..=216);
    let piece = (0..=u32::MAX - 216, bytes).prop_map(|(offset_bytes, bytes)| ModelUpload::Piece {
        offset_bytes,
        bytes: bytes.into_iter().collect(),
    });
    let end = prop_oneof![Just(ModelUpload::Finish), Just(ModelUpload::Abandon)];
    prop_oneof![begin, piece, end].prop_map(Packet::ModelUpload)
}

fn any_model_state() -> impl Strategy<Value = Packet> {
    let active =
        (any::<[u8; 8]>(), uniform4(1_u8..)).prop_map(|(hash, [skills, dofs, functions, rank])| {
            ActiveModel {
                hash,
                skills,
                dofs,
                functions,
                rank,
            }
        });
    let receiving = (any::<[u8; 8]>(), any::<[u32; 2]>());
    (
        proptest::option::of(active),
        proptest::option::of(receiving),
        1_u32..,
    )
        .prop_map(|(active, receiving, capacity_bytes)| {
            let receiving = receiving.map(|(hash, [received, total])| {
                let total_bytes = total % capacity_bytes + 1;
                Reception {
                    hash,
                    received_bytes: received % total_bytes,
                    total_bytes,
                }
            });
            Packet::ModelState(ModelState {
                active,
                receiving,
                capacity_bytes,
            })
        })
}

fn any_answer() -> impl Strategy<Value = Packet> {
    let control = prop_oneof![
        any::<bool>().prop_map(Control::Raw),
        Just(Control::SendCalibration),
        Just(Control::SendModelState),
        any::<u32>().prop_map(|boot_id| Control::Restart { boot_id }),
        Just(Control::SendLastWords),
    ];
    let outcome = prop_oneof![
        Just(Ok(())),
        Just(Err(Refusal::Malformed)),
        Just(Err(Refusal::WrongState)),
        Just(Err(Refusal::TooLarge)),
        Just(Err(Refusal::HashMismatch)),
        Just(Err(Refusal::StorageFailed)),
        Just(Err(Refusal::NotFitting)),
        Just(Err(Refusal::Busy)),
    ];
    let reply = (0..TABLE.len(), any::<[u32; 2]>(), outcome).prop_map(
        |(row, [sequence, detail], outcome)| Reply {
            answered: TABLE[row].kind,
            sequence,
            outcome,
            detail,
        },
    );
    // A message of any length, cut wherever 128 bytes end.
    let words = any::<String>().prop_map(|text| LastWords::from_bytes(text.repeat(3).as_bytes()));
    prop_oneof![
        control.prop_map(Packet::Control),
        reply.prop_map(Packet::Reply),
        words.prop_map(Packet::LastWords),
    ]
}

fn any_configuration() -> impl Strategy<Value = Packet> {
    (
        (1_u8..=8, uniform8(any_muscle())),
        (1_f32..1e5, 1_f32..1e4, 1e-9_f32..1.0),
        (any::<i32>(), any::<u32>()),
        (
            prop_oneof![Just(None), Just(Some(50)), Just(Some(60))],
            any::<bool>(),
            any::<[u8; 8]>(),
        ),
    )
        .prop_map(
            |(
                (channels, muscles),
                hz,
                (offset_counts, chain_delay_us),
                (mains_hz, raw, firmware_hash),
            )| {
                Packet::Configuration(Configuration {
                    semg_hz: hz.0,
                    stream_hz: hz.1,
                    volts_per_count: hz.2,
                    offset_counts,
                    chain_delay_us,
                    channels,
                    muscles: used_slots(channels, muscles),
                    mains_hz,
                    raw,
                    firmware_hash,
                })
            },
        )
}

fn any_raw() -> impl Strategy<Value = Packet> {
    (1_u8..=8)
        .prop_flat_map(|channels| (Just(channels), 1..=72 / usize::from(channels), any::<u32>()))
        .prop_flat_map(|(channels, scans, first_index)| {
            let count = usize::from(channels) * scans;
            proptest::collection::vec(-(1 << 23)..1 << 23, count).prop_map(move |counts| {
                Packet::RawSemg(RawSemg {
                    first_index,
                    channels,
                    counts: counts.into_iter().collect(),
                })
            })
        })
}

fn any_inference() -> impl Strategy<Value = Packet> {
    (1_u8..=255)
        .prop_flat_map(|skills| {
            let entry = (0..skills, -1e6_f32..=0.0);
            let most = usize::from(skills.min(4));
            (
                Just(skills),
                proptest::collection::vec(entry, 1..=most),
                0_f32..=1.0,
                uniform3(1e-3_f32..1e6),
            )
        })
        .prop_map(|(skills, mut top, phase, stiffness_n_per_m)| {
            top.sort_by(|a, b| b.1.total_cmp(&a.1));
            let entries = top
                .into_iter()
                .map(|(skill, log_posterior)| SkillPosterior {
                    skill,
                    log_posterior,
                });
            Packet::Inference(Inference {
                skills,
                top: entries.collect(),
                phase,
                stiffness_n_per_m,
            })
        })
}

fn any_small() -> impl Strategy<Value = Packet> {
    let unit = uniform4(-1_f32..1.0)
        .prop_filter("a direction", |q| {
            q.iter().map(|x| x * x).sum::<f32>() > 0.01
        })
        .prop_map(|q| {
            let norm = q.iter().map(|x| x * x).sum::<f32>().sqrt();
            Packet::Orientation(Orientation {
                xyzw: q.map(|x| x / norm),
            })
        });
    let hand = proptest::option::of(uniform3(-3_f32..=3.0))
        .prop_map(|position_m| Packet::HandPosition(HandPosition { position_m }));
    let request = (any::<u32>(), any::<u64>())
        .prop_map(|(id, requested_us)| Packet::Ping(Ping::Request { id, requested_us }));
    let reply = (any::<u32>(), any::<u64>(), any::<u64>(), any::<u64>()).prop_map(
        |(id, requested_us, a, b)| {
            Packet::Ping(Ping::Reply {
                id,
                requested_us,
                received_us: a.min(b),
                replied_us: a.max(b),
            })
        },
    );
    let status = (
        any::<[u32; 9]>(),
        proptest::option::of(1_u16..),
        uniform8(0_u8..16).prop_map(quality),
        (0_u8..64, any::<u16>()),
    )
        .prop_map(|(n, battery_mv, quality, (flags, links))| {
            Packet::Status(Status {
                uptime_s: n[0],
                battery_mv,
                reset_reason: ResetReason::Lockup,
                overruns: n[1],
                gaps: n[2],
                missed_scans: n[3],
                refused: n[4],
                dropped_packets: n[5],
                quality,
                flags: StatusFlags::from_bits(flags),
                dropped_hypotheses: n[6],
                refused_requests: n[7],
                links,
                lost_reports: n[8],
            })
        });
    prop_oneof![unit, hand, request, reply, status]
}

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
