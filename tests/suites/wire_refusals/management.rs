//! Refusals of the packets that set the wearable up.

use tonus_shared::wire::{Kind, ModelUpload, Packet, WireError, decode};
use tonus_tests::frames::{HEADER, bytes_of, sealed};

use super::{golden_body, patched, refused_by_field};

#[test]
fn what_no_request_holds_is_refused_when_decoding() {
    refused_by_field(&[
        ("control_raw", 0, &[0], "value"),
        ("control_send_calibration", 0, &[0], "command"),
        ("control_send_calibration", 0, &[7], "command"),
        ("control_raw", 1, &[2], "value"),
        ("control_send_calibration", 1, &[1], "value"),
        ("control_send_model_state", 4, &[1], "value"),
        ("control_send_last_words", 2, &[1], "value"),
        ("control_face_forward", 1, &[1], "value"),
        ("calibration", 4, &[0], "channels"),
        ("calibration", 4, &[9], "channels"),
        ("calibration", 4, &[3], "muscles"),
        ("calibration", 5, &[6], "muscles"),
        ("calibration", 13, &[55], "mains_hz"),
        ("calibration", 14, &f32::to_le_bytes(0.0), "semg_hz"),
        ("calibration", 14, &f32::to_le_bytes(1e6), "semg_hz"),
        ("calibration", 18, &f32::to_le_bytes(-1e-6), "rest_v"),
        ("calibration", 34, &f32::to_le_bytes(1e-6), "rest_v"),
        ("calibration", 50, &f32::to_le_bytes(1.5), "mvc_v"),
        ("calibration", 78, &f32::to_le_bytes(1e-6), "mvc_v"),
        (
            "calibration",
            82,
            &f32::to_le_bytes(0.0),
            "activation_window_s",
        ),
        ("calibration", 86, &f32::to_le_bytes(-0.5), "l1"),
        ("calibration", 90, &f32::to_le_bytes(0.0), "l2"),
        (
            "calibration",
            106,
            &f32::to_le_bytes(0.0),
            "rest_stiffness_nm_per_rad",
        ),
        (
            "calibration",
            94,
            &f32::to_le_bytes(1_001.0),
            "rest_stiffness_nm_per_rad",
        ),
        ("calibration", 110, &f32::to_le_bytes(0.0), "body_mass_kg"),
        (
            "calibration",
            114,
            &f32::to_le_bytes(175.0),
            "body_height_m",
        ),
    ]);
}

#[test]
fn what_no_model_or_reply_holds_is_refused_when_decoding() {
    refused_by_field(&[
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
    ]);
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
