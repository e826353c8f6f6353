//! What a person does to the engine: demonstrations, skills, the robot.

use std::sync::Arc;

use super::engine::Engine;
use super::input::Act;
use super::request::{Prompt, Request};
use super::takes::{Kept, Take};
use super::world::World;
use crate::demonstration::Demonstration;
use crate::library::Library;

/// Demonstrations to learn from, apart from the engine.
#[derive(Debug, Clone)]
pub struct LearnJob {
    demonstrations: Vec<Demonstration>,
    false_alarm_rate: f64,
}

impl LearnJob {
    /// Learns. The same demonstrations give the same library.
    ///
    /// # Errors
    /// Why there is none, for people.
    pub fn run(&self) -> Result<Library, String> {
        let library = Library::learn(&self.demonstrations, self.false_alarm_rate);
        let library = library.map_err(|error| error.to_string())?;
        Ok(Library {
            held_out: Library::held_out(&self.demonstrations),
            ..library
        })
    }
}

impl Engine {
    pub(super) fn act(&mut self, act: Act, world: &mut impl World) {
        let now_us = self.now_us;
        let outcome = match act {
            Act::Record { label } => self.record(label, world),
            Act::Stop => self.stop(world),
            Act::Trim { id, from_s, to_s } => self.of(id).and_then(|kept| kept.trim(from_s, to_s)),
            Act::Label { id, label } => checked(&label).and_then(|label| {
                self.of(id)?.label = label;
                Ok(())
            }),
            Act::Discard { id } => self.of(id).map(|_| ()).map(|()| {
                self.kept.retain(|kept| kept.id != id);
            }),
            Act::Train => self.train(world),
            Act::Ask { label } => checked(&label).map(|label| {
                world.ask(now_us, Request::Prompt(Prompt::Perform { label }));
            }),
            Act::Arm => self.arm(),
            Act::Disarm => {
                self.follow.disarm();
                Ok(())
            }
            Act::Raw { on } => {
                // It is asked with the next ping.
                self.config.raw = on;
                Ok(())
            }
            Act::TeachShoulder
            | Act::TeachPoint { .. }
            | Act::TeachRemove { .. }
            | Act::TeachUse
            | Act::TeachCancel => self.teach(act, world),
            Act::Calibrate(_)
            | Act::Recall { .. }
            | Act::CheckFit
            | Act::CalibrationStep
            | Act::CalibrationNext
            | Act::CalibrationBack
            | Act::CalibrationUse
            | Act::CalibrationCancel => self.calibrate(act, world),
        };
        if let Err(problem) = outcome {
            self.tell(true, problem);
        }
    }

    fn of(&mut self, id: u32) -> Result<&mut Kept, String> {
        let ids: Vec<u32> = self.kept.iter().map(|kept| kept.id).collect();
        let found = self.kept.iter_mut().find(|kept| kept.id == id);
        found.ok_or_else(|| format!("there is no demonstration {id}; there are {ids:?}"))
    }

    fn record(&mut self, label: String, world: &mut impl World) -> Result<(), String> {
        let label = checked(&label)?;
        if self.take.is_some() {
            return Err("a demonstration is being recorded: stop it first".to_owned());
        }
        // A robot that is shown what to do follows nobody.
        self.follow.disarm();
        self.take = Some(Take::new(label.clone(), self.now_us));
        world.ask(self.now_us, Request::Prompt(Prompt::Perform { label }));
        Ok(())
    }

    fn stop(&mut self, world: &mut impl World) -> Result<(), String> {
        let now_us = self.now_us;
        let take = self.take.as_mut();
        take.ok_or("nothing is being recorded")?.stop(now_us);
        world.ask(now_us, Request::Prompt(Prompt::Free));
        Ok(())
    }

    fn train(&mut self, world: &mut impl World) -> Result<(), String> {
        if self.learning.is_some() {
            return Err("the skills are being learnt already".to_owned());
        }
        let (demonstrations, problems) = self.demonstrations();
        let left_out = problems.join("; ");
        if demonstrations.is_empty() {
            return Err(if left_out.is_empty() {
                "nothing to learn from: record demonstrations first".to_owned()
            } else {
                format!("nothing to learn from: {left_out}")
            });
        }
        if !left_out.is_empty() {
            self.tell(true, format!("left out of what is learnt: {left_out}"));
        }
        self.learn_problem = None;
        let job = LearnJob {
            demonstrations,
            false_alarm_rate: self.config.false_alarm_rate,
        };
        self.learning = Some(job.clone());
        world.learn(job);
        Ok(())
    }

    /// Takes over what was learnt; whether there is another library.
    pub(super) fn learnt(
        &mut self,
        outcome: Result<Vec<u8>, String>,
        world: &mut impl World,
    ) -> bool {
        let Some(job) = self.learning.take() else {
            self.tell(true, "a model came that nobody asked for".to_owned());
            return false;
        };
        let library = match outcome {
            Err(problem) => Err(problem),
            Ok(bytes) => match world.learnt() {
                Some(library) => Ok(library),
                None => self.again(&job, &bytes),
            },
        };
        match library {
            Ok(library) => {
                // Commands of the old skills count no more.
                self.follow.disarm();
                self.tell(
                    false,
                    format!("learnt {} skills", library.model.labels().len()),
                );
                self.library = Some(library);
                true
            }
            Err(problem) => {
                self.tell(true, format!("not learnt: {problem}"));
                self.learn_problem = Some(problem);
                false
            }
        }
    }

    /// Learns what a recording says was learnt, and says so if it is another model.
    fn again(&mut self, job: &LearnJob, recorded: &[u8]) -> Result<Arc<Library>, String> {
        let library = job.run()?;
        let same = library.to_bytes().is_ok_and(|bytes| bytes == recorded);
        if !same {
            self.tell(
                true,
                "the model learnt again differs from the recorded one: another version of the program?".to_owned(),
            );
        }
        Ok(Arc::new(library))
    }
}

/// A label that files and models can carry.
fn checked(label: &str) -> Result<String, String> {
    let label = label.trim();
    let fine = !label.is_empty() && label.len() <= 64 && !label.chars().any(char::is_control);
    if fine {
        Ok(label.to_owned())
    } else {
        Err(format!(
            "`{label}` is no label: give 1 to 64 printable characters"
        ))
    }
}
