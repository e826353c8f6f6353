//! What the engine asks of a source.

use serde::{Deserialize, Serialize};

use crate::calibration::Task;

/// For a source to do.
#[derive(Clone, Debug, PartialEq)]
pub enum Request {
    /// Send these bytes, one encoded frame, to the wearable.
    Frame(Vec<u8>),
    /// What the person is asked to do now. People read it on the page; the simulated wearer does it.
    Prompt(Prompt),
}

/// What a person is asked to do.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "prompt", rename_all = "snake_case")]
pub enum Prompt {
    /// Let the arm hang and all muscles go.
    Rest,
    /// Contract all muscles with all strength.
    Contract,
    /// Hold the hand still while a known force pulls at it, co-contracting so much.
    Hold {
        /// About where to hold it, shoulder frame, metres.
        hand_m: [f64; 3],
        /// The force on the hand, shoulder frame, newtons; zero for none.
        force_n: [f64; 3],
        /// Share of the maximum voluntary contraction to keep in all muscles.
        effort: f64,
    },
    /// Bend the elbow against a weight, biceps alone.
    Flex,
    /// Stretch the elbow against a weight, triceps alone.
    Extend,
    /// Touch the shoulder with the other hand and hold it there.
    TouchShoulder,
    /// Touch a place with the hand and hold it there.
    TouchPoint {
        /// Robot's base frame, metres.
        robot_m: [f64; 3],
    },
    /// Perform a movement.
    Perform {
        /// The skill.
        label: String,
    },
    /// Nothing in particular.
    Free,
}

impl From<Task> for Prompt {
    fn from(task: Task) -> Self {
        match task {
            Task::Free => Self::Free,
            Task::Rest => Self::Rest,
            Task::Contract => Self::Contract,
            Task::Flex => Self::Flex,
            Task::Extend => Self::Extend,
            Task::Hold(hold) => Self::Hold {
                hand_m: hold.hand_m,
                force_n: hold.force_n,
                effort: hold.effort,
            },
        }
    }
}
