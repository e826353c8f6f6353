//! What a packet may hold. One check serves sender and receiver.

use crate::semg::quality::Quality;

use super::error::WireError;
use super::packet::{
    Calibration, Configuration, HandPosition, Inference, ModelState, ModelUpload, Muscle,
    Orientation, Packet, Ping, RawSemg, Status, StatusFlags, Stream, StreamFlags,
};
use super::table::{MAX_CHANNELS, MAX_PIECE_BYTES};

/// Stiffness of a hand, N/m: above this a number is an error, not an arm (measured arms: < 3 kN/m).
pub const MAX_STIFFNESS_N_PER_M: f32 = 1e6;
/// A hand this far from its shoulder, m per axis, is an error in units or frame.
const MAX_REACH_M: f32 = 3.0;
/// An envelope of more than this many maximum voluntary contractions is an error.
pub const MAX_ENVELOPE: f32 = 1e3;
/// The activation sums four muscle heads.
const MAX_ACTIVATION: f32 = 4.0 * MAX_ENVELOPE;
/// A co-contraction factor above this is an error.
pub const MAX_CO_CONTRACTION: f32 = 1e3;
/// How far the norm of a quaternion may lie from one.
pub(crate) const QUATERNION_SLACK: f32 = 1e-3;
/// How far rounding may lift a log probability above zero.
const LOG_POSTERIOR_SLACK: f32 = 1e-3;
/// Scans per second: above this a rate is an error.
const MAX_RATE_HZ: f32 = 1e5;
/// An envelope at an electrode of more than this is an error, V.
const MAX_LEVEL_V: f32 = 1.0;
/// An activation window of more than this is an error, s.
const MAX_WINDOW_S: f32 = 10.0;
/// Joint stiffness at rest: above this a number is an error, N m/rad.
const MAX_JOINT_STIFFNESS_NM_PER_RAD: f32 = 1e3;
/// Slope of the co-contraction curve: above this it is a step.
const MAX_SLOPE: f32 = 1e6;
/// No person is heavier, kg, or taller, m.
const MAX_BODY: (f32, f32) = (1e3, 10.0);
/// Counts of the widest converter: 24 bits, signed.
const COUNT_RANGE: (i32, i32) = (-(1 << 23), (1 << 23) - 1);

impl Packet {
    /// Refuses what neither side may send.
    pub(super) fn check(&self) -> Result<(), WireError> {
        match self {
            Self::Configuration(packet) => configuration(packet),
            Self::Stream(packet) => stream(packet),
            Self::RawSemg(packet) => raw_semg(packet),
            Self::Orientation(packet) => orientation(packet),
            Self::HandPosition(packet) => hand_position(packet),
            Self::Ping(packet) => ping(packet),
            Self::Inference(packet) => inference(packet),
            Self::Status(packet) => status(packet),
            Self::Calibration(packet) => calibration(packet),
            Self::ModelUpload(packet) => model_upload(packet),
            Self::ModelState(packet) => model_state(packet),
            // Their types hold nothing else.
            Self::Control(_) | Self::Reply(_) | Self::LastWords(_) => Ok(()),
        }
    }
}

/// The error of a number outside its limits.
pub(super) fn out_of_range(
    field: &'static str,
    got: impl Into<f64>,
    low: impl Into<f64>,
    high: impl Into<f64>,
) -> WireError {
    WireError::OutOfRange {
        field,
        got: got.into(),
        low: low.into(),
        high: high.into(),
    }
}

fn within(field: &'static str, value: f32, low: f32, high: f32) -> Result<(), WireError> {
    if !value.is_finite() {
        return Err(WireError::NonFinite { field });
    }
    if (low..=high).contains(&value) {
        Ok(())
    } else {
        Err(out_of_range(field, value, low, high))
    }
}

fn positive(field: &'static str, value: f32, high: f32) -> Result<(), WireError> {
    within(field, value, f32::MIN_POSITIVE, high)
}

fn channels(channels: u8) -> Result<usize, WireError> {
    let count = usize::from(channels);
    if (1..=MAX_CHANNELS).contains(&count) {
        Ok(count)
    } else {
        Err(out_of_range("channels", channels, 1, MAX_CHANNELS as f64))
    }
}

fn configuration(packet: &Configuration) -> Result<(), WireError> {
    positive("semg_hz", packet.semg_hz, MAX_RATE_HZ)?;
    positive("stream_hz", packet.stream_hz, 1e4)?;
    positive("volts_per_count", packet.volts_per_count, 1.0)?;
    muscles(packet.channels, &packet.muscles)?;
    mains(packet.mains_hz)
}

/// Exactly the slots from `channels` on are absent. Gives the number of channels.
fn muscles(count: u8, muscles: &[Muscle; MAX_CHANNELS]) -> Result<usize, WireError> {
    let used = channels(count)?;
    for (slot, muscle) in muscles.iter().enumerate() {
        if (*muscle == Muscle::Absent) != (slot >= used) {
            let (low, high) = if slot < used { (1, 5) } else { (0, 0) };
            return Err(out_of_range("muscles", *muscle as u8, low, high));
        }
    }
    Ok(used)
}

fn mains(mains_hz: Option<u8>) -> Result<(), WireError> {
    match mains_hz {
        None | Some(50 | 60) => Ok(()),
        Some(hz) => Err(out_of_range("mains_hz", hz, 50, 60)),
    }
}

fn stream(packet: &Stream) -> Result<(), WireError> {
    let used = channels(packet.channels)?;
    for (slot, (envelope, quality)) in packet.envelopes.iter().zip(packet.quality).enumerate() {
        let limit = if slot < used { MAX_ENVELOPE } else { 0.0 };
        within("envelopes", *envelope, 0.0, limit)?;
        if slot >= used && quality != Quality::GOOD {
            return Err(out_of_range("quality", quality.bits(), 0, 0));
        }
    }
    within("activation", packet.activation, 0.0, MAX_ACTIVATION)?;
    within(
        "co_contraction",
        packet.co_contraction,
        1.0,
        MAX_CO_CONTRACTION,
    )?;
    stiffness(packet.stiffness_n_per_m)?;
    if packet.flags.bits() & !StreamFlags::KNOWN != 0 {
        return Err(out_of_range(
            "flags",
            packet.flags.bits(),
            0,
            StreamFlags::KNOWN,
        ));
    }
    Ok(())
}

fn stiffness(diagonal: [f32; 3]) -> Result<(), WireError> {
    diagonal
        .into_iter()
        .try_for_each(|value| positive("stiffness_n_per_m", value, MAX_STIFFNESS_N_PER_M))
}

fn raw_semg(packet: &RawSemg) -> Result<(), WireError> {
    let used = channels(packet.channels)?;
    let counts = packet.counts.len();
    if counts == 0 || !counts.is_multiple_of(used) {
        let nearest = (counts / used).max(1) * used;
        return Err(out_of_range(
            "counts",
            counts as f64,
            nearest as f64,
            nearest as f64,
        ));
    }
    let (low, high) = COUNT_RANGE;
    for count in &packet.counts {
        if !(low..=high).contains(count) {
            return Err(out_of_range("counts", *count, low, high));
        }
    }
    Ok(())
}

fn orientation(packet: &Orientation) -> Result<(), WireError> {
    for value in packet.xyzw {
        within(
            "xyzw",
            value,
            -1.0 - QUATERNION_SLACK,
            1.0 + QUATERNION_SLACK,
        )?;
    }
    let norm = libm::sqrtf(packet.xyzw.iter().map(|value| value * value).sum());
    within(
        "norm of xyzw",
        norm,
        1.0 - QUATERNION_SLACK,
        1.0 + QUATERNION_SLACK,
    )
}

fn hand_position(packet: &HandPosition) -> Result<(), WireError> {
    packet
        .position_m
        .into_iter()
        .flatten()
        .try_for_each(|value| within("position_m", value, -MAX_REACH_M, MAX_REACH_M))
}

fn ping(packet: &Ping) -> Result<(), WireError> {
    match *packet {
        Ping::Reply {
            received_us,
            replied_us,
            ..
        } if replied_us < received_us => Err(out_of_range(
            "replied_us",
            replied_us as f64,
            received_us as f64,
            u64::MAX as f64,
        )),
        Ping::Request { .. } | Ping::Reply { .. } => Ok(()),
    }
}

fn inference(packet: &Inference) -> Result<(), WireError> {
    if packet.skills == 0 {
        return Err(out_of_range("skills", packet.skills, 1, u8::MAX));
    }
    if packet.top.is_empty() || packet.top.len() > usize::from(packet.skills) {
        return Err(out_of_range(
            "top",
            packet.top.len() as f64,
            1,
            packet.skills,
        ));
    }
    let mut above = LOG_POSTERIOR_SLACK;
    for entry in &packet.top {
        if entry.skill >= packet.skills {
            return Err(out_of_range("skill", entry.skill, 0, packet.skills - 1));
        }
        within("log_posterior", entry.log_posterior, f32::MIN, above)?;
        above = entry.log_posterior;
    }
    within("phase", packet.phase, 0.0, 1.0)?;
    stiffness(packet.stiffness_n_per_m)
}

fn status(packet: &Status) -> Result<(), WireError> {
    let bits = packet.flags.bits();
    if bits & !StatusFlags::KNOWN != 0 {
        return Err(out_of_range("flags", bits, 0, StatusFlags::KNOWN));
    }
    Ok(())
}

fn calibration(packet: &Calibration) -> Result<(), WireError> {
    let used = muscles(packet.channels, &packet.muscles)?;
    mains(packet.mains_hz)?;
    positive("semg_hz", packet.semg_hz, MAX_RATE_HZ)?;
    for (slot, (rest, mvc)) in packet.rest_v.into_iter().zip(packet.mvc_v).enumerate() {
        let limit = if slot < used { MAX_LEVEL_V } else { 0.0 };
        within("rest_v", rest, 0.0, limit)?;
        within("mvc_v", mvc, 0.0, limit)?;
    }
    positive(
        "activation_window_s",
        packet.activation_window_s,
        MAX_WINDOW_S,
    )?;
    within("l1", packet.l1, 0.0, MAX_CO_CONTRACTION)?;
    positive("l2", packet.l2, MAX_SLOPE)?;
    for stiffness in packet.rest_stiffness_nm_per_rad {
        positive(
            "rest_stiffness_nm_per_rad",
            stiffness,
            MAX_JOINT_STIFFNESS_NM_PER_RAD,
        )?;
    }
    let (max_mass_kg, max_height_m) = MAX_BODY;
    positive("body_mass_kg", packet.body_mass_kg, max_mass_kg)?;
    positive("body_height_m", packet.body_height_m, max_height_m)
}

fn model_upload(packet: &ModelUpload) -> Result<(), WireError> {
    match packet {
        ModelUpload::Begin { total_bytes: 0, .. } => {
            Err(out_of_range("total_bytes", 0, 1, u32::MAX))
        }
        ModelUpload::Piece { bytes, .. } if bytes.is_empty() => {
            Err(out_of_range("bytes", 0, 1, MAX_PIECE_BYTES as f64))
        }
        ModelUpload::Piece {
            offset_bytes,
            bytes,
        } => {
            let room = u32::MAX - bytes.len() as u32;
            if *offset_bytes > room {
                return Err(out_of_range("offset_bytes", *offset_bytes, 0, room));
            }
            Ok(())
        }
        ModelUpload::Begin { .. } | ModelUpload::Finish | ModelUpload::Abandon => Ok(()),
    }
}

fn model_state(packet: &ModelState) -> Result<(), WireError> {
    if let Some(active) = &packet.active {
        for (field, size) in [
            ("skills", active.skills),
            ("dofs", active.dofs),
            ("functions", active.functions),
            ("rank", active.rank),
        ] {
            if size == 0 {
                return Err(out_of_range(field, size, 1, u8::MAX));
            }
        }
    }
    let Some(receiving) = &packet.receiving else {
        return Ok(());
    };
    let total = receiving.total_bytes;
    if total == 0 || total > packet.capacity_bytes {
        return Err(out_of_range("total_bytes", total, 1, packet.capacity_bytes));
    }
    if receiving.received_bytes > total {
        return Err(out_of_range(
            "received_bytes",
            receiving.received_bytes,
            0,
            total,
        ));
    }
    Ok(())
}
