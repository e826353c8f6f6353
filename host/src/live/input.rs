//! What happens to a running program, with its time. The engine is a function of these and of nothing else, so a
//! recording of them plays as it ran.

use serde::{Deserialize, Serialize};

use crate::calibration::{Person, Profile};

/// An input and when it happened.
#[derive(Clone, Debug, PartialEq)]
pub struct Timed {
    /// Session time: microseconds since the program started, by the host's monotonic clock. Never falls.
    pub at_us: u64,
    /// What happened.
    pub input: Input,
}

/// Everything that can happen to a running program.
#[derive(Clone, Debug, PartialEq)]
pub enum Input {
    /// The wearable's link came up or went down.
    Link(LinkEvent),
    /// One frame as it came from the wearable, unchecked.
    Frame(Vec<u8>),
    /// The hand tracker's connection came up or went down.
    Tracker(TrackerEvent),
    /// The tracker took a picture: the hand, or none where it is not seen.
    Hand(Option<HandSeen>),
    /// The robot told where it is: while it is shown what to do, this is its part of a demonstration.
    Robot(RobotSeen),
    /// A person did something, on the page or in the terminal.
    Act(Act),
    /// Learning ended: skills as their file has them, or why there is none.
    Learnt(Result<Vec<u8>, String>),
    /// The program stalled: nothing happened from then until now, and the robot was told nothing.
    Stalled {
        /// Session time of the last moment before, microseconds.
        since_us: u64,
    },
}

/// How the wearable's link fares.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "link", rename_all = "snake_case")]
pub enum LinkEvent {
    /// Connected; frames may follow.
    Up {
        /// Who is at the other end, for people.
        name: String,
        /// Largest attribute that it carries, bytes; none where there is no such limit.
        mtu: Option<u16>,
        /// Connection interval, microseconds; none where there is none or nobody says.
        interval_us: Option<u32>,
    },
    /// Not connected; another attempt follows by itself.
    Down {
        /// Why, and what to do.
        reason: String,
    },
}

/// How the tracker's connection fares.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "tracker", rename_all = "snake_case")]
pub enum TrackerEvent {
    /// It answers.
    Up {
        /// What it is, for people.
        name: String,
    },
    /// It does not answer; another attempt follows by itself.
    Down {
        /// Why, and what to do.
        reason: String,
    },
}

/// One picture of the hand.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct HandSeen {
    /// When the picture was taken, session time, microseconds.
    pub exposed_us: u64,
    /// The palm in the tracker's frame, metres.
    pub position_m: [f64; 3],
}

/// Where the robot is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RobotSeen {
    /// When it was there, session time, microseconds.
    pub measured_us: u64,
    /// Its hand in its base frame, metres.
    pub position_m: [f64; 3],
    /// Diagonal stiffness that it keeps, N/m.
    pub stiffness_n_per_m: [f64; 3],
}

impl Input {
    /// Whom it names as the one who wears the wearable.
    #[must_use]
    pub fn wearer(&self) -> Option<&Person> {
        match self {
            Self::Act(Act::Calibrate(person)) => Some(person),
            Self::Act(Act::Recall { profile, .. }) => Some(&profile.as_ref()?.person),
            _ => None,
        }
    }
}

/// What a person does. As JSON: `{"act": "record", "label": "lift_book"}`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "act", rename_all = "snake_case", deny_unknown_fields)]
pub enum Act {
    /// Begin the guided calibration of a person.
    Calibrate(Person),
    /// Use what was measured of a person before. Whoever runs the engine looks it up.
    Recall {
        /// Their name.
        name: String,
        /// What is kept of them; none if nothing is.
        #[serde(default)]
        profile: Option<Box<Profile>>,
    },
    /// Begin the check whether the wearable sits as it did when it was calibrated.
    CheckFit,
    /// Begin the step of the calibration that is shown, or do it again.
    CalibrationStep,
    /// The step that was measured is good: on to the next one that is not measured.
    CalibrationNext,
    /// Back to the step before, to look at it or to measure it again.
    CalibrationBack,
    /// Send what was measured to the wearable, and use it.
    CalibrationUse,
    /// Stop calibrating; what was in use stays.
    CalibrationCancel,
    /// The shoulder is being touched with the other hand: look where.
    TeachShoulder,
    /// A point in the robot's frame is being touched: look where.
    TeachPoint {
        /// Its place, base frame, metres; none for where the robot's hand is.
        robot_m: Option<[f64; 3]>,
    },
    /// Forget a touched point.
    TeachRemove {
        /// Which one, from 1.
        point: usize,
    },
    /// Use what was touched, from now on.
    TeachUse,
    /// Forget what was touched and is not used.
    TeachCancel,
    /// Begin to record a demonstration.
    Record {
        /// The skill that it shows.
        label: String,
    },
    /// The demonstration is over.
    Stop,
    /// Keep only a part of a demonstration.
    Trim {
        /// Which one.
        id: u32,
        /// From here, seconds since it began.
        from_s: f64,
        /// To here.
        to_s: f64,
    },
    /// Call a demonstration otherwise.
    Label {
        /// Which one.
        id: u32,
        /// Its new label.
        label: String,
    },
    /// Forget a demonstration.
    Discard {
        /// Which one.
        id: u32,
    },
    /// Learn from all demonstrations.
    Train,
    /// Ask the person for a movement: a cue on the page, which the simulated wearer obeys.
    Ask {
        /// The skill.
        label: String,
    },
    /// Let the wearable send raw sEMG, or not.
    Raw {
        /// Whether it is to.
        on: bool,
    },
    /// Let the robot follow. Only a person does this.
    Arm,
    /// Let the robot follow no more.
    Disarm,
}
