//! What a recording holds.

use crate::live::{Message, Person, RecognitionView, Timed};
use crate::robot::command::Command;
use crate::robot::gate::State;
use crate::robot::limits::Setpoint;

/// What is known when a recording begins.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Opening {
    /// Version of the program that records.
    pub version: String,
    /// Wall-clock time of session time zero, microseconds since 1970 in UTC.
    pub started_unix_us: u64,
    /// Who wears the wearable; none where nobody said.
    pub subject: Option<Person>,
    /// The configuration in use, TOML.
    pub configuration: String,
    /// The calibration in use, as its own file has it; none for the illustrative one of nobody.
    pub calibration: Option<String>,
    /// The model in use, as its file has it.
    pub model: Option<Vec<u8>>,
}

/// One thing that happened. Times are session time, microseconds.
#[derive(Clone, Debug, PartialEq)]
pub enum Entry {
    /// The engine took an input.
    Input(Timed),
    /// The engine offered a command to the robot's gate.
    Command {
        /// When.
        at_us: u64,
        /// Which.
        command: Command,
    },
    /// The gate told the robot where to be.
    Setpoint {
        /// When.
        at_us: u64,
        /// Where and how firmly.
        setpoint: Setpoint,
        /// The gate's state.
        state: State,
    },
    /// What the engine believed that the person does.
    Recognition {
        /// When.
        at_us: u64,
        /// As it was shown.
        recognition: RecognitionView,
    },
    /// The engine told people something.
    Message(Message),
}

impl Entry {
    /// When it happened, session time, microseconds.
    #[must_use]
    pub fn at_us(&self) -> u64 {
        match self {
            Self::Input(timed) => timed.at_us,
            Self::Command { at_us, .. }
            | Self::Setpoint { at_us, .. }
            | Self::Recognition { at_us, .. } => *at_us,
            Self::Message(message) => message.at_us,
        }
    }
}
