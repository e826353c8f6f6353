//! Every reason for which a frame is refused, by type and field.
#![allow(clippy::unwrap_used, clippy::panic, reason = "test suite")]

use tonus_shared::wire::{
    Frame, HandPosition, Kind, MAX_FRAME_BYTES, ModelUpload, Orientation, Packet, RawSemg,
    STREAM_FRAME_BYTES, Stream, WireError, decode, encode,
};
use tonus_tests::frames::{HEADER, bytes_of, crc32_bitwise, golden, golden_stream, sealed};

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

/// Golden frame, where in its payload, what is put there, and the field that must be named.
type Case = (&'static str, usize, &'static [u8], &'static str);

const MEASURED: &[Case] = &[
    ("configuration", 0, &0_f32.to_le_bytes(), "semg_hz"),
    ("configuration", 0, &(-200_f32).to_le_bytes(), "semg_hz"),
    ("configuration", 4, &0_f32.to_le_bytes(), "stream_hz"),
    (
        "configuration",
        8,
        &(-1_f32).to_le_bytes(),
        "volts_per_count",
    ),
    ("configuration", 20, &[0], "channels"),
    ("configuration", 20, &[9], "channels"),
    ("configuration", 20, &[5], "muscles"),
    ("configuration", 21, &[6], "muscles"),
    ("configuration", 25, &[5], "muscles"),
    ("configuration", 29, &[55], "mains_hz"),
    ("configuration", 30, &[2], "raw"),
    ("stream", 20, &1_f32.to_le_bytes(), "envelopes"),
    ("stream", 40, &0.99_f32.to_le_bytes(), "co_contraction"),
    ("stream", 44, &0_f32.to_le_bytes(), "stiffness_n_per_m"),
    ("stream", 52, &(-1_f32).to_le_bytes(), "stiffness_n_per_m"),
    ("stream", 48, &2e6_f32.to_le_bytes(), "stiffness_n_per_m"),
    ("stream", 63, &[1], "quality"),
    ("stream", 56, &[16], "quality"),
    ("stream", 64, &[0], "channels"),
    ("stream", 66, &[1], "flags"),
    ("raw", 4, &[0], "scans"),
    ("raw", 4, &[9, 9], "scans"),
    ("orientation", 0, &0.6_f32.to_le_bytes(), "norm of xyzw"),
    ("hand_seen", 0, &[0], "position_m of a hand not seen"),
    ("hand_seen", 1, &3.5_f32.to_le_bytes(), "position_m"),
    ("ping_reply", 0, &[2], "role"),
    ("ping_reply", 21, &[0; 8], "replied_us"),
    ("ping_reply", 0, &[0], "times of the replier in a request"),
    ("inference", 1, &[4], "top"),
    ("inference", 22, &1.5_f32.to_le_bytes(), "phase"),
    ("status", 6, &[7], "reset_reason"),
    ("status", 35, &[64], "flags"),
    ("status", 35, &[128], "flags"),
];

const MANAGED: &[Case] = &[
    ("control_raw", 0, &[0], "value"),
    ("control_send_calibration", 0, &[0], "command"),
    ("control_send_calibration", 0, &[6], "command"),
    ("control_raw", 1, &[2], "value"),
    ("control_send_calibration", 1, &[1], "value"),
    ("control_send_model_state", 4, &[1], "value"),
    ("control_send_last_words", 2, &[1], "value"),
    ("calibration", 4, &[0], "channels"),
    ("calibration", 4, &[9], "channels"),
    ("calibration", 4, &[3], "muscles"),
    ("calibration", 5, &[6], "muscles"),
    ("calibration", 13, &[55], "mains_hz"),
    ("calibration", 14, &0_f32.to_le_bytes(), "semg_hz"),
    ("calibration", 14, &1e6_f32.to_le_bytes(), "semg_hz"),
    ("calibration", 18, &(-1e-6_f32).to_le_bytes(), "rest_v"),
    ("calibration", 34, &1e-6_f32.to_le_bytes(), "rest_v"),
    ("calibration", 50, &1.5_f32.to_le_bytes(), "mvc_v"),
    ("calibration", 78, &1e-6_f32.to_le_bytes(), "mvc_v"),
    (
        "calibration",
        82,
        &0_f32.to_le_bytes(),
        "activation_window_s",
    ),
    ("calibration", 86, &(-0.5_f32).to_le_bytes(), "l1"),
    ("calibration", 90, &0_f32.to_le_bytes(), "l2"),
    (
        "calibration",
        106,
        &0_f32.to_le_bytes(),
        "rest_stiffness_nm_per_rad",
    ),
    (
        "calibration",
        94,
        &1_001_f32.to_le_bytes(),
        "rest_stiffness_nm_per_rad",
    ),
    ("calibration", 110, &0_f32.to_le_bytes(), "body_mass_kg"),
    ("calibration", 114, &175_f32.to_le_bytes(), "body_height_m"),
    ("upload_begin", 0, &[4], "step"),
    ("upload_begin", 1, &[0; 4], "total_bytes"),
    ("upload_piece", 1, &[0xFF; 4], "offset_bytes"),
    ("upload_finish", 0, &[255], "step"),
    ("model_state", 0, &[2], "state"),
    ("model_state", 0, &[0], "what describes no model"),
    ("model_state", 9, &[0], "what describes no reception"),
    ("model_state", 9, &[3], "receiving"),
    ("model_state", 18, &[0xFF; 4], "received_bytes"),
    ("model_state", 22, &[0; 4], "total_bytes"),
    ("model_state", 26, &[0; 4], "total_bytes"),
    ("model_state", 30, &[0], "skills"),
    ("model_state", 31, &[0], "dofs"),
    ("model_state", 32, &[0], "functions"),
    ("model_state", 33, &[0], "rank"),
    ("model_state_empty", 8, &[1], "what describes no model"),
    ("model_state_empty", 33, &[1], "what describes no model"),
    ("model_state_empty", 17, &[1], "what describes no reception"),
    ("reply_done", 0, &[0], "answered kind"),
    ("reply_done", 0, &[15], "answered kind"),
    ("reply_done", 5, &[2], "outcome"),
    ("reply_done", 6, &[1], "reason"),
    ("reply_refused", 6, &[0], "reason"),
    ("reply_refused", 6, &[10], "reason"),
    ("last_words_full", 0, &[129], "length"),
];

#[test]
fn what_cannot_be_is_refused_when_decoding() {
    for (name, at, bytes, expected) in MEASURED.iter().chain(MANAGED) {
        match patched(name, *at, bytes) {
            Err(WireError::OutOfRange { field, .. }) => {
                assert_eq!(field, *expected, "{name} at {at}")
            }
            other => panic!("{name} at {at}: {other:?}"),
        }
    }
}

#[test]
fn a_list_is_exactly_as_long_as_it_says() {
    let cases = [
        ("upload_begin", 0, 2, 23, 59),
        ("upload_begin", 0, 3, 23, 59),
        ("upload_finish", 0, 0, 59, 23),
        ("upload_finish", 0, 1, 28, 23),
        ("last_words", 0, 27, 50, 51),
        ("last_words", 0, 0, 23, 51),
        ("last_words_none", 0, 1, 24, 23),
    ];
    for (name, at, byte, expected, got) in cases {
        let refused = patched(name, at, &[byte]);
        let Err(WireError::WrongLength {
            expected: told,
            got: was,
            ..
        }) = refused
        else {
            panic!("{name}: {refused:?}")
        };
        assert_eq!((told, was), (expected, got), "{name}");
    }
    let mut longest = golden_body("upload_piece_full");
    longest.push(0);
    assert_eq!(
        decode(&sealed(longest)),
        Err(WireError::WrongLength {
            kind: Kind::ModelUpload,
            expected: 243,
            got: 244
        })
    );
}

#[test]
fn last_words_are_text() {
    for (at, valid_up_to) in [(1, 0), (13, 12), (28, 25)] {
        assert_eq!(
            patched("last_words", at, &[0xFF]),
            Err(WireError::NotText {
                field: "words",
                valid_up_to
            })
        );
    }
}

#[test]
fn what_no_step_of_an_upload_holds_is_refused_when_encoding() {
    let cases = [
        (
            ModelUpload::Begin {
                total_bytes: 0,
                sha256: [0; 32],
            },
            "total_bytes",
        ),
        (
            ModelUpload::Piece {
                offset_bytes: 0,
                bytes: [].into_iter().collect(),
            },
            "bytes",
        ),
        (
            ModelUpload::Piece {
                offset_bytes: u32::MAX,
                bytes: [7].into_iter().collect(),
            },
            "offset_bytes",
        ),
    ];
    for (step, expected) in cases {
        match bytes_of(&HEADER, &Packet::ModelUpload(step)) {
            Err(WireError::OutOfRange { field, .. }) => assert_eq!(field, expected),
            other => panic!("{expected}: {other:?}"),
        }
    }
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
