//! The engine with simulated devices in virtual time: as fast as it goes, the same every time.

use std::sync::Arc;

use super::story::Story;
use crate::calibration::Profile;
use crate::library::Library;
use crate::live::{Act, Input, LearnJob, Request, View, World};
use crate::robot::command::Command;
use crate::robot::gate::State;
use crate::robot::limits::Setpoint;
use crate::source::simulated::SimulatedDevices;
use std::collections::VecDeque;

/// Devices are asked for what came so often, microseconds: an event loop that is never late.
const STEP_US: u64 = 1_000;

/// Devices, and somebody who looks and acts.
pub struct Virtual<Person> {
    devices: SimulatedDevices,
    person: Person,
    now_us: u64,
    end_us: u64,
    waiting: VecDeque<(u64, Option<Input>)>,
    learnt: Option<Arc<Library>>,
}

/// What somebody does in a virtual world.
pub trait Someone {
    /// Sees, and may act.
    fn look(&mut self, view: &View) -> Vec<Act>;
    /// Whether the run is over.
    fn over(&self) -> bool {
        false
    }
    /// May disturb the devices; called every millisecond.
    fn meddle(&mut self, _devices: &mut SimulatedDevices, _now_us: u64) {}
    /// Somebody was measured.
    fn measured(&mut self, _profile: &Profile) {}
    /// A command was made.
    fn commanded(&mut self, _devices: &SimulatedDevices, _at_us: u64, _command: &Command) {}
    /// The robot is told.
    fn set(&mut self, _at_us: u64, _setpoint: &Setpoint, _state: State) {}
    /// Something came in.
    fn input(&mut self, _at_us: u64, _input: &Input) {}
}

impl Someone for Story {
    fn look(&mut self, view: &View) -> Vec<Act> {
        Story::look(self, view)
    }

    fn over(&self) -> bool {
        Story::over(self)
    }
}

impl<Person: Someone> Virtual<Person> {
    /// Runs until the person says that it is over, at most to `end_us`.
    pub fn new(devices: SimulatedDevices, person: Person, end_us: u64) -> Self {
        Self {
            devices,
            person,
            now_us: 0,
            end_us,
            waiting: VecDeque::new(),
            learnt: None,
        }
    }

    /// The person, when it is over.
    pub fn into_person(self) -> Person {
        self.person
    }

    fn push(&mut self, input: Input) {
        let at_us = self.now_us;
        self.waiting.push_back((at_us, Some(input)));
    }
}

impl<Person: Someone> World for Virtual<Person> {
    fn next(&mut self) -> Option<(u64, Option<Input>)> {
        if self.waiting.is_empty() {
            if self.now_us >= self.end_us || self.person.over() {
                return None;
            }
            self.now_us += STEP_US;
            self.person.meddle(&mut self.devices, self.now_us);
            let came = self.devices.step(self.now_us).into_iter();
            self.waiting
                .extend(came.map(|timed| (timed.at_us, Some(timed.input))));
            self.waiting.push_back((self.now_us, None));
        }
        self.waiting.pop_front()
    }

    fn took(&mut self, at_us: u64, input: &Input) {
        self.person.input(at_us, input);
    }

    fn ask(&mut self, at_us: u64, request: Request) {
        self.devices.ask(request, at_us);
    }

    fn learn(&mut self, job: LearnJob) {
        let outcome = job.run().and_then(|library| {
            let bytes = library.to_bytes().map_err(|error| error.to_string())?;
            self.learnt = Some(Arc::new(library));
            Ok(bytes)
        });
        self.push(Input::Learnt(outcome));
    }

    fn learnt(&mut self) -> Option<Arc<Library>> {
        self.learnt.take()
    }

    fn measured(&mut self, profile: &Profile) {
        self.person.measured(profile);
    }

    fn commanded(&mut self, at_us: u64, command: &Command) {
        self.person.commanded(&self.devices, at_us, command);
    }

    fn set(&mut self, at_us: u64, setpoint: &Setpoint, state: State) {
        self.person.set(at_us, setpoint, state);
    }

    fn show(&mut self, view: &View) {
        for act in self.person.look(view) {
            self.push(Input::Act(act));
        }
    }
}
