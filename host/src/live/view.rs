//! What the engine shows, at most fifty times a second: the page and the terminal draw this, as JSON.
//!
//! Times are session time in microseconds or ages in milliseconds; places are metres, stiffness N/m. What is not known is
//! null, never zero.

use serde::{Deserialize, Serialize};

use crate::calibration::{CalibrationResult, StepView};

/// Everything there is to see.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[allow(
    missing_docs,
    reason = "fields are named by the types that tell of them"
)]
pub struct View {
    /// When this was so.
    pub at_us: u64,
    pub link: LinkView,
    pub clock: Option<ClockView>,
    pub tracker: TrackerView,
    pub semg: Option<SemgView>,
    pub trace: Trace,
    pub hand: Option<HandView>,
    pub calibration: CalibrationView,
    pub teaching: TeachingView,
    /// A demonstration on its way.
    pub recording: Option<RecordingView>,
    pub demonstrations: Vec<DemonstrationView>,
    pub library: LibraryView,
    pub recognition: Option<RecognitionView>,
    pub robot: RobotView,
    pub file: Option<FileView>,
    /// Newest scan to command, by the clock; null where there is none, as in a replay.
    pub latency: Option<LatencyView>,
    /// What somebody in the simulation is about to do; null with real devices.
    pub story: Option<String>,
    /// The newest messages, oldest first.
    pub messages: Vec<Message>,
}

/// How the wearable's link fares.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LinkView {
    /// As the command line names it: `sim`, `ble:Tonus`, `serial:/dev/ttyACM0`.
    pub link: String,
    /// Whether it is up.
    pub up: bool,
    /// Who is at the other end, or why nobody is and what to do.
    pub text: String,
    /// Largest attribute, bytes.
    pub mtu: Option<u16>,
    /// Connection interval, ms.
    pub interval_ms: Option<f64>,
    /// Frames received.
    pub received: u64,
    /// Frames lost by their sequence numbers.
    pub lost: u64,
    /// Frames that no decoder takes.
    pub refused: u64,
    /// Age of the newest scan, ms.
    pub age_ms: Option<f64>,
    /// Battery, mV.
    pub battery_mv: Option<u16>,
    /// What is wrong with the wearable, or awaits the host.
    pub warnings: Vec<String>,
    /// The passkey that pairing waits for; null where none is wanted. The digits themselves are in no view.
    pub passkey: Option<PasskeyView>,
}

/// A passkey that is wanted.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PasskeyView {
    /// The wearable that shows it.
    pub wanted_by: String,
    /// Time that is left to give it, seconds.
    pub left_s: f64,
}

/// How the wearable's clock compares.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ClockView {
    /// How much faster host time runs, parts per million.
    pub rate_ppm: f64,
    /// Of the earliest arrivals above the line, RMS, us.
    pub residual_us: f64,
    /// 95 % of instants are nearer, us.
    pub uncertainty_us: f64,
    /// Shortest way there and back, us.
    pub round_trip_us: Option<f64>,
    /// How much later than at first everything comes, by what round trips show, us: it counts as so much older.
    pub late_us: f64,
    /// Whether there is enough to tell a rate.
    pub settled: bool,
}

/// How the tracker fares.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TrackerView {
    /// Whether it answers.
    pub up: bool,
    /// What it is, or why there is none and what to do.
    pub text: String,
    /// Age of the newest picture of the hand, ms; null where it is not seen.
    pub age_ms: Option<f64>,
    /// Whether tracker and robot share a frame: taught by three points.
    pub taught: bool,
}

/// The newest of the muscles.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SemgView {
    /// In the wearable's order.
    pub channels: Vec<ChannelView>,
    /// Activation, eq. 4.
    pub activation: f64,
    /// Co-contraction factor, eq. 8.
    pub co_contraction: f64,
    /// Of the hand, shoulder frame.
    pub stiffness_n_per_m: [f64; 3],
    /// Whether the hand was seen; otherwise the elbow's angle is assumed.
    pub hand_seen: bool,
    /// Whether the stiffness is an old one that stands.
    pub held: bool,
    /// How long before the newest scan this describes, ms: the filters' delay.
    pub delay_ms: f64,
}

/// One channel.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ChannelView {
    /// Where it sits, for people.
    pub muscle: String,
    /// Share of the maximum voluntary contraction.
    pub envelope: f64,
    /// At a glance.
    pub lamp: Lamp,
    /// What is wrong, for people.
    pub warnings: Vec<String>,
}

/// A light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Lamp {
    /// All is well.
    Good,
    /// Usable, with a warning.
    Warn,
    /// Not usable.
    Bad,
    /// Nothing is known.
    #[default]
    Off,
}

/// Signals since the view before; times are session time, seconds, increasing.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Trace {
    /// Times of stream packets.
    pub t_s: Vec<f64>,
    /// `envelopes[channel][sample]`, shares of the maximum.
    pub envelopes: Vec<Vec<f32>>,
    /// `stiffness[axis][sample]`, N/m.
    pub stiffness_n_per_m: Vec<Vec<f32>>,
    /// Times of scans; empty while the wearable sends no raw sEMG.
    pub raw_t_s: Vec<f64>,
    /// `raw_uv[channel][sample]`, microvolts at the electrodes.
    pub raw_uv: Vec<Vec<f32>>,
}

/// The hand.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct HandView {
    /// Shoulder frame.
    pub position_m: [f64; 3],
    /// Age of its picture, ms.
    pub age_ms: f64,
    /// Robot's base frame; null until three points were touched.
    pub in_robot_m: Option<[f64; 3]>,
}

/// What is taught by touching: where shoulder and robot are in the tracker's frame.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TeachingView {
    /// What is being touched.
    pub touching: Option<TouchView>,
    /// The shoulder that was touched and is not used yet, tracker's frame.
    pub shoulder_m: Option<[f64; 3]>,
    /// The points that were touched.
    pub points: Vec<PointView>,
    /// How well they fit each other, root mean square, mm; null until they teach something.
    pub residual_mm: Option<f64>,
    /// Why the last touch or the points teach nothing, and what to do.
    pub problem: Option<String>,
    /// Whether there is something to use.
    pub may_use: bool,
    /// What became of what was used last: the file that keeps it, or why none does.
    pub kept: Option<String>,
}

/// A touch on its way.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TouchView {
    /// What is touched, for people.
    pub what: String,
    /// For how much of the time that it takes the hand has been still, from 0 to 1.
    pub still: f64,
}

/// A touched point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PointView {
    /// Where it is, robot's base frame.
    pub robot_m: [f64; 3],
    /// Where the tracker saw the hand.
    pub tracker_m: [f64; 3],
    /// How far the two lie apart under what all points teach, mm; null until they teach something.
    pub off_mm: Option<f64>,
}

/// The guided calibration.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CalibrationView {
    /// Whom the calibration in use is for; null for the illustrative one of nobody.
    pub in_use: Option<String>,
    /// Whether the wearable has yet to answer: until then nothing is begun, measured or used.
    pub waiting: bool,
    /// Who was measured before and can be recalled, sorted.
    pub people: Vec<String>,
    /// The step under way, if somebody calibrates.
    pub step: Option<StepView>,
    /// What was measured, once it is; after that, what stands behind the calibration in use, if it was measured here.
    pub result: Option<CalibrationResult>,
    /// Whether the wearable sits as it did, once that was checked.
    pub fit: Option<FitView>,
}

/// Whether the wearable sits as it did.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FitView {
    /// At a glance.
    pub lamp: Lamp,
    /// For people: what is wrong and what to do.
    pub text: String,
}

/// A demonstration on its way.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RecordingView {
    /// Its label.
    pub label: String,
    /// So long, seconds.
    pub seconds: f64,
    /// Instants so far at which hand, stiffness and robot were seen.
    pub rows: usize,
}

/// A demonstration.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DemonstrationView {
    /// Names it.
    pub id: u32,
    /// Its label.
    pub label: String,
    /// How long it was recorded, seconds.
    pub seconds: f64,
    /// Instants in it.
    pub rows: usize,
    /// The part that is kept, seconds since its begin.
    pub kept_s: [f64; 2],
    /// Speed of the hand at `speed_t_s`, m/s: where to trim.
    pub speed_m_per_s: Vec<f32>,
    /// Times of these, seconds since its begin.
    pub speed_t_s: Vec<f32>,
    /// Why it cannot be learnt from.
    pub problem: Option<String>,
}

/// The skills.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LibraryView {
    /// Each skill and how many demonstrations it was learnt from.
    pub skills: Vec<(String, u32)>,
    /// Whether they are being learnt.
    pub learning: bool,
    /// Why that failed, and what to do.
    pub problem: Option<String>,
    /// Of demonstrations left out in turn, recognised and all; null if not asked.
    pub held_out: Option<[usize; 2]>,
}

/// What the person does.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RecognitionView {
    /// Skills.
    pub labels: Vec<String>,
    /// Probability of each.
    pub posterior: Vec<f64>,
    /// Whether a movement is under way.
    pub under_way: bool,
    /// Share of it that is over.
    pub phase: Option<f64>,
    /// What was decided on: the skill, and seconds since the movement began.
    pub decision: Option<(String, f64)>,
    /// None of the skills.
    pub unknown: bool,
    /// Too much of it was missed to say whether it is one of them.
    #[serde(default)]
    pub unjudged: bool,
    /// What it is nearest to, if unknown.
    pub nearest: Option<String>,
    /// Novelty's score over its threshold.
    pub novelty: Option<f64>,
    /// Where the hand is expected from now on.
    pub human_path: Vec<PathPoint>,
    /// Where the robot is expected from now on.
    pub robot_path: Vec<PathPoint>,
    /// How firm the robot is expected to be, at the points of `robot_path`.
    pub robot_stiffness_n_per_m: Vec<[f64; 3]>,
    /// Movements recognised so far: label, or null for unknown.
    pub history: Vec<Option<String>>,
}

/// A point of an expected path.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PathPoint {
    /// Seconds from now.
    pub in_s: f64,
    /// Mean.
    pub mean_m: [f64; 3],
    /// Standard deviation.
    pub std_m: [f64; 3],
}

/// The robot and the gate before it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RobotView {
    /// Which robot: `simulated`, `udp:127.0.0.1:5005`.
    pub robot: String,
    /// `disarmed`, `following`, `holding`, `falling_back`.
    pub state: String,
    /// Why it is so, for people.
    pub reason: String,
    /// Whether arming would be granted now.
    pub can_arm: bool,
    /// Where the robot's hand is, base frame.
    pub position_m: [f64; 3],
    /// Places of the arm's joints from base to hand, base frame.
    pub joints_m: Vec<[f64; 3]>,
    /// What it is told: where.
    pub setpoint_m: [f64; 3],
    /// How firmly.
    pub stiffness_n_per_m: [f64; 3],
    /// Age of the evidence behind it, ms.
    pub age_ms: Option<f64>,
    /// Commands that the gate refused.
    pub refused: u64,
}

/// The recording on disk.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FileView {
    /// Its path.
    pub path: String,
    /// Bytes so far.
    pub bytes: u64,
    /// Why nothing is written any more.
    pub problem: Option<String>,
}

/// How old the newest scan was when its command was made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LatencyView {
    /// Median of the newest, ms.
    pub p50_ms: f64,
    /// 99th percentile, ms.
    pub p99_ms: f64,
    /// Commands so far.
    pub commands: u64,
}

/// Something to tell.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Message {
    /// When.
    pub at_us: u64,
    /// Whether it is a problem.
    pub problem: bool,
    /// What.
    pub text: String,
}
