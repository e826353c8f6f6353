//! The golden frames of the wire protocol, and frames with correct checksums around any bytes.
#![allow(clippy::unwrap_used, reason = "read by tests only")]

use tonus_shared::semg::quality::Quality;
use tonus_shared::wire::{Header, MAX_FRAME_BYTES, Packet, Stream, StreamFlags, WireError, encode};

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
