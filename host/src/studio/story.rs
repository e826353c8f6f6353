//! The whole story, told by a simulated person who also presses the buttons: connect, calibrate, record, train, arm, follow,
//! disarm.
//!
//! It sees what a person at the page sees and does what they can do, nothing else.

use crate::live::{Act, Person, View};

/// Skills of the story and how often each is shown.
const SHOWN: [&str; 3] = ["lift_filter", "lift_bottle", "hand_over"];
const TIMES: usize = 5;
/// What is performed once the robot follows; the last is in no demonstration.
const PERFORMED: [&str; 6] = [
    "lift_bottle",
    "hand_over",
    "lift_filter",
    "hand_over",
    "lift_bottle",
    "wave",
];
/// From the question for a movement to its end at the latest, seconds.
const MOVEMENT_S: f64 = 6.5;
/// How long a recording goes on after the question, seconds.
const RECORD_S: f64 = 5.2;
/// Nothing in the story takes longer, seconds.
const PATIENCE_S: f64 = 200.0;

/// Between two presses of a button, microseconds.
const THINKS_US: u64 = 300_000;

/// Where the story is.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Chapter {
    Connect,
    Calibrate,
    /// So many demonstrations are there.
    Record(usize),
    /// This one is on its way.
    Recording(usize),
    Train,
    Arm,
    /// About to ask for this one.
    Ask(usize),
    /// Asked for.
    Follow(usize),
    Disarm,
    Over,
}

/// One telling.
#[derive(Debug)]
pub struct Story {
    chapter: Chapter,
    since_us: u64,
    /// Whether it has begun: it may be told in the midst of a run.
    begun: bool,
    acted_us: u64,
    asked: Vec<&'static str>,
    found: Vec<Option<String>>,
    stuck: Option<String>,
    /// When the movement under way began, and how long the longest since the question took.
    moving: Option<u64>,
    longest_us: u64,
}

/// What came of it.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Told {
    /// What was performed.
    pub performed: Vec<String>,
    /// What each was taken for; null for unknown.
    pub recognised: Vec<Option<String>>,
    /// Where the story stopped before its end, and why.
    pub stuck: Option<String>,
}

impl Default for Story {
    fn default() -> Self {
        Self {
            chapter: Chapter::Connect,
            since_us: 0,
            begun: false,
            acted_us: 0,
            asked: Vec::new(),
            found: Vec::new(),
            stuck: None,
            moving: None,
            longest_us: 0,
        }
    }
}

impl Story {
    /// What the person does now that they see this.
    pub fn look(&mut self, view: &View) -> Vec<Act> {
        if !std::mem::replace(&mut self.begun, true) {
            self.since_us = view.at_us;
        }
        #[allow(clippy::cast_precision_loss, reason = "seconds")]
        let since_s = view.at_us.saturating_sub(self.since_us) as f64 * 1e-6;
        if since_s > PATIENCE_S && self.chapter != Chapter::Over {
            let problem = view.messages.iter().rev().find(|m| m.problem);
            let why = problem.map_or("nothing happened", |message| message.text.as_str());
            self.stuck = Some(format!("{}: {why}", self.text()));
            self.turn(Chapter::Over, view.at_us);
            return vec![Act::Disarm];
        }
        if view.at_us < self.acted_us + THINKS_US {
            return Vec::new();
        }
        let acts = self.act(view, since_s);
        if !acts.is_empty() {
            self.acted_us = view.at_us;
        }
        acts
    }

    fn act(&mut self, view: &View, since_s: f64) -> Vec<Act> {
        let at_us = view.at_us;
        match self.chapter {
            Chapter::Connect => {
                let seen = view.link.up && view.tracker.up && view.semg.is_some();
                if seen && since_s > 3.0 {
                    self.turn(Chapter::Calibrate, at_us);
                }
            }
            Chapter::Calibrate => return self.calibrate(view),
            Chapter::Record(number) if number >= SHOWN.len() * TIMES => {
                self.turn(Chapter::Train, at_us);
                return vec![Act::Train];
            }
            Chapter::Record(number) => {
                self.turn(Chapter::Recording(number), at_us);
                let label = SHOWN[number % SHOWN.len()].to_owned();
                return vec![Act::Record { label }];
            }
            Chapter::Recording(number) => {
                if view.demonstrations.len() > number {
                    self.turn(Chapter::Record(number + 1), at_us);
                } else if since_s > RECORD_S && view.recording.is_some() {
                    return vec![Act::Stop];
                }
            }
            Chapter::Train => {
                if !view.library.learning && !view.library.skills.is_empty() {
                    self.turn(Chapter::Arm, at_us);
                }
            }
            Chapter::Arm => {
                if view.robot.state != "disarmed" {
                    self.turn(Chapter::Ask(0), at_us);
                } else if view.robot.can_arm {
                    return vec![Act::Arm];
                }
            }
            Chapter::Ask(number) => {
                let Some(&label) = PERFORMED.get(number) else {
                    self.turn(Chapter::Disarm, at_us);
                    return vec![Act::Disarm];
                };
                let resting = view.recognition.as_ref().is_some_and(|r| !r.under_way);
                if resting && since_s > 0.5 {
                    self.asked.push(label);
                    self.found.push(None);
                    (self.moving, self.longest_us) = (None, 0);
                    self.turn(Chapter::Follow(number), at_us);
                    let label = label.to_owned();
                    return vec![Act::Ask { label }];
                }
            }
            Chapter::Follow(number) => {
                self.watch(view, number);
                if since_s > MOVEMENT_S {
                    self.turn(Chapter::Ask(number + 1), at_us);
                }
            }
            Chapter::Disarm => self.turn(Chapter::Over, at_us),
            Chapter::Over => {}
        }
        Vec::new()
    }

    /// What the page says of the longest movement after the question: on the way to its start and back the hand moves too.
    fn watch(&mut self, view: &View, number: usize) {
        let recognition = view.recognition.as_ref().filter(|r| r.under_way);
        let Some(recognition) = recognition else {
            self.moving = None;
            return;
        };
        let began_us = self.moving.get_or_insert(view.at_us);
        let lasted_us = view.at_us - *began_us;
        let best = (recognition.labels.iter().zip(&recognition.posterior))
            .max_by(|a, b| a.1.total_cmp(b.1))
            .filter(|_| !recognition.unknown);
        let slot = self.found.get_mut(number);
        if let Some(slot) = slot.filter(|_| lasted_us >= self.longest_us) {
            self.longest_us = lasted_us;
            *slot = best.map(|(label, _)| label.clone());
        }
    }

    fn calibrate(&mut self, view: &View) -> Vec<Act> {
        let calibration = &view.calibration;
        if calibration.waiting {
            return Vec::new();
        }
        if calibration.in_use.is_some() && calibration.step.is_none() {
            self.turn(Chapter::Record(0), view.at_us);
            return Vec::new();
        }
        match &calibration.step {
            None => vec![Act::Calibrate(Person {
                name: "simulated".to_owned(),
                body_mass_kg: 75.0,
                body_height_m: 1.75,
                mains_hz: Some(50),
            })],
            Some(_) if !view.link.up => Vec::new(),
            Some(step) if step.measuring => Vec::new(),
            Some(step) if step.name == "result" => vec![Act::CalibrationUse],
            Some(step) if step.done => vec![Act::CalibrationNext],
            Some(_) => vec![Act::CalibrationStep],
        }
    }

    fn turn(&mut self, chapter: Chapter, at_us: u64) {
        self.chapter = chapter;
        self.since_us = at_us;
    }

    /// What happens now, for people.
    #[must_use]
    pub fn text(&self) -> String {
        match self.chapter {
            Chapter::Connect => "wearable and hand tracker connect".to_owned(),
            Chapter::Calibrate => "the person is measured: rest, strength, stiffness".to_owned(),
            Chapter::Record(number) | Chapter::Recording(number) => format!(
                "demonstration {} of {}: {}",
                number + 1,
                SHOWN.len() * TIMES,
                SHOWN[number % SHOWN.len()]
            ),
            Chapter::Train => "the skills are learnt".to_owned(),
            Chapter::Arm => "the robot is armed".to_owned(),
            Chapter::Ask(number) | Chapter::Follow(number) => match PERFORMED.get(number) {
                Some(&"wave") => "the person waves: no demonstration shows that".to_owned(),
                Some(label) => format!("the person performs {label}, the robot follows"),
                None => "the robot is disarmed".to_owned(),
            },
            Chapter::Disarm => "the robot is disarmed".to_owned(),
            Chapter::Over => "the story is told; the buttons are yours".to_owned(),
        }
    }

    /// Whether it is told, or cannot go on.
    #[must_use]
    pub fn over(&self) -> bool {
        self.chapter == Chapter::Over
    }

    /// What came of it so far.
    #[must_use]
    pub fn told(&self) -> Told {
        Told {
            performed: self.asked.iter().map(|&label| label.to_owned()).collect(),
            recognised: self.found.clone(),
            stuck: self.stuck.clone(),
        }
    }
}
