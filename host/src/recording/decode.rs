//! Messages to entries.

use serde::de::DeserializeOwned;
use serde_json::Value;

use crate::live::{HandSeen, Input, Message, RobotSeen, Timed};
use crate::robot::command::{Command, Quality};
use crate::robot::gate::{Cause, State};
use crate::robot::limits::Setpoint;

use super::channel::Channel;
use super::entry::Entry;

/// The entry that a message of a channel says, or what is wrong with it.
pub(super) fn decode(channel: Channel, at_us: u64, bytes: &[u8]) -> Result<Entry, String> {
    let input = match channel {
        Channel::Command => {
            let command = command(&parse(bytes)?)?;
            return Ok(Entry::Command { at_us, command });
        }
        Channel::Setpoint => {
            let value = parse(bytes)?;
            let (setpoint, state) = (setpoint(&value)?, state(&value)?);
            return Ok(Entry::Setpoint {
                at_us,
                setpoint,
                state,
            });
        }
        Channel::Recognition => {
            let recognition = parse(bytes)?;
            return Ok(Entry::Recognition { at_us, recognition });
        }
        Channel::Log => return Ok(Entry::Message(message(at_us, &parse(bytes)?)?)),
        Channel::Link => Input::Link(parse(bytes)?),
        Channel::Frame => Input::Frame(bytes.to_vec()),
        Channel::Tracker => Input::Tracker(parse(bytes)?),
        Channel::Palm => {
            let value: Value = parse(bytes)?;
            Input::Hand(Some(HandSeen {
                exposed_us: time_us(&value)?,
                position_m: position_m(&value)?,
            }))
        }
        Channel::Unseen => Input::Hand(None),
        Channel::RobotSeen => {
            let value: Value = parse(bytes)?;
            Input::Robot(RobotSeen {
                measured_us: time_us(&value)?,
                position_m: position_m(&value)?,
                stiffness_n_per_m: three(&value, "stiffness_n_per_m")?,
            })
        }
        Channel::Act => Input::Act(parse(bytes)?),
        Channel::Learnt => Input::Learnt(Ok(bytes.to_vec())),
        Channel::NotLearnt => {
            let value: Value = parse(bytes)?;
            Input::Learnt(Err(text(&value, "reason")?.to_owned()))
        }
        Channel::Stalled => Input::Stalled {
            since_us: whole(&parse(bytes)?, "since_us")?,
        },
    };
    Ok(Entry::Input(Timed { at_us, input }))
}

fn parse<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, String> {
    serde_json::from_slice(bytes).map_err(|error| error.to_string())
}

fn field<'a>(value: &'a Value, name: &str) -> Result<&'a Value, String> {
    value.get(name).ok_or_else(|| format!("no {name}"))
}

fn text<'a>(value: &'a Value, name: &str) -> Result<&'a str, String> {
    let found = field(value, name)?;
    found
        .as_str()
        .ok_or_else(|| format!("{name} is {found}, not text"))
}

fn whole(value: &Value, name: &str) -> Result<u64, String> {
    let found = field(value, name)?;
    found
        .as_u64()
        .ok_or_else(|| format!("{name} is {found}, not a whole number"))
}

fn whole_32(value: &Value, name: &str) -> Result<u32, String> {
    let found = whole(value, name)?;
    u32::try_from(found).map_err(|_| format!("{name} is {found}, above 32 bits"))
}

/// A number, or the bits of one that JSON has not.
fn number(value: &Value) -> Option<f64> {
    match value {
        Value::String(bits) => {
            let bits = u64::from_str_radix(bits.strip_prefix("0x")?, 16).ok()?;
            Some(f64::from_bits(bits))
        }
        other => other.as_f64(),
    }
}

fn real(value: &Value, name: &str) -> Result<f64, String> {
    let found = field(value, name)?;
    number(found).ok_or_else(|| format!("{name} is {found}, not a number"))
}

fn three(value: &Value, name: &str) -> Result<[f64; 3], String> {
    let found = field(value, name)?;
    let wrong = || format!("{name} is {found}, not three numbers");
    let [x, y, z] = found.as_array().map(Vec::as_slice).ok_or_else(wrong)? else {
        return Err(wrong());
    };
    match (number(x), number(y), number(z)) {
        (Some(x), Some(y), Some(z)) => Ok([x, y, z]),
        _ => Err(wrong()),
    }
}

fn time_us(value: &Value) -> Result<u64, String> {
    let time = field(value, "timestamp")?;
    let (seconds, nanoseconds) = (whole(time, "sec")?, whole(time, "nsec")?);
    let us = seconds.checked_mul(1_000_000);
    us.and_then(|us| us.checked_add(nanoseconds / 1000))
        .ok_or_else(|| format!("timestamp of {seconds} s is too large"))
}

fn position_m(value: &Value) -> Result<[f64; 3], String> {
    let position = field(field(value, "pose")?, "position")?;
    Ok([
        real(position, "x")?,
        real(position, "y")?,
        real(position, "z")?,
    ])
}

fn message(at_us: u64, value: &Value) -> Result<Message, String> {
    Ok(Message {
        at_us,
        problem: whole(value, "level")? >= 4,
        text: text(value, "message")?.to_owned(),
    })
}

fn command(value: &Value) -> Result<Command, String> {
    Ok(Command {
        position_m: three(value, "position_m")?,
        velocity_m_per_s: three(value, "velocity_m_per_s")?,
        stiffness_n_per_m: three(value, "stiffness_n_per_m")?,
        damping_ratio: real(value, "damping_ratio")?,
        acquired_us: whole(value, "acquired_us")?,
        valid_until_us: whole(value, "valid_until_us")?,
        sequence: whole_32(value, "sequence")?,
        boot_id: whole_32(value, "boot_id")?,
        quality: match text(value, "quality")? {
            "good" => Quality::Good,
            "undecided" => Quality::Undecided,
            "novel" => Quality::Novel,
            "signal_fault" => Quality::SignalFault,
            other => return Err(format!("quality is {other}")),
        },
    })
}

fn setpoint(value: &Value) -> Result<Setpoint, String> {
    Ok(Setpoint {
        position_m: three(value, "position_m")?,
        velocity_m_per_s: three(value, "velocity_m_per_s")?,
        stiffness_n_per_m: three(value, "stiffness_n_per_m")?,
        damping_ratio: real(value, "damping_ratio")?,
    })
}

fn state(value: &Value) -> Result<State, String> {
    Ok(match text(value, "state")? {
        "disarmed_start" => State::Disarmed(Cause::Start),
        "disarmed_person" => State::Disarmed(Cause::Person),
        "disarmed_stale" => State::Disarmed(Cause::Stale),
        "disarmed_disconnected" => State::Disarmed(Cause::Disconnected),
        "disarmed_other_boot" => State::Disarmed(Cause::OtherBoot),
        "disarmed_robot_silent" => State::Disarmed(Cause::RobotSilent),
        "disarmed_clock" => State::Disarmed(Cause::Clock),
        "following" => State::Following,
        "holding" => State::Holding,
        "falling_back" => State::FallingBack,
        other => return Err(format!("state is {other}")),
    })
}
