//! The bytes of each payload, field by field: `put` writes what `take` reads.

mod management;

use heapless::Vec;

use crate::semg::quality::Quality;

use super::bytes::{Reader, Writer};
use super::check::out_of_range;
use super::error::WireError;
use super::packet::{
    Configuration, HandPosition, Inference, Muscle, Orientation, Packet, Ping, RawSemg,
    ResetReason, SkillPosterior, Status, StatusFlags, Stream, StreamFlags,
};
use super::table::{Kind, MAX_CHANNELS, MAX_RAW_COUNTS, MAX_SKILLS, row, whole};

/// Bytes of the payload of a checked packet.
pub(super) fn payload_bytes(packet: &Packet) -> usize {
    match packet {
        Packet::RawSemg(raw) => raw_payload_bytes(raw.counts.len()),
        Packet::ModelUpload(step) => management::upload_payload_bytes(step),
        Packet::LastWords(last) => management::words_payload_bytes(last.words.len()),
        other => row(other.kind()).payload_max,
    }
}

const fn raw_payload_bytes(counts: usize) -> usize {
    4 + 1 + 1 + 3 * counts
}

/// Writes the payload of a checked packet.
pub(super) fn put(packet: &Packet, out: &mut Writer<'_>) {
    match packet {
        Packet::Configuration(packet) => put_configuration(packet, out),
        Packet::Stream(packet) => put_stream(packet, out),
        Packet::RawSemg(packet) => put_raw_semg(packet, out),
        Packet::Orientation(packet) => out.f32s(packet.xyzw),
        Packet::HandPosition(packet) => {
            out.u8(u8::from(packet.position_m.is_some()));
            out.f32s(packet.position_m.unwrap_or_default());
        }
        Packet::Ping(packet) => put_ping(*packet, out),
        Packet::Inference(packet) => put_inference(packet, out),
        Packet::Status(packet) => put_status(packet, out),
        Packet::Control(packet) => management::put_control(*packet, out),
        Packet::Calibration(packet) => management::put_calibration(packet, out),
        Packet::ModelUpload(packet) => management::put_upload(packet, out),
        Packet::ModelState(packet) => management::put_model_state(packet, out),
        Packet::Reply(packet) => management::put_reply(packet, out),
        Packet::LastWords(packet) => management::put_words(packet, out),
    }
}

/// Reads a payload of `length` bytes; the result is not yet checked against its limits.
pub(super) fn take(kind: Kind, input: &mut Reader<'_>, length: usize) -> Result<Packet, WireError> {
    Ok(match kind {
        Kind::Configuration => Packet::Configuration(take_configuration(input)?),
        Kind::Stream => Packet::Stream(take_stream(input)?),
        Kind::RawSemg => Packet::RawSemg(take_raw_semg(input, length)?),
        Kind::Orientation => Packet::Orientation(Orientation {
            xyzw: input.f32s()?,
        }),
        Kind::HandPosition => Packet::HandPosition(take_hand_position(input)?),
        Kind::Ping => Packet::Ping(take_ping(input)?),
        Kind::Inference => Packet::Inference(take_inference(input)?),
        Kind::Status => Packet::Status(take_status(input)?),
        Kind::Control => Packet::Control(management::take_control(input)?),
        Kind::Calibration => Packet::Calibration(management::take_calibration(input)?),
        Kind::ModelUpload => Packet::ModelUpload(management::take_upload(input, length)?),
        Kind::ModelState => Packet::ModelState(management::take_model_state(input)?),
        Kind::Reply => Packet::Reply(management::take_reply(input)?),
        Kind::LastWords => Packet::LastWords(management::take_words(input, length)?),
    })
}

fn put_configuration(packet: &Configuration, out: &mut Writer<'_>) {
    out.f32s([packet.semg_hz, packet.stream_hz, packet.volts_per_count]);
    out.i32(packet.offset_counts);
    out.u32(packet.chain_delay_us);
    out.u8(packet.channels);
    out.bytes(packet.muscles.map(|muscle| muscle as u8));
    out.u8(packet.mains_hz.unwrap_or(0));
    out.u8(u8::from(packet.raw));
    out.bytes(packet.firmware_hash);
}

fn take_configuration(input: &mut Reader<'_>) -> Result<Configuration, WireError> {
    let [semg_hz, stream_hz, volts_per_count] = input.f32s()?;
    Ok(Configuration {
        semg_hz,
        stream_hz,
        volts_per_count,
        offset_counts: input.i32()?,
        chain_delay_us: input.u32()?,
        channels: input.u8()?,
        muscles: take_muscles(input)?,
        mains_hz: Some(input.u8()?).filter(|hz| *hz != 0),
        raw: take_bool("raw", input)?,
        firmware_hash: input.bytes()?,
    })
}

fn take_muscles(input: &mut Reader<'_>) -> Result<[Muscle; MAX_CHANNELS], WireError> {
    let mut muscles = [Muscle::Absent; MAX_CHANNELS];
    for muscle in &mut muscles {
        *muscle = match input.u8()? {
            0 => Muscle::Absent,
            1 => Muscle::BicepsShort,
            2 => Muscle::BicepsLong,
            3 => Muscle::TricepsLateral,
            4 => Muscle::TricepsLong,
            5 => Muscle::Other,
            got => return Err(out_of_range("muscles", got, 0, 5)),
        };
    }
    Ok(muscles)
}

fn take_quality(input: &mut Reader<'_>) -> Result<[Quality; MAX_CHANNELS], WireError> {
    let mut quality = [Quality::GOOD; MAX_CHANNELS];
    for channel in &mut quality {
        let bits = input.u8()?;
        *channel = Quality::from_bits(bits).ok_or_else(|| out_of_range("quality", bits, 0, 15))?;
    }
    Ok(quality)
}

fn take_bool(field: &'static str, input: &mut Reader<'_>) -> Result<bool, WireError> {
    match input.u8()? {
        0 => Ok(false),
        1 => Ok(true),
        got => Err(out_of_range(field, got, 0, 1)),
    }
}

fn put_stream(packet: &Stream, out: &mut Writer<'_>) {
    out.u32(packet.describes_before_us);
    out.f32s(packet.envelopes);
    out.f32s([packet.activation, packet.co_contraction]);
    out.f32s(packet.stiffness_n_per_m);
    out.bytes(packet.quality.map(Quality::bits));
    out.u8(packet.channels);
    out.u16(packet.flags.bits());
}

fn take_stream(input: &mut Reader<'_>) -> Result<Stream, WireError> {
    Ok(Stream {
        describes_before_us: input.u32()?,
        envelopes: input.f32s()?,
        activation: input.f32()?,
        co_contraction: input.f32()?,
        stiffness_n_per_m: input.f32s()?,
        quality: take_quality(input)?,
        channels: input.u8()?,
        flags: StreamFlags::from_bits(input.u16()?),
    })
}

fn put_raw_semg(packet: &RawSemg, out: &mut Writer<'_>) {
    let scans = packet.counts.len() / usize::from(packet.channels.max(1));
    out.u32(packet.first_index);
    out.u8(packet.channels);
    out.u8(u8::try_from(scans).unwrap_or(u8::MAX));
    for count in &packet.counts {
        out.i24(*count);
    }
}

fn take_raw_semg(input: &mut Reader<'_>, length: usize) -> Result<RawSemg, WireError> {
    let first_index = input.u32()?;
    let channels = input.u8()?;
    let scans = input.u8()?;
    let told = usize::from(channels) * usize::from(scans);
    if told == 0 || told > MAX_RAW_COUNTS {
        return Err(out_of_range(
            "scans",
            scans,
            1,
            (MAX_RAW_COUNTS / usize::from(channels.max(1))) as f64,
        ));
    }
    if raw_payload_bytes(told) != length {
        return Err(WireError::WrongLength {
            kind: Kind::RawSemg,
            expected: whole(raw_payload_bytes(told)),
            got: whole(length),
        });
    }
    let mut counts = Vec::new();
    for _ in 0..told {
        let count = input.i24()?;
        counts
            .push(count)
            .map_err(|_| out_of_range("scans", scans, 1, MAX_RAW_COUNTS as f64))?;
    }
    Ok(RawSemg {
        first_index,
        channels,
        counts,
    })
}

fn take_hand_position(input: &mut Reader<'_>) -> Result<HandPosition, WireError> {
    let seen = take_bool("seen", input)?;
    let position_m: [f32; 3] = input.f32s()?;
    if !seen && let Some(value) = position_m.into_iter().find(|value| value.to_bits() != 0) {
        return Err(out_of_range("position_m of a hand not seen", value, 0, 0));
    }
    Ok(HandPosition {
        position_m: seen.then_some(position_m),
    })
}

fn put_ping(packet: Ping, out: &mut Writer<'_>) {
    let (role, id, times) = match packet {
        Ping::Request { id, requested_us } => (0, id, [requested_us, 0, 0]),
        Ping::Reply {
            id,
            requested_us,
            received_us,
            replied_us,
        } => (1, id, [requested_us, received_us, replied_us]),
    };
    out.u8(role);
    out.u32(id);
    for time in times {
        out.u64(time);
    }
}

fn take_ping(input: &mut Reader<'_>) -> Result<Ping, WireError> {
    let reply = take_bool("role", input)?;
    let id = input.u32()?;
    let [requested_us, received_us, replied_us] = [input.u64()?, input.u64()?, input.u64()?];
    if reply {
        return Ok(Ping::Reply {
            id,
            requested_us,
            received_us,
            replied_us,
        });
    }
    let later = received_us.max(replied_us);
    if later != 0 {
        return Err(out_of_range(
            "times of the replier in a request",
            later as f64,
            0,
            0,
        ));
    }
    Ok(Ping::Request { id, requested_us })
}

fn put_inference(packet: &Inference, out: &mut Writer<'_>) {
    out.u8(packet.skills);
    out.u8(u8::try_from(packet.top.len()).unwrap_or(u8::MAX));
    for slot in 0..MAX_SKILLS {
        let entry = packet.top.get(slot);
        out.u8(entry.map_or(0, |entry| entry.skill));
        out.f32(entry.map_or(0.0, |entry| entry.log_posterior));
    }
    out.f32(packet.phase);
    out.f32s(packet.stiffness_n_per_m);
}

fn take_inference(input: &mut Reader<'_>) -> Result<Inference, WireError> {
    let skills = input.u8()?;
    let used = input.u8()?;
    if usize::from(used) > MAX_SKILLS {
        return Err(out_of_range("top", used, 1, MAX_SKILLS as f64));
    }
    let mut top = Vec::new();
    for slot in 0..MAX_SKILLS {
        let entry = SkillPosterior {
            skill: input.u8()?,
            log_posterior: input.f32()?,
        };
        if slot < usize::from(used) {
            top.push(entry)
                .map_err(|_| out_of_range("top", used, 1, MAX_SKILLS as f64))?;
        } else if entry.skill != 0 || entry.log_posterior.to_bits() != 0 {
            return Err(out_of_range("unused skill", entry.skill, 0, 0));
        }
    }
    Ok(Inference {
        skills,
        top,
        phase: input.f32()?,
        stiffness_n_per_m: input.f32s()?,
    })
}

fn put_status(packet: &Status, out: &mut Writer<'_>) {
    out.u32(packet.uptime_s);
    out.u16(packet.battery_mv.unwrap_or(0));
    out.u8(packet.reset_reason as u8);
    out.u32(packet.overruns);
    out.u32(packet.gaps);
    out.u32(packet.missed_scans);
    out.u32(packet.refused);
    out.u32(packet.dropped_packets);
    out.bytes(packet.quality.map(Quality::bits));
    out.u8(packet.flags.bits());
    out.u32(packet.dropped_hypotheses);
    out.u32(packet.refused_requests);
    out.u16(packet.links);
    out.u32(packet.lost_reports);
}

fn take_status(input: &mut Reader<'_>) -> Result<Status, WireError> {
    Ok(Status {
        uptime_s: input.u32()?,
        battery_mv: Some(input.u16()?).filter(|mv| *mv != 0),
        reset_reason: match input.u8()? {
            0 => ResetReason::Unknown,
            1 => ResetReason::PowerOn,
            2 => ResetReason::Pin,
            3 => ResetReason::Watchdog,
            4 => ResetReason::Software,
            5 => ResetReason::Lockup,
            6 => ResetReason::Wake,
            got => return Err(out_of_range("reset_reason", got, 0, 6)),
        },
        overruns: input.u32()?,
        gaps: input.u32()?,
        missed_scans: input.u32()?,
        refused: input.u32()?,
        dropped_packets: input.u32()?,
        quality: take_quality(input)?,
        flags: StatusFlags::from_bits(input.u8()?),
        dropped_hypotheses: input.u32()?,
        refused_requests: input.u32()?,
        links: input.u16()?,
        lost_reports: input.u32()?,
    })
}
