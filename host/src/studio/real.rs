//! The engine in real time: devices in their threads, a page, a file, a robot.

use std::collections::VecDeque;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use super::beside::{Noted, Problems};
use super::hands::Hands;
use super::keep::Keeper;
use super::latency::Latencies;
use crate::broadcast::Speaker;
use crate::calibration::Profile;
use crate::library::Library;
use crate::link::ble::Passkeys;
use crate::live::{
    Act, Frames, Injector, Input, Inputs, LearnJob, PasskeyView, Plug, Request, RobotSeen, View,
    World, is_stall,
};
use crate::page::Page;
use crate::recording::{Entry, Recorder};
use crate::robot::command::Command;
use crate::robot::gate::State;
use crate::robot::limits::Setpoint;
use crate::robot::udp::UdpRobot;

/// The engine wakes so often at least: the robot's period.
const WAKE: Duration = Duration::from_millis(1);
/// What the wearable is told last is on its way for so long, if it was told anything.
const PARTING: Duration = Duration::from_millis(500);
/// Set-points go to the file so often, microseconds.
const NOTE_EVERY_US: u64 = 10_000;

/// What learning gave, on its way from its thread.
type Learnt = Arc<Mutex<Option<Arc<Library>>>>;

/// What surrounds the engine of a running program.
pub struct Real {
    inputs: Inputs,
    injector: Injector,
    wearable: Plug,
    tracker: Option<Plug>,
    page: Option<Page>,
    recorder: Option<Recorder>,
    speaker: Option<Speaker>,
    robot: Option<UdpRobot>,
    /// The newest command that the gate took, for the age of the robot's evidence.
    newest: Option<Command>,
    latencies: Latencies,
    disarm: Arc<AtomicBool>,
    hands: Option<Box<dyn Hands>>,
    /// What they do.
    acts: VecDeque<Act>,
    learnt: Learnt,
    /// Why learning did not begin, until the engine is told.
    unlearnt: Option<String>,
    /// The last moment, session time, microseconds.
    moment_us: u64,
    /// What comes after a stall that is told of first.
    after_stall: VecDeque<(u64, Option<Input>)>,
    /// There are no more inputs.
    ended: bool,
    /// The wearable is told something at the end.
    parting: bool,
    passkeys: Passkeys,
    keeper: Keeper,
    stop: Arc<AtomicBool>,
    end_us: Option<u64>,
    /// Whether the run ends when they are done.
    ends: bool,
    noted_us: u64,
    problems: Problems,
    noted: Noted,
    watch: Box<dyn FnMut(&View)>,
}

/// What a run is made of.
pub struct Parts {
    /// All sources fill it.
    pub inputs: Inputs,
    /// The wearable's source.
    pub wearable: Plug,
    /// The hand tracker, where it is a source of its own.
    pub tracker: Option<Plug>,
    /// Who looks in a browser.
    pub page: Option<Page>,
    /// The file.
    pub recorder: Option<Recorder>,
    /// Sends to other programs.
    pub speaker: Option<Speaker>,
    /// A robot elsewhere.
    pub robot: Option<UdpRobot>,
    /// Where pairing asks for a passkey.
    pub passkeys: Passkeys,
    /// Who presses the buttons beside the page.
    pub hands: Option<Box<dyn Hands>>,
    /// Writes what outlives the run.
    pub keeper: Keeper,
    /// Set from outside to disarm the robot, before all that waits.
    pub disarm: Arc<AtomicBool>,
    /// Set from outside to end the run.
    pub stop: Arc<AtomicBool>,
    /// The run ends then, session time, microseconds.
    pub end_us: Option<u64>,
    /// Whether the run ends when they are done.
    pub ends_with_hands: bool,
    /// Sees every view, as the page does.
    pub watch: Box<dyn FnMut(&View)>,
}

/// What is left of a run.
pub struct Left {
    /// Who pressed the buttons.
    pub hands: Option<Box<dyn Hands>>,
    /// Why the file is not whole, if it is not.
    pub file: Option<Result<crate::recording::Finished, crate::recording::RecordError>>,
}

impl Real {
    /// Everything plugged in.
    #[must_use]
    pub fn new(parts: Parts) -> Self {
        Self {
            injector: parts.inputs.injector(),
            inputs: parts.inputs,
            wearable: parts.wearable,
            tracker: parts.tracker,
            page: parts.page,
            recorder: parts.recorder,
            speaker: parts.speaker,
            robot: parts.robot,
            newest: None,
            latencies: Latencies::default(),
            disarm: parts.disarm,
            hands: parts.hands,
            acts: VecDeque::new(),
            learnt: Learnt::default(),
            unlearnt: None,
            moment_us: 0,
            after_stall: VecDeque::new(),
            ended: false,
            parting: false,
            passkeys: parts.passkeys,
            keeper: parts.keeper,
            stop: parts.stop,
            end_us: parts.end_us,
            ends: parts.ends_with_hands,
            noted_us: 0,
            problems: Problems::default(),
            noted: Noted::default(),
            watch: parts.watch,
        }
    }

    /// Ends the sources, closes the file.
    #[must_use]
    pub fn finish(mut self) -> Left {
        if let Some(robot) = &mut self.robot {
            robot.repeat();
        }
        if self.parting {
            std::thread::sleep(PARTING);
        }
        self.wearable.stop();
        if let Some(tracker) = &self.tracker {
            tracker.stop();
        }
        Left {
            hands: self.hands,
            file: self.recorder.map(Recorder::finish),
        }
    }

    fn over(&self, now_us: u64) -> bool {
        let told = self.ends && self.hands.as_ref().is_some_and(|hands| hands.over());
        told || self.stop.load(Ordering::Relaxed) || self.end_us.is_some_and(|end| now_us >= end)
    }

    /// What happens next, as [`World::next`], which tells of stalls.
    fn moment(&mut self) -> Option<(u64, Option<Input>)> {
        let now_us = self.inputs.now_us();
        if self.over(now_us) {
            self.ended = true;
            return None;
        }
        // Before all that waits.
        if self.disarm.swap(false, Ordering::Relaxed) {
            return Some((now_us, Some(Input::Act(Act::Disarm))));
        }
        if let Some(moment) = self.after_stall.pop_front() {
            return Some(moment);
        }
        if let Some(told) = self.robot.as_mut().and_then(|robot| robot.heard(now_us)) {
            let seen = RobotSeen {
                measured_us: told.measured_us,
                position_m: told.position_m,
                stiffness_n_per_m: told.stiffness_n_per_m,
            };
            return Some((now_us, Some(Input::Robot(seen))));
        }
        if let Some(problem) = self.unlearnt.take() {
            return Some((now_us, Some(Input::Learnt(Err(problem)))));
        }
        if let Some(act) = self.acts.pop_front() {
            return Some((now_us, Some(Input::Act(act))));
        }
        let timed = self.inputs.next(WAKE);
        // What has waited is as old as it is: its time is the one at which it is taken, not the one at which it came.
        let now_us = self.inputs.now_us();
        let input = timed.map(|timed| (timed.at_us.max(now_us), timed.input));
        match input {
            // Where a recording's or a simulation's robot is says nothing of the one that is commanded.
            Some((at_us, Input::Robot(_))) if self.robot.is_some() => Some((at_us, None)),
            Some((at_us, input)) => Some((at_us, Some(input))),
            None => Some((now_us, None)),
        }
    }

    fn note(&self, entry: Entry) {
        if let Some(recorder) = &self.recorder {
            recorder.note(entry);
        }
    }
}

/// What learning gives, or why not: a failure of the program itself must not leave the engine waiting for ever.
fn surviving(learn: impl FnOnce() -> Result<Vec<u8>, String>) -> Result<Vec<u8>, String> {
    // What a failure leaves half done is dropped with it.
    catch_unwind(AssertUnwindSafe(learn)).unwrap_or_else(|cause| {
        let text = cause.downcast_ref::<String>().map(String::as_str);
        let text = text.or_else(|| cause.downcast_ref::<&str>().copied());
        Err(format!(
            "learning failed inside ({}): a fault of the program, please report it with the recording",
            text.unwrap_or("no cause told")
        ))
    })
}

impl World for Real {
    fn next(&mut self) -> Option<(u64, Option<Input>)> {
        let (at_us, input) = self.moment()?;
        let since_us = self.moment_us;
        self.moment_us = since_us.max(at_us);
        if !is_stall(self.robot.is_some(), since_us, at_us) {
            return Some((at_us, input));
        }
        // It waits until the robot's time has passed over the stall; disarming goes before what waits already.
        self.after_stall.push_front((at_us, input));
        Some((at_us, Some(Input::Stalled { since_us })))
    }

    fn took(&mut self, at_us: u64, input: &Input) {
        if let Some(speaker) = &self.speaker {
            speaker.take(at_us, input);
        }
        if let Some(recorder) = &self.recorder {
            recorder.note(Entry::Input(crate::live::Timed {
                at_us,
                input: input.clone(),
            }));
        }
    }

    fn ask(&mut self, _at_us: u64, request: Request) {
        if let (Some(tracker), Request::Prompt(_)) = (&self.tracker, &request) {
            tracker.ask(request.clone());
        }
        self.parting |= self.ended && matches!(request, Request::Frame(_));
        self.wearable.ask(request);
    }

    fn learn(&mut self, job: LearnJob) {
        let (learnt, injector) = (Arc::clone(&self.learnt), self.injector.clone());
        let keeper = self.keeper.clone();
        let work = move || {
            let outcome = surviving(|| {
                let library = job.run()?;
                let bytes = library.to_bytes().map_err(|error| error.to_string())?;
                keeper.skills(&library);
                let mut slot = learnt.lock().unwrap_or_else(PoisonError::into_inner);
                *slot = Some(Arc::new(library));
                Ok(bytes)
            });
            // A full queue empties within a second.
            while !injector.input(Input::Learnt(outcome.clone())) && injector.open() {
                std::thread::sleep(Duration::from_millis(10));
            }
        };
        let started = std::thread::Builder::new()
            .name("learning".to_owned())
            .spawn(work);
        if let Err(error) = started {
            self.unlearnt = Some(format!("no thread to learn in: {error}"));
        }
    }

    fn learnt(&mut self) -> Option<Arc<Library>> {
        let mut slot = self.learnt.lock().unwrap_or_else(PoisonError::into_inner);
        slot.take()
    }

    fn measured(&mut self, profile: &Profile) {
        self.keeper.person(profile);
    }

    fn accepted(&mut self, command: &Command) {
        self.newest = Some(*command);
    }

    fn commanded(&mut self, at_us: u64, command: &Command) {
        // By the clock, not by when the scan was taken in: waiting and computing count.
        let age_us = self.inputs.now_us().saturating_sub(command.acquired_us);
        self.latencies.add(age_us);
        self.note(Entry::Command {
            at_us,
            command: *command,
        });
    }

    fn set(&mut self, at_us: u64, setpoint: &Setpoint, state: State) {
        if let Some(robot) = &mut self.robot {
            robot.send(setpoint, state, self.newest.as_ref(), at_us);
        }
        if at_us >= self.noted_us + NOTE_EVERY_US {
            self.noted_us = at_us;
            self.note(Entry::Setpoint {
                at_us,
                setpoint: *setpoint,
                state,
            });
        }
    }

    fn taught(&mut self, frames: &Frames) {
        self.keeper.frames(frames);
    }

    fn show(&mut self, view: &View) {
        let mut view = view.clone();
        view.latency = self.latencies.view();
        if let Some(hands) = &mut self.hands {
            self.acts.extend(hands.look(&view));
            view.story = hands.text();
        }
        view.link.passkey = self.passkeys.wanted().map(|wanted| PasskeyView {
            wanted_by: wanted.by,
            left_s: wanted.left.as_secs_f64(),
        });
        view.teaching.kept = self.keeper.kept_frames();
        view.file = self.recorder.as_ref().map(Recorder::state);
        view.calibration.people = self.keeper.names();
        let silent = (self.speaker.as_ref()).and_then(|speaker| speaker.problem());
        let problems = [self.keeper.problem(), silent.map(str::to_owned)];
        self.problems
            .tell(&mut view, problems.into_iter().flatten());
        if self.recorder.is_some() {
            for entry in self.noted.entries(&view) {
                self.note(entry);
            }
        }
        if let Some(page) = &self.page {
            page.show(&view);
        }
        (self.watch)(&view);
    }
}

#[cfg(test)]
mod tests;
