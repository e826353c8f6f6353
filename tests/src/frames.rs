//! The golden frames of the wire protocol, and frames with correct checksums around any bytes.
#![allow(clippy::unwrap_used, reason = "read by tests only")]

use tonus_shared::semg::quality::Quality;
use tonus_shared::wire::{
    ActiveModel, Calibration, Control, Header, Kind, LastWords, MAX_FRAME_BYTES, ModelState,
    ModelUpload, Muscle, Packet, Reception, Refusal, Reply, Stream, StreamFlags, WireError, encode,
};

/// The header of every golden frame.
pub const HEADER: Header = Header {
    boot_id: 0xDEAD_BEEF,
    sequence: 0x0102_0304,
    device_us: 0x0000_0102_0304_0506,
};

/// `golden/wire_golden.txt`: name and bytes of each frame, written by `golden/wire_golden.py`.
///
/// # Panics
/// When the file is not what the script writes.
#[must_use]
pub fn golden() -> Vec<(&'static str, Vec<u8>)> {
    include_str!("../golden/wire_golden.txt")
        .lines()
        .map(|line| {
            let (name, hex) = line.split_once(' ').unwrap();
            let bytes = (0..hex.len())
                .step_by(2)
                .map(|at| u8::from_str_radix(&hex[at..at + 2], 16).unwrap())
                .collect();
            (name, bytes)
        })
        .collect()
}

/// One frame, encoded into a buffer just for it.
///
/// # Errors
/// As `wire::encode`.
pub fn bytes_of(header: &Header, packet: &Packet) -> Result<Vec<u8>, WireError> {
    let mut buffer = [0; MAX_FRAME_BYTES];
    encode(header, packet, &mut buffer).map(|length| buffer[..length].to_vec())
}

/// These bytes and their correct checksum: what a broken sender could make.
#[must_use]
pub fn sealed(mut body: Vec<u8>) -> Vec<u8> {
    let crc = crc32_bitwise(&body);
    body.extend(crc.to_le_bytes());
    body
}

/// CRC-32 by its definition: reflected polynomial 0xEDB88320, one bit at a time.
#[must_use]
pub fn crc32_bitwise(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(u32::MAX, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |crc, _| {
            if crc & 1 == 1 {
                (crc >> 1) ^ 0xEDB8_8320
            } else {
                crc >> 1
            }
        })
    })
}

/// Quality from its bits.
///
/// # Panics
/// When a bit has no meaning.
#[must_use]
pub fn quality(bits: [u8; 8]) -> [Quality; 8] {
    bits.map(|bits| Quality::from_bits(bits).unwrap())
}

/// The packet of the golden line `stream`.
#[must_use]
pub fn golden_stream() -> Packet {
    Packet::Stream(Stream {
        describes_before_us: 78_500,
        envelopes: [0.1, 0.25, 0.001, 1.0, 0.0, 0.0, 0.0, 0.0],
        activation: 0.5,
        co_contraction: 1.75,
        stiffness_n_per_m: [310.5, 222.25, 95.125],
        quality: quality([0, 1, 2, 0, 0, 0, 0, 0]),
        channels: 4,
        flags: StreamFlags::HAND_SEEN
            .with(StreamFlags::GAP, true)
            .with(StreamFlags::BLENDING, false)
            .with(StreamFlags::NEAR_SINGULAR, true),
    })
}

/// The packets of the golden lines from `control_raw` on.
#[must_use]
pub fn golden_management() -> Vec<Packet> {
    let controls = [
        Control::Raw(true),
        Control::SendCalibration,
        Control::SendModelState,
        Control::Restart {
            boot_id: 0xFEDC_BA98,
        },
        Control::SendLastWords,
        Control::FaceForward,
    ];
    let replies = [
        (Kind::ModelUpload, 0x0506_0708, Ok(()), 4_320),
        (Kind::Calibration, 7, Err(Refusal::OutOfRange), 0),
    ];
    let full = "x".repeat(128);
    let words = ["main.rs:7: Größe 3 > 2 ⚠", full.as_str(), ""];
    let mut packets: Vec<Packet> = controls.map(Packet::Control).into();
    packets.extend(golden_calibrations().map(Packet::Calibration));
    packets.extend(golden_uploads().map(Packet::ModelUpload));
    packets.extend(golden_model_states().map(Packet::ModelState));
    packets.extend(replies.map(|(answered, sequence, outcome, detail)| {
        Packet::Reply(Reply {
            answered,
            sequence,
            outcome,
            detail,
        })
    }));
    packets.extend(words.map(|words| {
        Packet::LastWords(LastWords {
            words: words.try_into().unwrap(),
        })
    }));
    packets
}

/// The golden lines `calibration` and `calibration_8_no_notch`.
#[must_use]
pub fn golden_calibrations() -> [Calibration; 2] {
    use Muscle::{Absent, BicepsLong, BicepsShort, Other, TricepsLateral, TricepsLong};
    let four = [BicepsShort, BicepsLong, TricepsLateral, TricepsLong];
    let [a, b, c, d] = four;
    [
        Calibration {
            revision: 0x0A0B_0C0D,
            channels: 4,
            muscles: [a, b, c, d, Absent, Absent, Absent, Absent],
            mains_hz: Some(60),
            semg_hz: 1000.0,
            rest_v: [1e-5, 2e-5, 0.0, 4e-6, 0.0, 0.0, 0.0, 0.0],
            mvc_v: [5e-4, 6e-4, 7e-4, 8e-4, 0.0, 0.0, 0.0, 0.0],
            activation_window_s: 0.025,
            l1: 0.75,
            l2: 1.5,
            rest_stiffness_nm_per_rad: [13.0, 13.5, 12.0, 11.5],
            body_mass_kg: 62.5,
            body_height_m: 1.625,
        },
        Calibration {
            revision: 0,
            channels: 8,
            muscles: [Other, Other, a, a, b, c, d, d],
            mains_hz: None,
            semg_hz: 2000.0,
            rest_v: [0.125; 8],
            mvc_v: [1.0; 8],
            activation_window_s: 0.5,
            l1: 0.0,
            l2: 2.25,
            rest_stiffness_nm_per_rad: [1.0, 2.0, 3.0, 4.0],
            body_mass_kg: 20.0,
            body_height_m: 2.5,
        },
    ]
}

fn golden_uploads() -> [ModelUpload; 5] {
    [
        ModelUpload::Begin {
            total_bytes: 90_001,
            sha256: std::array::from_fn(|at| 0x40 + at as u8),
        },
        ModelUpload::Piece {
            offset_bytes: 0x0001_02F0,
            bytes: [0x00, 0x01, 0xFE, 0xFF, 0x80].into_iter().collect(),
        },
        ModelUpload::Piece {
            offset_bytes: 0,
            bytes: (0..216).collect(),
        },
        ModelUpload::Finish,
        ModelUpload::Abandon,
    ]
}

fn golden_model_states() -> [ModelState; 2] {
    [
        ModelState {
            active: Some(ActiveModel {
                hash: [1, 2, 3, 4, 5, 6, 7, 8],
                skills: 3,
                dofs: 12,
                functions: 30,
                rank: 16,
            }),
            receiving: Some(Reception {
                hash: [0x81, 0x82, 0x83, 0x84, 0x85, 0x86, 0x87, 0x88],
                received_bytes: 4_320,
                total_bytes: 90_001,
            }),
            capacity_bytes: 163_840,
        },
        ModelState {
            active: None,
            receiving: None,
            capacity_bytes: 163_840,
        },
    ]
}
