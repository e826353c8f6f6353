//! A recording, run again: the same inputs at the same times give the same commands and set-points, bit for bit.

use std::collections::VecDeque;
use std::path::Path;
use std::sync::Arc;

use super::setup::{self, RobotChoice, SetupError};
use crate::calibration::Profile;
use crate::config::{Config, ConfigError};
use crate::library::{Library, LibraryError};
use crate::live::{Engine, EngineError, Input, LearnJob, Request, View, World};
use crate::recording::{End, Entry, ReadError, Reading};
use crate::robot::command::Command;
use crate::robot::gate::State;
use crate::robot::limits::Setpoint;
use crate::source::{LinkChoice, NoLink};

/// What became of commands and set-points.
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
    /// Commands of the last input of a recording that was cut, which it holds no more: there is nothing to compare them with.
    pub unrecorded: u64,
    /// Set-points that it holds and that were compared.
    pub setpoints: u64,
    /// Of these, the same in every bit as one that the gate told at that time, in the same state.
    pub same_setpoints: u64,
    /// Set-points that were not compared: those to a robot elsewhere in a recording that does not tell where the program
    /// stalled, for which the gate leaves time out.
    pub uncompared_setpoints: u64,
    /// Session time of the first that differs, microseconds.
    pub first_different_us: Option<u64>,
    /// Where the recording was cut, if it was: everything before it was played.
    pub cut: Option<String>,
}

/// What a comparison came to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Everything that could be compared is the same in every bit, commands among it.
    Exact,
    /// Nothing differs, but there was no command to compare.
    NoCommands,
    /// Something differs.
    Different,
}

impl Played {
    /// Whether the run is the recorded one.
    #[must_use]
    pub fn verdict(&self) -> Verdict {
        let commands = self.same == self.recorded && self.recorded + self.unrecorded == self.made;
        if !commands || self.same_setpoints != self.setpoints {
            Verdict::Different
        } else if self.recorded == 0 {
            Verdict::NoCommands
        } else {
            Verdict::Exact
        }
    }

    /// Whether commands were compared, and everything is as it was recorded.
    #[must_use]
    pub fn exact(&self) -> bool {
        self.verdict() == Verdict::Exact
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
        played: Played::default(),
        due: VecDeque::new(),
        waiting: VecDeque::new(),
        due_setpoints: VecDeque::new(),
        elsewhere: matches!(setup::robot(&config)?, RobotChoice::Udp(_)),
        watch,
    };
    engine.run(&mut world)?;
    Ok(world.over())
}

/// The recording as a world. A command stands in the file behind the input that made it, a set-point before the input of
/// whose time it is.
struct Replayed<Watch> {
    entries: Reading,
    played: Played,
    /// Commands of the file that were not made again yet, and commands made that the file has not told of yet, with their
    /// time and the number of the input that made them.
    due: VecDeque<Command>,
    waiting: VecDeque<(u64, u64, Command)>,
    /// Set-points of the file that the gate has not told again yet.
    due_setpoints: VecDeque<(u64, Setpoint, State)>,
    /// Whether the robot is another program's.
    elsewhere: bool,
    watch: Watch,
}

impl<Watch> Replayed<Watch> {
    fn compare(&mut self) {
        while !self.due.is_empty() && !self.waiting.is_empty() {
            let (Some(recorded), Some((at_us, _, made))) =
                (self.due.pop_front(), self.waiting.pop_front())
            else {
                return;
            };
            if alike(&recorded, &made) {
                self.played.same += 1;
            } else {
                self.differs(at_us);
            }
        }
    }

    /// The gate told this. What was to be told before it was not.
    fn compare_setpoint(&mut self, told_us: u64, told: &Setpoint, state: State) {
        while let Some((at_us, setpoint, then)) = self.due_setpoints.front().copied() {
            if at_us > told_us {
                return;
            }
            let same = at_us == told_us && then == state && alike_setpoints(&setpoint, told);
            // Of two at one time, as when the run ends, the second may be the recorded one.
            if at_us == told_us && !same {
                return;
            }
            self.due_setpoints.pop_front();
            if same {
                self.played.same_setpoints += 1;
            } else {
                self.differs(at_us);
            }
        }
    }

    fn differs(&mut self, at_us: u64) {
        let first_us = self
            .played
            .first_different_us
            .map_or(at_us, |us| us.min(at_us));
        self.played.first_different_us = Some(first_us);
    }

    fn over(mut self) -> Played {
        if let Some(End::Cut {
            at_byte,
            lost_bytes,
        }) = self.entries.end()
        {
            self.played.cut.get_or_insert(format!(
                "the recording was not closed: {lost_bytes} bytes from byte {at_byte} on are not whole"
            ));
        }
        if let Some((at_us, ..)) = self.due_setpoints.front() {
            self.differs(*at_us);
        }
        // Of a file that was cut, what the last input led to may be missing, and no more.
        let last = self.played.inputs;
        let cut = self.played.cut.is_some();
        let of_last = |(_, input, _): &&(u64, u64, Command)| cut && *input == last;
        self.played.unrecorded = self.waiting.iter().filter(of_last).count() as u64;
        let earlier = self.waiting.iter().find(|made| !of_last(made));
        if let Some((at_us, ..)) = earlier.copied() {
            self.differs(at_us);
        }
        self.played
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

/// The same bits.
fn alike_setpoints(a: &Setpoint, b: &Setpoint) -> bool {
    let bits = |setpoint: &Setpoint| {
        let vectors = [
            setpoint.position_m,
            setpoint.velocity_m_per_s,
            setpoint.stiffness_n_per_m,
        ];
        (
            vectors.map(|vector| vector.map(f64::to_bits)),
            setpoint.damping_ratio.to_bits(),
        )
    };
    bits(a) == bits(b)
}

impl<Watch: FnMut(&View)> World for Replayed<Watch> {
    fn next(&mut self) -> Option<(u64, Option<Input>)> {
        loop {
            match self.entries.next()? {
                Ok(Entry::Input(timed)) => {
                    self.played.inputs += 1;
                    return Some((timed.at_us, Some(timed.input)));
                }
                Ok(Entry::Command { command, .. }) => {
                    self.played.recorded += 1;
                    self.due.push_back(command);
                    self.compare();
                }
                // The gate steps on a grid of session time, whoever wakes it: it is brought to where it was then.
                Ok(Entry::Setpoint {
                    at_us,
                    setpoint,
                    state,
                }) => {
                    if self.elsewhere && !self.entries.tells_of_stalls() {
                        self.played.uncompared_setpoints += 1;
                    } else {
                        self.played.setpoints += 1;
                        self.due_setpoints.push_back((at_us, setpoint, state));
                    }
                    return Some((at_us, None));
                }
                Ok(Entry::Recognition { .. } | Entry::Message(_)) => {}
                Err(error) => {
                    self.played.cut = Some(error.to_string());
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
        self.played.made += 1;
        self.waiting
            .push_back((at_us, self.played.inputs, *command));
        self.compare();
    }

    fn set(&mut self, at_us: u64, setpoint: &Setpoint, state: State) {
        self.compare_setpoint(at_us, setpoint, state);
    }

    fn show(&mut self, view: &View) {
        (self.watch)(view);
    }
}
