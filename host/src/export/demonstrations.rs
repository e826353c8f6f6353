//! Demonstrations of a recording as `tonus train` reads them: joined by the engine, as when they were recorded.

use std::path::Path;
use std::sync::Arc;

use crate::atomic;
use crate::demonstration::Demonstration;
use crate::library::Library;
use crate::live::{
    Act, Body, Engine, EngineConfig, EngineError, Input, LearnJob, Profile, Request, Timed, View,
    World,
};
use crate::recording::{ReadError, Reading};
use crate::robot::command::Command;
use crate::robot::gate::State;
use crate::robot::limits::Setpoint;
use crate::session::DOFS;

use super::error::ExportError;

/// After the last input the engine waits for what is still on its way: so long, microseconds.
const AFTER_US: u64 = 1_000_000;

/// What became of the demonstrations.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Demonstrated {
    /// How many were written.
    pub demonstrations: usize,
    /// Why others cannot be learnt from.
    pub problems: Vec<String>,
}

/// The inputs of a recording without what learns, and a world that nobody looks at.
struct Replay<I> {
    inputs: I,
    now_us: u64,
    over: bool,
    error: Option<ReadError>,
}

impl<I: Iterator<Item = Result<Timed, ReadError>>> World for Replay<I> {
    fn next(&mut self) -> Option<(u64, Option<Input>)> {
        loop {
            match self.inputs.next() {
                Some(Ok(Timed {
                    input: Input::Learnt(_) | Input::Act(Act::Train),
                    ..
                })) => {}
                Some(Ok(Timed { at_us, input })) => {
                    self.now_us = self.now_us.max(at_us);
                    return Some((self.now_us, Some(input)));
                }
                Some(Err(error)) => self.error = Some(error),
                None if self.over => return None,
                None => {
                    self.over = true;
                    return Some((self.now_us.saturating_add(AFTER_US), None));
                }
            }
        }
    }

    fn took(&mut self, _: u64, _: &Input) {}
    fn ask(&mut self, _: u64, _: Request) {}
    fn learn(&mut self, _: LearnJob) {}
    fn learnt(&mut self) -> Option<Arc<Library>> {
        None
    }
    fn measured(&mut self, _profile: &Profile) {}

    fn commanded(&mut self, _: u64, _: &Command) {}
    fn set(&mut self, _: u64, _: &Setpoint, _: State) {}
    fn show(&mut self, _: &View) {}
}

/// Writes the demonstrations that a recording ends with (trimmed, renamed, discarded ones left out) as CSV. Without any that
/// can be learnt from nothing is written. The file's name is nobody's choice, so another one's content stays.
///
/// # Errors
/// [`ExportError`] where the recording cannot be read to its end, or the file not be written.
pub fn write_demonstrations(
    recording: &Path,
    config: EngineConfig,
    body: Body,
    output: &Path,
) -> Result<Demonstrated, ExportError> {
    let mut world = Replay {
        inputs: Reading::open(recording)?.inputs(),
        now_us: 0,
        over: false,
        error: None,
    };
    let mut engine = Engine::new(config, body, None)?;
    engine.run(&mut world)?;
    if let Some(error) = world.error {
        return Err(error.into());
    }
    let (demonstrations, problems) = engine.demonstrations();
    let demonstrated = Demonstrated {
        demonstrations: demonstrations.len(),
        problems,
    };
    if !demonstrations.is_empty() {
        let path = output.to_owned();
        let cannot = |source| ExportError::Write {
            path: output.to_owned(),
            source,
        };
        let mut bytes = Vec::new();
        write(&mut bytes, &demonstrations).map_err(cannot)?;
        if !output.exists() {
            atomic::write(output, &bytes).map_err(cannot)?;
        } else if std::fs::read(output).map_err(cannot)? != bytes {
            return Err(ExportError::Exists { path });
        }
    }
    Ok(demonstrated)
}

fn write(out: impl std::io::Write, demonstrations: &[Demonstration]) -> std::io::Result<()> {
    let mut lines = csv::Writer::from_writer(out);
    let names = std::iter::once("t_s").chain(DOFS).chain(["label", "trial"]);
    lines.write_record(names)?;
    for demonstration in demonstrations {
        for (row, t_s) in demonstration.t_s().iter().enumerate() {
            let values = demonstration.values().iter().filter_map(|dof| dof.get(row));
            let numbers = std::iter::once(t_s).chain(values).map(f64::to_string);
            let names = [demonstration.label(), demonstration.trial()].map(str::to_owned);
            lines.write_record(numbers.chain(names))?;
        }
    }
    lines.flush()
}

impl From<EngineError> for ExportError {
    fn from(error: EngineError) -> Self {
        Self::Engine(Box::new(error))
    }
}
