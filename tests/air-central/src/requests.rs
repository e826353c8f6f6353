//! What this host asks of the wearable.

use tonus_shared::wire::{
    Calibration, Header, MAX_FRAME_BYTES, Muscle, Packet, Ping, WireError, encode,
};

const BOOT_ID: u32 = 0xb007;
const PING_ID: u32 = 0x00c0_ffee;
const REQUESTED_US: u64 = 123_456_789;

/// The header of this host's frame of that number.
pub(crate) fn header(sequence: u32) -> Header {
    Header {
        boot_id: BOOT_ID,
        sequence,
        device_us: 0,
    }
}

pub(crate) fn frame(header: &Header, packet: &Packet) -> Result<Vec<u8>, WireError> {
    let mut bytes = vec![0; MAX_FRAME_BYTES];
    let length = encode(header, packet, &mut bytes)?;
    bytes.truncate(length);
    Ok(bytes)
}

/// The one that `central.py` writes too, whose bytes are in it.
pub(crate) fn calibration() -> Calibration {
    let of_four = |[a, b, c, d]: [f32; 4]| [a, b, c, d, 0.0, 0.0, 0.0, 0.0];
    Calibration {
        revision: 7,
        channels: 4,
        muscles: [
            Muscle::BicepsShort,
            Muscle::BicepsLong,
            Muscle::TricepsLateral,
            Muscle::TricepsLong,
            Muscle::Absent,
            Muscle::Absent,
            Muscle::Absent,
            Muscle::Absent,
        ],
        mains_hz: Some(50),
        semg_hz: 1000.0,
        rest_v: of_four([1e-5; 4]),
        mvc_v: of_four([5e-4; 4]),
        activation_window_s: 0.025,
        l1: 0.5,
        l2: 3.0,
        rest_stiffness_nm_per_rad: [20.0, 20.0, 20.0, 15.0],
        body_mass_kg: 75.0,
        body_height_m: 1.8,
    }
}

pub(crate) fn ping() -> Packet {
    Packet::Ping(Ping::Request {
        id: PING_ID,
        requested_us: REQUESTED_US,
    })
}
