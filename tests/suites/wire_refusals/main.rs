//! Every reason for which a frame is refused, by type and field.
#![allow(clippy::unwrap_used, clippy::panic, reason = "test suite")]

use tonus_shared::wire::{
    Frame, HandPosition, Kind, MAX_FRAME_BYTES, Orientation, Packet, RawSemg, STREAM_FRAME_BYTES,
    Stream, WireError, decode, encode,
};
use tonus_tests::frames::{HEADER, bytes_of, crc32_bitwise, golden, golden_stream, sealed};

mod management;

fn golden_body(name: &str) -> Vec<u8> {
    let (_, mut bytes) = golden()
        .into_iter()
        .find(|(found, _)| *found == name)
        .unwrap();
    bytes.truncate(bytes.len() - 4);
    bytes
}

/// The golden body with the bytes at `at` of its payload replaced.
fn patched(name: &str, at: usize, bytes: &[u8]) -> Result<Frame, WireError> {
    let mut body = golden_body(name);
    body[18 + at..18 + at + bytes.len()].copy_from_slice(bytes);
    decode(&sealed(body))
}

#[test]
fn each_refusal_has_its_type() {
    assert_eq!(decode(&[]), Err(WireError::TooShort { needed: 22, got: 0 }));
    assert_eq!(
        decode(&[2; 21]),
        Err(WireError::TooShort {
            needed: 22,
            got: 21
        })
    );
    assert_eq!(decode(&[1]), Err(WireError::UnknownVersion { got: 1 }));
    let stream = golden_body("stream");
    let mut next_version = stream.clone();
    next_version[0] = 3;
    assert_eq!(
        decode(&sealed(next_version)),
        Err(WireError::UnknownVersion { got: 3 }),
        "a valid frame of the next version says so"
    );
    for number in [0, 15, 255] {
        let mut unknown = stream.clone();
        unknown[1] = number;
        assert_eq!(
            decode(&sealed(unknown)),
            Err(WireError::UnknownKind { got: number })
        );
    }
    let mut longer = stream.clone();
    longer.push(0);
    assert_eq!(
        decode(&sealed(longer)),
        Err(WireError::WrongLength {
            kind: Kind::Stream,
            expected: 89,
            got: 90
        })
    );
    assert_eq!(
        patched("raw", 5, &[3]),
        Err(WireError::WrongLength {
            kind: Kind::RawSemg,
            expected: 22 + 6 + 27,
            got: 22 + 6 + 18
        })
    );
    let mut flipped = sealed(stream.clone());
    flipped[20] ^= 4;
    let got = crc32_bitwise(&stream);
    let expected = crc32_bitwise(&flipped[..flipped.len() - 4]);
    assert_eq!(decode(&flipped), Err(WireError::BadCrc { expected, got }));
    let short = encode(&HEADER, &golden_stream(), &mut [0; 88]);
    assert_eq!(
        short,
        Err(WireError::BufferTooSmall {
            needed: 89,
            got: 88
        })
    );
}

#[test]
fn what_is_not_finite_is_refused_when_decoding() {
    let calibrated: Vec<usize> = (14..118).step_by(4).collect();
    let fields: [(&str, &[usize]); 6] = [
        ("calibration", &calibrated),
        ("configuration", &[0, 4, 8]),
        (
            "stream",
            &[4, 8, 12, 16, 20, 24, 28, 32, 36, 40, 44, 48, 52],
        ),
        ("orientation", &[0, 4, 8, 12]),
        ("hand_seen", &[1, 5, 9]),
        ("inference", &[3, 8, 22, 26, 30, 34]),
    ];
    for (name, places) in fields {
        for at in places {
            for bad in [
                f32::NAN,
                -f32::NAN,
                f32::INFINITY,
                f32::NEG_INFINITY,
                f32::from_bits(0x7F80_0001),
            ] {
                let refused = patched(name, *at, &bad.to_le_bytes());
                assert!(
                    matches!(refused, Err(WireError::NonFinite { .. })),
                    "{name} at {at}: {refused:?}"
                );
            }
        }
    }
}

/// Golden name, place in the payload, bytes put there, field that the refusal names.
type Case<'a> = (&'static str, usize, &'a [u8], &'static str);

fn refused_by_field(cases: &[Case]) {
    for (name, at, bytes, expected) in cases {
        match patched(name, *at, bytes) {
            Err(WireError::OutOfRange { field, .. }) => {
                assert_eq!(field, *expected, "{name} at {at}")
            }
            other => panic!("{name} at {at}: {other:?}"),
        }
    }
}

#[test]
fn what_cannot_be_is_refused_when_decoding() {
    refused_by_field(&[
        ("configuration", 0, &f32::to_le_bytes(0.0), "semg_hz"),
        ("configuration", 0, &f32::to_le_bytes(-200.0), "semg_hz"),
        ("configuration", 4, &f32::to_le_bytes(0.0), "stream_hz"),
        (
            "configuration",
            8,
            &f32::to_le_bytes(-1.0),
            "volts_per_count",
        ),
        ("configuration", 20, &[0], "channels"),
        ("configuration", 20, &[9], "channels"),
        ("configuration", 20, &[5], "muscles"),
        ("configuration", 21, &[6], "muscles"),
        ("configuration", 25, &[5], "muscles"),
        ("configuration", 29, &[55], "mains_hz"),
        ("configuration", 30, &[2], "raw"),
        ("stream", 20, &f32::to_le_bytes(1.0), "envelopes"),
        ("stream", 40, &f32::to_le_bytes(0.99), "co_contraction"),
        ("stream", 44, &f32::to_le_bytes(0.0), "stiffness_n_per_m"),
        ("stream", 52, &f32::to_le_bytes(-1.0), "stiffness_n_per_m"),
        ("stream", 48, &f32::to_le_bytes(2e6), "stiffness_n_per_m"),
        ("stream", 63, &[1], "quality"),
        ("stream", 56, &[16], "quality"),
        ("stream", 64, &[0], "channels"),
        ("stream", 66, &[1], "flags"),
        ("raw", 4, &[0], "scans"),
        ("raw", 4, &[9, 9], "scans"),
        ("orientation", 0, &f32::to_le_bytes(0.6), "norm of xyzw"),
        ("hand_seen", 0, &[0], "position_m of a hand not seen"),
        ("hand_seen", 1, &f32::to_le_bytes(3.5), "position_m"),
        ("ping_reply", 0, &[2], "role"),
        ("ping_reply", 21, &[0; 8], "replied_us"),
        ("ping_reply", 0, &[0], "times of the replier in a request"),
        ("inference", 1, &[4], "top"),
        ("inference", 22, &f32::to_le_bytes(1.5), "phase"),
        ("status", 6, &[7], "reset_reason"),
        ("status", 35, &[64], "flags"),
        ("status", 35, &[128], "flags"),
    ]);
}

#[test]
fn what_is_not_finite_is_refused_when_encoding() {
    let Packet::Stream(good) = golden_stream() else {
        unreachable!()
    };
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let broken = [
            Stream {
                activation: bad,
                ..good
            },
            Stream {
                co_contraction: bad,
                ..good
            },
            Stream {
                envelopes: [bad; 8],
                ..good
            },
            Stream {
                stiffness_n_per_m: [100.0, 100.0, bad],
                ..good
            },
        ];
        let others = [
            Packet::Orientation(Orientation {
                xyzw: [0.0, 0.0, bad, 1.0],
            }),
            Packet::HandPosition(HandPosition {
                position_m: Some([0.0, bad, 0.0]),
            }),
        ];
        for packet in broken.map(Packet::Stream).into_iter().chain(others) {
            let mut buffer = [0xEE; MAX_FRAME_BYTES];
            let refused = encode(&HEADER, &packet, &mut buffer);
            assert!(
                matches!(refused, Err(WireError::NonFinite { .. })),
                "{packet:?}"
            );
            assert_eq!(buffer, [0xEE; MAX_FRAME_BYTES], "nothing is written");
        }
    }
    let wide = Packet::RawSemg(RawSemg {
        first_index: 0,
        channels: 1,
        counts: [1 << 23].into_iter().collect(),
    });
    assert_eq!(
        bytes_of(&HEADER, &wide),
        Err(WireError::OutOfRange {
            field: "counts",
            got: 8_388_608.0,
            low: -8_388_608.0,
            high: 8_388_607.0
        })
    );
    assert_eq!(
        STREAM_FRAME_BYTES,
        bytes_of(&HEADER, &golden_stream()).unwrap().len()
    );
}

#[test]
fn refusals_say_what_to_do() {
    let said = [
        decode(&[9; 30]).unwrap_err().to_string(),
        decode(&golden()[2].1[..40]).unwrap_err().to_string(),
        patched("stream", 44, &(-1_f32).to_le_bytes())
            .unwrap_err()
            .to_string(),
    ];
    assert_eq!(
        said[0],
        "protocol version 9, this side speaks 2: update the older of wearable and host"
    );
    assert_eq!(
        said[1],
        "stream frame of 40 bytes, 89 expected: check that the ATT MTU is at least 100"
    );
    assert!(
        said[2].starts_with("`stiffness_n_per_m` is -1, allowed "),
        "{}",
        said[2]
    );
}
