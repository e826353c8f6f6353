//! The table of channels: what is written where and in what form.

use serde_json::{Value, json};

/// Name of the profile in the header of every recording.
pub(super) const PROFILE: &str = "tonus";
/// Version of what this table says. A change that old readers would misread raises it.
pub(super) const FORMAT: &str = "1";
/// Name of the metadata record that opens a recording.
pub(super) const OPENING: &str = "tonus";
/// Names of the attachments that follow it.
pub(super) const CONFIGURATION: &str = "configuration.toml";
pub(super) const CALIBRATION: &str = "calibration";
pub(super) const MODEL: &str = "model.safetensors";

/// A channel of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Channel {
    Link,
    Frame,
    Tracker,
    Palm,
    Unseen,
    RobotSeen,
    Act,
    Learnt,
    NotLearnt,
    Stalled,
    Command,
    Setpoint,
    Recognition,
    Log,
}

impl Channel {
    pub(super) const ALL: [Self; 14] = [
        Self::Link,
        Self::Frame,
        Self::Tracker,
        Self::Palm,
        Self::Unseen,
        Self::RobotSeen,
        Self::Act,
        Self::Learnt,
        Self::NotLearnt,
        Self::Stalled,
        Self::Command,
        Self::Setpoint,
        Self::Recognition,
        Self::Log,
    ];

    /// Its topic, by which it is found again.
    pub(super) const fn topic(self) -> &'static str {
        match self {
            Self::Link => "/wearable/link",
            Self::Frame => "/wearable/frame",
            Self::Tracker => "/tracker/link",
            Self::Palm => "/tracker/palm",
            Self::Unseen => "/tracker/unseen",
            Self::RobotSeen => "/robot/seen",
            Self::Act => "/person/act",
            Self::Learnt => "/model/learnt",
            Self::NotLearnt => "/model/not_learnt",
            Self::Stalled => "/program/stalled",
            Self::Command => "/robot/command",
            Self::Setpoint => "/robot/setpoint",
            Self::Recognition => "/model/recognition",
            Self::Log => "/log",
        }
    }

    /// How its messages are encoded. What is not JSON is bytes: frames as docs/wire.md has them, models as safetensors.
    pub(super) const fn encoding(self) -> &'static str {
        match self {
            Self::Frame => "tonus-frame",
            Self::Learnt => "safetensors",
            _ => "json",
        }
    }

    /// Name of its schema and the schema as JSON Schema; none for bytes.
    pub(super) fn schema(self) -> Option<(&'static str, Value)> {
        Some(match self {
            Self::Frame | Self::Learnt => return None,
            Self::Palm => ("foxglove.PoseInFrame", pose(json!({}))),
            Self::RobotSeen => (
                "foxglove.PoseInFrame",
                pose(json!({ "stiffness_n_per_m": three("Diagonal stiffness, N/m") })),
            ),
            Self::Log => ("foxglove.Log", log()),
            Self::Link => (
                "tonus.Link",
                object(json!({ "link": { "type": "string" } })),
            ),
            Self::Tracker => (
                "tonus.Tracker",
                object(json!({ "tracker": { "type": "string" } })),
            ),
            Self::Unseen => ("tonus.Unseen", object(json!({}))),
            Self::Act => ("tonus.Act", object(json!({ "act": { "type": "string" } }))),
            Self::NotLearnt => (
                "tonus.NotLearnt",
                object(json!({ "reason": { "type": "string" } })),
            ),
            Self::Stalled => (
                "tonus.Stalled",
                object(json!({ "since_us": { "type": "integer", "minimum": 0 } })),
            ),
            Self::Command => ("tonus.Command", command()),
            Self::Setpoint => ("tonus.Setpoint", setpoint()),
            Self::Recognition => ("tonus.Recognition", recognition()),
        })
    }
}

fn object(properties: Value) -> Value {
    json!({ "type": "object", "properties": properties })
}

fn number(description: &str) -> Value {
    json!({ "type": "number", "description": description })
}

fn three(description: &str) -> Value {
    json!({
        "type": "array", "items": { "type": "number" }, "minItems": 3, "maxItems": 3, "description": description,
    })
}

/// Seconds and nanoseconds, as Foxglove's schemas have them.
fn time() -> Value {
    json!({
        "type": "object", "title": "time",
        "properties": { "sec": { "type": "integer", "minimum": 0 },
                        "nsec": { "type": "integer", "minimum": 0, "maximum": 999_999_999 } },
    })
}

/// Foxglove's pose in a frame, and what stands beside it.
fn pose(beside: Value) -> Value {
    let axes = |names: &[&str]| {
        let properties: serde_json::Map<_, _> = (names.iter())
            .map(|&name| (name.to_owned(), json!({ "type": "number" })))
            .collect();
        json!({ "type": "object", "properties": properties })
    };
    let mut properties = json!({
        "timestamp": time(),
        "frame_id": { "type": "string" },
        "pose": object(json!({
            "position": axes(&["x", "y", "z"]),
            "orientation": axes(&["x", "y", "z", "w"]),
        })),
    });
    if let (Value::Object(all), Value::Object(more)) = (&mut properties, beside) {
        all.extend(more);
    }
    object(properties)
}

/// Foxglove's log.
fn log() -> Value {
    object(json!({
        "timestamp": time(),
        "level": { "type": "integer", "description": "2 information, 4 error" },
        "message": { "type": "string" },
        "name": { "type": "string" },
        "file": { "type": "string" },
        "line": { "type": "integer", "minimum": 0 },
    }))
}

fn impedance() -> serde_json::Map<String, Value> {
    let mut all = serde_json::Map::new();
    all.insert("position_m".into(), three("Robot's base frame, m"));
    all.insert("velocity_m_per_s".into(), three("m/s"));
    all.insert("stiffness_n_per_m".into(), three("Diagonal stiffness, N/m"));
    all.insert(
        "damping_ratio".into(),
        number("Share of the critical damping"),
    );
    all
}

fn command() -> Value {
    let mut all = impedance();
    for name in ["acquired_us", "valid_until_us", "sequence", "boot_id"] {
        all.insert(name.into(), json!({ "type": "integer", "minimum": 0 }));
    }
    all.insert("quality".into(), json!({ "type": "string" }));
    object(all.into())
}

fn setpoint() -> Value {
    let mut all = impedance();
    all.insert("state".into(), json!({ "type": "string" }));
    object(all.into())
}

fn recognition() -> Value {
    object(json!({
        "labels": { "type": "array", "items": { "type": "string" } },
        "posterior": { "type": "array", "items": { "type": "number" } },
        "under_way": { "type": "boolean" },
        "unknown": { "type": "boolean" },
    }))
}
