//! What the engine asks of a source.

use serde::{Deserialize, Serialize};

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
    /// Hold the hand still at the height of the elbow while a known force pulls at it, co-contracting so much.
    Hold {
        /// The force on the hand, shoulder frame, newtons; zero for none.
        force_n: [f64; 3],
        /// Share of the maximum voluntary contraction to keep in all muscles.
        effort: f64,
    },
    /// Bend the elbow against a weight, biceps alone.
    Flex,
    /// Stretch the elbow against a weight, triceps alone.
    Extend,
    /// Perform a movement.
    Perform {
        /// The skill.
        label: String,
    },
    /// Nothing in particular.
    Free,
}
