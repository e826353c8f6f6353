//! The scripted program: what people do changes what is shown, as `tonus run` does it.

use tonus::live::{
    Act, ChannelView, ClockView, DemonstrationView, FileView, HandView, Lamp, LatencyView,
    LibraryView, LinkView, Message, RecognitionView, RecordingView, RobotView, SemgView,
    TrackerView, View,
};

use crate::calibration::Guided;
use crate::motion::{self, Muscles};
use crate::teaching::Taught;

const MUSCLES: [&str; 8] = [
    "biceps short head",
    "biceps long head",
    "triceps lateral head",
    "triceps long head",
    "brachioradialis",
    "deltoid anterior",
    "deltoid posterior",
    "pectoralis",
];
/// A learning and the way to a decision last so long, seconds.
const LEARN_S: f64 = 1.0;
const DECIDE_S: f64 = 0.8;

/// What was done so far.
pub(crate) struct Stand {
    muscles: Muscles,
    channels: usize,
    now_s: f64,
    calibration: Guided,
    teaching: Taught,
    recording: Option<(String, f64)>,
    demonstrations: Vec<DemonstrationView>,
    recorded: u32,
    library: LibraryView,
    learning_since_s: Option<f64>,
    armed: bool,
    history: Vec<Option<String>>,
    /// The newest movement in it.
    told: usize,
    messages: Vec<Message>,
    sends_raw: bool,
}

impl Stand {
    pub(crate) fn new(channels: usize) -> Self {
        Self {
            muscles: Muscles::new(channels),
            channels,
            now_s: 0.0,
            calibration: Guided::new(channels),
            teaching: Taught::default(),
            recording: None,
            demonstrations: Vec::new(),
            recorded: 0,
            library: LibraryView::default(),
            learning_since_s: None,
            armed: false,
            history: Vec::new(),
            told: 0,
            messages: Vec::new(),
            sends_raw: false,
        }
    }

    pub(crate) fn act(&mut self, act: Act) {
        match act {
            Act::Calibrate(person) => self.calibration.begin(Some(person.name), false, self.now_s),
            Act::Recall { name, .. } => self.calibration.recall(name),
            Act::CheckFit => self.calibration.begin(None, true, self.now_s),
            Act::CalibrationStep => {
                if !self.calibration.start(self.now_s) {
                    self.tell(true, "wait until the wearable has answered");
                }
            }
            Act::CalibrationNext => {
                if !self.calibration.next_step() {
                    self.tell(true, "This step is not measured yet.");
                }
            }
            Act::CalibrationBack => {
                if !self.calibration.back() {
                    self.tell(true, "this is the first step");
                }
            }
            Act::CalibrationUse => {
                self.calibration.use_result(self.now_s);
                self.tell(false, "The calibration is in use and kept on the wearable.");
            }
            Act::CalibrationCancel => self.calibration.cancel(),
            Act::TeachShoulder
            | Act::TeachPoint { .. }
            | Act::TeachRemove { .. }
            | Act::TeachUse
            | Act::TeachCancel => self.teaching.act(&act, self.now_s),
            Act::Record { label } => self.recording = Some((label, self.now_s)),
            Act::Stop => self.stop(),
            Act::Trim { id, from_s, to_s } => {
                self.change(id, |it| it.kept_s = [from_s.max(0.0), to_s.min(it.seconds)]);
            }
            Act::Label { id, label } => self.change(id, |it| it.label = label),
            Act::Discard { id } => self.demonstrations.retain(|each| each.id != id),
            Act::Train => self.learning_since_s = Some(self.now_s),
            Act::Ask { label } => self.tell(false, &format!("Asked for {label}.")),
            Act::Raw { on } => self.sends_raw = on,
            Act::Arm => self.arm(),
            Act::Disarm if self.armed => {
                self.armed = false;
                self.tell(false, "Disarmed by a person.");
            }
            Act::Disarm => {}
        }
    }

    fn tell(&mut self, problem: bool, text: &str) {
        let at_us = (self.now_s * 1e6) as u64;
        let text = text.to_owned();
        self.messages.push(Message {
            at_us,
            problem,
            text,
        });
    }

    fn arm(&mut self) {
        self.armed = !self.library.skills.is_empty();
        if self.armed {
            self.history.clear();
            self.tell(false, "Armed by a person.");
        } else {
            self.tell(
                true,
                "Not armed: no skill is learnt yet. Record demonstrations and train.",
            );
        }
    }

    fn stop(&mut self) {
        let Some((label, since_s)) = self.recording.take() else {
            return self.tell(true, "Nothing is recorded now.");
        };
        self.recorded += 1;
        let seconds = self.now_s - since_s;
        let times = 0..=(seconds * 20.0) as u32;
        let speed_t_s: Vec<f32> = times.map(|i| i as f32 / 20.0).collect();
        let bump = |t: &f32| 0.9 * (std::f32::consts::PI * t / seconds as f32).sin().powi(2);
        self.demonstrations.push(DemonstrationView {
            id: self.recorded,
            label,
            seconds,
            rows: (seconds * 100.0) as usize,
            kept_s: [0.0, seconds],
            speed_m_per_s: speed_t_s.iter().map(bump).collect(),
            speed_t_s,
            problem: (seconds < 0.2).then(|| "Too short: 0.2 s at least. Record it again.".into()),
        });
    }

    fn change(&mut self, id: u32, change: impl FnOnce(&mut DemonstrationView)) {
        match self.demonstrations.iter_mut().find(|each| each.id == id) {
            Some(each) => change(each),
            None => self.tell(true, "There is no such demonstration."),
        }
    }

    fn learn(&mut self) {
        self.library.learning = self.learning_since_s.is_some();
        if self
            .learning_since_s
            .is_none_or(|since_s| self.now_s < since_s + LEARN_S)
        {
            return;
        }
        self.learning_since_s = None;
        let mut skills: Vec<(String, u32)> = Vec::new();
        for each in &self.demonstrations {
            match skills.iter_mut().find(|(label, _)| *label == each.label) {
                Some((_, count)) => *count += 1,
                None => skills.push((each.label.clone(), 1)),
            }
        }
        let all = self.demonstrations.len();
        self.library = LibraryView {
            skills,
            held_out: Some([all, all]),
            ..LibraryView::default()
        };
    }

    pub(crate) fn view(&mut self, at_us: u64) -> View {
        self.now_s = at_us as f64 / 1e6;
        self.calibration.measure(self.now_s);
        self.teaching.look(self.now_s);
        self.learn();
        let effort = self.calibration.effort();
        let (number, share) = motion::phase(self.now_s);
        let recognition = self.recognition(number, share);
        let unknown = recognition.as_ref().is_some_and(|it| it.unknown);
        View {
            at_us,
            link: link(at_us),
            clock: Some(ClockView {
                rate_ppm: 38.2,
                residual_us: 210.0,
                uncertainty_us: 640.0,
                round_trip_us: Some(15_300.0),
                late_us: 0.0,
                settled: self.now_s > 3.0,
            }),
            tracker: TrackerView {
                up: true,
                text: "simulated tracker, 110 pictures a second".into(),
                age_ms: Some(9.0),
                taught: self.teaching.view.kept.is_some(),
            },
            semg: Some(self.semg(effort)),
            trace: self.muscles.trace(at_us, effort, self.sends_raw),
            hand: Some(HandView {
                position_m: motion::hand_m(share.unwrap_or(0.0)),
                age_ms: 9.0,
                in_robot_m: None,
            }),
            calibration: self.calibration.view.clone(),
            teaching: self.teaching.view.clone(),
            recording: self
                .recording
                .as_ref()
                .map(|(label, since_s)| RecordingView {
                    label: label.clone(),
                    seconds: self.now_s - since_s,
                    rows: ((self.now_s - since_s) * 100.0) as usize,
                }),
            demonstrations: self.demonstrations.clone(),
            library: self.library.clone(),
            recognition,
            robot: self.robot(share.unwrap_or(0.0), unknown),
            file: Some(FileView {
                path: "/home/ada/tonus/2026-11-26_19-00-00_ada.mcap".into(),
                bytes: at_us / 20,
                problem: None,
            }),
            latency: Some(LatencyView {
                p50_ms: 24.0,
                p99_ms: 41.0,
                commands: at_us / 10_000,
            }),
            story: share.is_some().then(|| "the person lifts the book".into()),
            messages: self.messages.iter().rev().take(20).rev().cloned().collect(),
        }
    }

    fn semg(&self, effort: f64) -> SemgView {
        let channel = |i: usize| ChannelView {
            muscle: MUSCLES[i % 8].into(),
            envelope: self.muscles.envelope(i, self.now_s, effort),
            lamp: if i == 2 { Lamp::Warn } else { Lamp::Good },
            warnings: if i == 2 {
                vec!["mains hum: check this electrode's contact".into()]
            } else {
                Vec::new()
            },
        };
        SemgView {
            channels: (0..self.channels).map(channel).collect(),
            activation: self.muscles.envelope(0, self.now_s, effort),
            co_contraction: 1.4,
            stiffness_n_per_m: self.muscles.stiffness(self.now_s, effort),
            hand_seen: self.now_s % 6.0 < 3.0,
            held: false,
            delay_ms: 45.0,
        }
    }

    /// Every fourth movement is none of the skills.
    fn recognition(&mut self, number: usize, share: Option<f64>) -> Option<RecognitionView> {
        let labels: Vec<String> = self
            .library
            .skills
            .iter()
            .map(|(label, _)| label.clone())
            .collect();
        let count = labels.len();
        let done = number % count.max(1);
        let time_s = share.unwrap_or(0.0) * motion::MOVEMENT_S;
        let decided = share.is_some() && time_s > DECIDE_S;
        let unknown = decided && number % 4 == 3;
        if share.is_some_and(|share| share > 0.97) && self.told < number {
            self.told = number;
            self.history
                .push((!unknown).then(|| labels.get(done).cloned()).flatten());
        }
        let sure = if decided {
            0.94
        } else {
            (1.0 / count.max(1) as f64).max(time_s)
        };
        let rest = (1.0 - sure) / (count.max(2) - 1) as f64;
        let ahead = |place| share.map_or(Vec::new(), |share| motion::ahead(share, place));
        (count > 0).then(|| RecognitionView {
            posterior: (0..count)
                .map(|i| if i == done { sure } else { rest })
                .collect(),
            under_way: share.is_some(),
            phase: share,
            decision: (decided && !unknown).then(|| (labels[done].clone(), DECIDE_S)),
            unknown,
            unjudged: false,
            nearest: unknown.then(|| labels[done].clone()),
            novelty: share.map(|_| if unknown { 1.7 } else { 0.4 }),
            human_path: ahead(motion::hand_m),
            robot_path: ahead(motion::robot_m),
            robot_stiffness_n_per_m: ahead(motion::firmness)
                .iter()
                .map(|point| point.mean_m)
                .collect(),
            history: self.history.clone(),
            labels,
        })
    }

    fn robot(&self, share: f64, unknown: bool) -> RobotView {
        let (state, reason) = match (self.armed, unknown, self.library.skills.is_empty()) {
            (true, true, _) => ("holding", "the movement is none of the skills"),
            (true, false, _) => ("following", "evidence is fresh"),
            (false, _, true) => ("disarmed", "no skill is learnt yet"),
            (false, _, false) => ("disarmed", "a person must arm it"),
        };
        let position_m = motion::robot_m(if self.armed { share } else { 0.0 });
        RobotView {
            robot: "simulated".into(),
            state: state.into(),
            reason: reason.into(),
            can_arm: !self.armed && !self.library.skills.is_empty(),
            position_m,
            joints_m: motion::joints_m(position_m),
            setpoint_m: position_m,
            stiffness_n_per_m: motion::firmness(share),
            age_ms: Some(24.0),
            refused: 0,
        }
    }
}

fn link(at_us: u64) -> LinkView {
    LinkView {
        link: "sim".into(),
        up: true,
        text: "simulated wearable, firmware 0.1.0".into(),
        mtu: Some(247),
        interval_ms: Some(15.0),
        received: at_us / 10_000,
        lost: at_us / 400_000,
        age_ms: Some(17.0),
        battery_mv: Some(3910),
        ..LinkView::default()
    }
}
