//! Entries to messages.

use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};

use crate::live::{HandSeen, Input, Message, RobotSeen};
use crate::robot::command::{Command, Quality};
use crate::robot::gate::{Cause, State};
use crate::robot::limits::Setpoint;

use super::channel::Channel;
use super::entry::Entry;

/// The entry's channel and its bytes there, or none where JSON cannot say it: an act or a belief with a number that is
/// not finite.
pub(super) fn encode(entry: Entry) -> Option<(Channel, Vec<u8>)> {
    let (channel, value) = match entry {
        Entry::Input(timed) => return input(timed.input),
        Entry::Command { command, .. } => (Channel::Command, command_value(&command)),
        Entry::Setpoint {
            setpoint, state, ..
        } => (Channel::Setpoint, setpoint_value(&setpoint, state)),
        Entry::Recognition { recognition, .. } => {
            return Some((Channel::Recognition, exactly(&recognition)?));
        }
        Entry::Message(message) => (Channel::Log, log_value(&message)),
    };
    Some((channel, value.to_string().into_bytes()))
}

fn input(input: Input) -> Option<(Channel, Vec<u8>)> {
    let text = |value: Value| value.to_string().into_bytes();
    Some(match input {
        Input::Link(event) => (Channel::Link, exactly(&event)?),
        Input::Frame(bytes) => (Channel::Frame, bytes),
        Input::Tracker(event) => (Channel::Tracker, exactly(&event)?),
        Input::Hand(Some(hand)) => (Channel::Palm, text(palm_value(&hand))),
        Input::Hand(None) => (Channel::Unseen, text(json!({}))),
        Input::Robot(robot) => (Channel::RobotSeen, text(robot_value(&robot))),
        Input::Act(act) => (Channel::Act, exactly(&act)?),
        Input::Learnt(Ok(model)) => (Channel::Learnt, model),
        Input::Learnt(Err(reason)) => (Channel::NotLearnt, text(json!({ "reason": reason }))),
        Input::Stalled { since_us } => (Channel::Stalled, text(json!({ "since_us": since_us }))),
    })
}

/// As JSON, if it reads back as it was.
fn exactly<T: Serialize + DeserializeOwned + PartialEq>(what: &T) -> Option<Vec<u8>> {
    let bytes = serde_json::to_vec(what).ok()?;
    let same = serde_json::from_slice::<T>(&bytes).is_ok_and(|read| read == *what);
    same.then_some(bytes)
}

/// A number, or where JSON has none, its bits: nothing that came in is lost.
fn number(value: f64) -> Value {
    if value.is_finite() {
        json!(value)
    } else {
        json!(format!("{:#018x}", value.to_bits()))
    }
}

fn numbers(values: &[f64; 3]) -> Value {
    values.iter().copied().map(number).collect()
}

fn time(us: u64) -> Value {
    json!({ "sec": us / 1_000_000, "nsec": us % 1_000_000 * 1000 })
}

fn pose(position_m: &[f64; 3]) -> Value {
    let [x, y, z] = position_m.map(number);
    json!({
        "position": { "x": x, "y": y, "z": z },
        "orientation": { "x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0 },
    })
}

fn palm_value(hand: &HandSeen) -> Value {
    json!({ "timestamp": time(hand.exposed_us), "frame_id": "tracker", "pose": pose(&hand.position_m) })
}

fn robot_value(robot: &RobotSeen) -> Value {
    json!({
        "timestamp": time(robot.measured_us), "frame_id": "base_link", "pose": pose(&robot.position_m),
        "stiffness_n_per_m": numbers(&robot.stiffness_n_per_m),
    })
}

fn log_value(message: &Message) -> Value {
    json!({
        "timestamp": time(message.at_us), "level": if message.problem { 4 } else { 2 }, "message": message.text,
        "name": "tonus", "file": "", "line": 0,
    })
}

fn command_value(command: &Command) -> Value {
    json!({
        "position_m": numbers(&command.position_m),
        "velocity_m_per_s": numbers(&command.velocity_m_per_s),
        "stiffness_n_per_m": numbers(&command.stiffness_n_per_m),
        "damping_ratio": number(command.damping_ratio),
        "acquired_us": command.acquired_us,
        "valid_until_us": command.valid_until_us,
        "sequence": command.sequence,
        "boot_id": command.boot_id,
        "quality": match command.quality {
            Quality::Good => "good",
            Quality::Undecided => "undecided",
            Quality::Novel => "novel",
            Quality::SignalFault => "signal_fault",
        },
    })
}

fn setpoint_value(setpoint: &Setpoint, state: State) -> Value {
    json!({
        "position_m": numbers(&setpoint.position_m),
        "velocity_m_per_s": numbers(&setpoint.velocity_m_per_s),
        "stiffness_n_per_m": numbers(&setpoint.stiffness_n_per_m),
        "damping_ratio": number(setpoint.damping_ratio),
        "state": match state {
            State::Disarmed(Cause::Start) => "disarmed_start",
            State::Disarmed(Cause::Person) => "disarmed_person",
            State::Disarmed(Cause::Stale) => "disarmed_stale",
            State::Disarmed(Cause::Disconnected) => "disarmed_disconnected",
            State::Disarmed(Cause::OtherBoot) => "disarmed_other_boot",
            State::Disarmed(Cause::RobotSilent) => "disarmed_robot_silent",
            State::Disarmed(Cause::Clock) => "disarmed_clock",
            State::Following => "following",
            State::Holding => "holding",
            State::FallingBack => "falling_back",
        },
    })
}
