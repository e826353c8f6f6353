//! A recording, run again: the same inputs at the same times give the same commands, bit for bit.

use std::path::Path;
use std::sync::Arc;

use super::setup::{self, SetupError};
use crate::calibration::Profile;
use crate::config::{Config, ConfigError};
use crate::library::{Library, LibraryError};
use crate::live::{Engine, EngineError, Input, LearnJob, Request, View, World};
use crate::recording::{Entry, ReadError, Reading};
use crate::robot::command::Command;
use crate::robot::gate::State;
use crate::robot::limits::Setpoint;
use crate::source::{LinkChoice, NoLink};

/// What became of the commands.
#[derive(Debug, Clone, Default, PartialEq, Eq, serde::Serialize)]
pub struct Played {
    /// Inputs of the recording.
    pub inputs: u64,
    /// Commands that it holds.
    pub recorded: u64,
    /// Commands that were made again.
    pub made: u64,
    /// Of these, the same in every bit as the recorded one.
    pub same: u64,
    /// Session time of the first that differs, microseconds.
    pub first_different_us: Option<u64>,
    /// Where the recording was cut, if it was: everything before it was played.
    pub cut: Option<String>,
}

impl Played {
    /// Whether the run is the recorded one.
    #[must_use]
    pub fn exact(&self) -> bool {
        self.same == self.made && self.made == self.recorded
    }
}

/// Why a recording cannot be played.
#[derive(Debug, thiserror::Error)]
pub enum PlayError {
    /// It cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The configuration in it.
    #[error("the configuration in the recording: {0}")]
    Config(#[from] ConfigError),
    /// The link in it.
    #[error("the configuration in the recording: {0}")]
    Link(#[from] NoLink),
    /// What it names.
    #[error("the configuration in the recording: {0}")]
    Setup(#[from] SetupError),
    /// The engine.
    #[error(transparent)]
    Engine(#[from] EngineError),
    /// The skills that the run began with.
    #[error(transparent)]
    Library(#[from] LibraryError),
}

/// Plays a recording; `watch` sees every view.
///
/// # Errors
/// [`PlayError`].
pub fn play(file: &Path, watch: impl FnMut(&View)) -> Result<Played, PlayError> {
    let reading = Reading::open(file)?;
    let opening = reading.opening().clone();
    let config = Config::parse(&opening.configuration, file)?;
    let library = (opening.model.as_deref())
        .map(|bytes| Library::from_bytes(bytes, file))
        .transpose()?;
    let link: LinkChoice = config.wearable.link.parse()?;
    let mut engine = Engine::new(
        setup::engine(&config, &link)?,
        setup::body(&config)?,
        library.map(Arc::new),
    )?;
    let mut world = Replayed {
        entries: reading,
        inputs: 0,
        recorded: 0,
        made: 0,
        same: 0,
        first_different_us: None,
        due: std::collections::VecDeque::new(),
        waiting: std::collections::VecDeque::new(),
        cut: None,
        watch,
    };
    engine.run(&mut world)?;
    Ok(Played {
        inputs: world.inputs,
        recorded: world.recorded,
        made: world.made,
        same: world.same,
        first_different_us: world.first_different_us,
        cut: world.cut,
    })
}

/// The recording as a world. A command stands in the file behind the input that made it.
struct Replayed<Watch> {
    entries: Reading,
    inputs: u64,
    recorded: u64,
    made: u64,
    same: u64,
    first_different_us: Option<u64>,
    /// Commands of the file that were not made again yet, and commands made that the file has not told of yet.
    due: std::collections::VecDeque<Command>,
    waiting: std::collections::VecDeque<(u64, Command)>,
    cut: Option<String>,
    watch: Watch,
}

impl<Watch> Replayed<Watch> {
    fn compare(&mut self) {
        while !self.due.is_empty() && !self.waiting.is_empty() {
            let (Some(recorded), Some((at_us, made))) =
                (self.due.pop_front(), self.waiting.pop_front())
            else {
                return;
            };
            if alike(&recorded, &made) {
                self.same += 1;
            } else {
                self.first_different_us.get_or_insert(at_us);
            }
        }
    }
}

/// The same bits: equality would take 0 for -0.
fn alike(a: &Command, b: &Command) -> bool {
    let bits = |command: &Command| {
        let vectors = [
            command.position_m,
            command.velocity_m_per_s,
            command.stiffness_n_per_m,
        ];
        (
            vectors.map(|vector| vector.map(f64::to_bits)),
            command.damping_ratio.to_bits(),
        )
    };
    bits(a) == bits(b) && a == b
}

impl<Watch: FnMut(&View)> World for Replayed<Watch> {
    fn next(&mut self) -> Option<(u64, Option<Input>)> {
        loop {
            match self.entries.next()? {
                Ok(Entry::Input(timed)) => {
                    self.inputs += 1;
                    return Some((timed.at_us, Some(timed.input)));
                }
                Ok(Entry::Command { command, .. }) => {
                    self.recorded += 1;
                    self.due.push_back(command);
                    self.compare();
                }
                Ok(_) => {}
                Err(error) => {
                    self.cut = Some(error.to_string());
                    return None;
                }
            }
        }
    }

    fn took(&mut self, _at_us: u64, _input: &Input) {}

    fn ask(&mut self, _at_us: u64, _request: Request) {}

    fn learn(&mut self, _job: LearnJob) {}

    fn learnt(&mut self) -> Option<Arc<Library>> {
        None
    }

    fn measured(&mut self, _profile: &Profile) {}

    fn commanded(&mut self, at_us: u64, command: &Command) {
        self.made += 1;
        self.waiting.push_back((at_us, *command));
        self.compare();
    }

    fn set(&mut self, _at_us: u64, _setpoint: &Setpoint, _state: State) {}

    fn show(&mut self, view: &View) {
        (self.watch)(view);
    }
}
