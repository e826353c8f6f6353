//! What is to be played, as JSON: `[connection, ...]`, each `[step, ...]`.
//!
//! A step is `{"at_us": N, "act": A}`, counted from the opening of its connection, with A one of `"connection"`,
//! `"connection_lost"`, `"device"`, `"device_lost"`, `{"device_failure": STATUS}`, `{"code": ELEAPRS}`, `"no_frame"` (a message of
//! tracking that points nowhere), `{"frame": {...}}` and `{"recording": FILE}`. A frame is one of the WebSocket's protocol 6 (its `timestamp`
//! counts from the opening too, unless there is `"absolute": true`; a number that is null is NaN); `"count"` says how many
//! hands it claims, `"no_hands": true` that it points at none. A recording is a file of such frames, one a line, in its own pace.

use std::path::Path;

use serde::Deserialize;

#[derive(Clone, Deserialize)]
pub(crate) struct Step {
    pub(crate) at_us: u64,
    pub(crate) act: Act,
}

#[derive(Clone, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Act {
    Connection,
    ConnectionLost,
    Device,
    DeviceLost,
    DeviceFailure(u32),
    Code(u32),
    NoFrame,
    Frame(Box<Frame>),
    Recording(String),
}

#[derive(Clone, Deserialize)]
pub(crate) struct Frame {
    pub(crate) id: i64,
    pub(crate) timestamp: i64,
    #[serde(default)]
    pub(crate) absolute: bool,
    pub(crate) hands: Vec<Hand>,
    pub(crate) count: Option<u32>,
    #[serde(default)]
    pub(crate) no_hands: bool,
}

#[derive(Clone, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Hand {
    pub(crate) id: u32,
    #[serde(rename = "type")]
    pub(crate) side: String,
    pub(crate) palm_position: [Option<f64>; 3],
    #[serde(default = "zero")]
    pub(crate) palm_velocity: [Option<f64>; 3],
    #[serde(default = "zero")]
    pub(crate) palm_normal: [Option<f64>; 3],
    #[serde(default = "zero")]
    pub(crate) direction: [Option<f64>; 3],
    #[serde(default)]
    pub(crate) grab_strength: f32,
    #[serde(default)]
    pub(crate) pinch_strength: f32,
    #[serde(default)]
    pub(crate) confidence: f32,
}

fn zero() -> [Option<f64>; 3] {
    [Some(0.0); 3]
}

/// The scripts beside a library.
pub(crate) fn read(library: &Path) -> Vec<Vec<Step>> {
    let mut beside = library.as_os_str().to_owned();
    beside.push(".json");
    let text = std::fs::read_to_string(Path::new(&beside)).unwrap();
    let scripts: Vec<Vec<Step>> = serde_json::from_str(&text).unwrap();
    (scripts.into_iter())
        .map(|steps| steps.into_iter().flat_map(played).collect())
        .collect()
}

/// A step, or the frames that it stands for.
fn played(step: Step) -> Vec<Step> {
    let Act::Recording(file) = &step.act else {
        return vec![step];
    };
    let text = std::fs::read_to_string(file).unwrap();
    let frames: Vec<Frame> = (text.lines())
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    let first_us = frames[0].timestamp;
    (frames.into_iter())
        .map(|mut frame| {
            frame.timestamp += i64::try_from(step.at_us).unwrap() - first_us;
            Step {
                at_us: frame.timestamp.cast_unsigned(),
                act: Act::Frame(Box::new(frame)),
            }
        })
        .collect()
}
