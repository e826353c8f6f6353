//! A run that ends while somebody is measured: the levels of before go back to the wearable; where they cannot, the next run says
//! so and does not arm.

use std::cell::Cell;
use std::rc::Rc;
use std::sync::Arc;

use tonus::calibration::Profile;
use tonus::demo::{self, DemoConfig};
use tonus::library::Library;
use tonus::live::{Act, Engine, Input, View, simulated};
use tonus::robot::command::Command;
use tonus::source::LinkChoice;
use tonus::source::simulated::{SimulatedConfig, SimulatedDevices};
use tonus::studio::setup;
use tonus::studio::virtually::{Someone, Virtual};
use tonus_shared::wire::{Calibration, Packet, decode};

use crate::recalled::profile;
use crate::world::{config, somebody};

const LEFT: &str = "the wearable was left in the middle of a calibration";

/// In the next run a person is recalled after so long, microseconds.
const RECALL_US: u64 = 8_000_000;

/// When the first of two runs ends.
#[derive(Clone, Copy, PartialEq)]
enum Ends {
    /// The wearable was sent the levels to measure by, and has not answered.
    Sent,
    /// A step is being measured.
    Measuring,
    /// The same, and the wearable is out of reach from then until the next run.
    OutOfReach,
    /// Somebody cancelled, and the wearable has not answered.
    Cancelled,
}

/// Somebody who begins to be measured; in the next run they want the robot to follow, and at last do what they are told to.
struct Interrupted {
    ends: Ends,
    next_run: Rc<Cell<bool>>,
    over: bool,
    began: bool,
    cut: bool,
    /// When the next run began.
    again_us: Option<u64>,
    recalls: Option<Profile>,
    seen: Seen,
}

#[derive(Default)]
struct Seen {
    /// What the wearable said that it works with: in the first run, in the next.
    told: [Vec<Calibration>; 2],
    /// Messages of the next run.
    messages: Vec<String>,
    /// Commands of the next run before anybody was recalled, and after.
    commands: [u64; 2],
    armed: bool,
    recalled: bool,
}

impl Interrupted {
    fn first_run(&mut self, view: &View) -> Vec<Act> {
        if !self.began {
            self.began =
                !self.seen.told[0].is_empty() && view.semg.is_some() && !view.calibration.waiting;
            self.over = self.began && self.ends == Ends::Sent;
            return if self.began {
                vec![Act::Calibrate(somebody())]
            } else {
                Vec::new()
            };
        }
        match &view.calibration.step {
            Some(step) if step.measuring && self.ends == Ends::Cancelled => {
                self.over = true;
                vec![Act::CalibrationCancel]
            }
            Some(step) if step.measuring => {
                // Out of reach first: the devices know it from the next millisecond on.
                self.over = self.cut || self.ends != Ends::OutOfReach;
                self.cut = self.ends == Ends::OutOfReach;
                Vec::new()
            }
            Some(_) if !view.calibration.waiting => vec![Act::CalibrationStep],
            _ => Vec::new(),
        }
    }

    fn next_run(&mut self, view: &View) -> Vec<Act> {
        let since_us = view.at_us - *self.again_us.get_or_insert(view.at_us);
        self.seen.armed |= view.robot.state == "following";
        self.seen.recalled |= view.calibration.in_use.is_some();
        for told in &view.messages {
            if !self.seen.messages.contains(&told.text) {
                self.seen.messages.push(told.text.clone());
            }
        }
        if since_us > RECALL_US
            && let Some(profile) = self.recalls.take()
        {
            return vec![Act::Recall {
                name: profile.person.name.clone(),
                profile: Some(Box::new(profile)),
            }];
        }
        self.over = since_us > 16_000_000;
        let wants = since_us > 4_000_000 && !self.seen.armed;
        wants.then_some(Act::Arm).into_iter().collect()
    }
}

impl Someone for Interrupted {
    fn look(&mut self, view: &View) -> Vec<Act> {
        if self.next_run.get() {
            self.next_run(view)
        } else {
            self.first_run(view)
        }
    }

    /// The second run begins although the first is over.
    fn over(&self) -> bool {
        self.over && (self.next_run.get() == self.again_us.is_some())
    }

    fn meddle(&mut self, devices: &mut SimulatedDevices, _now_us: u64) {
        devices.cut(self.cut && !self.next_run.get());
    }

    fn commanded(&mut self, _devices: &SimulatedDevices, at_us: u64, _command: &Command) {
        // At the run's begin the wearable has not told yet what it works with.
        if let Some(again_us) = self.again_us.filter(|us| at_us > us + 3_000_000) {
            self.seen.commands[usize::from(at_us > again_us + RECALL_US)] += 1;
        }
    }

    fn input(&mut self, _at_us: u64, input: &Input) {
        let Input::Frame(bytes) = input else { return };
        if let Ok(frame) = decode(bytes)
            && let Packet::Calibration(calibration) = frame.packet
        {
            self.seen.told[usize::from(self.next_run.get())].push(calibration);
        }
    }
}

/// Two runs, one after the other, with the same devices, which know nothing of runs.
fn two_runs(ends: Ends, recalls: Option<Profile>) -> Seen {
    let next_run = Rc::new(Cell::new(false));
    let person = Interrupted {
        ends,
        next_run: Rc::clone(&next_run),
        over: false,
        began: false,
        cut: false,
        again_us: None,
        recalls,
        seen: Seen::default(),
    };
    let devices = SimulatedDevices::new(SimulatedConfig {
        seed: 5,
        ..SimulatedConfig::default()
    });
    let mut world = Virtual::new(devices.unwrap(), person, 200_000_000);
    for library in [None, Some(skills())] {
        let config = config();
        let mut told = setup::engine(&config, &LinkChoice::Simulated).unwrap();
        told.boot_id = if next_run.get() { 2 } else { 1 };
        let body = simulated(config.robot.home_m, config.robot.payload_kg).unwrap();
        let mut engine = Engine::new(told, body, library).unwrap();
        engine.run(&mut world).unwrap();
        next_run.set(true);
    }
    let seen = world.into_person().seen;
    assert!(!seen.told[0].is_empty() && !seen.told[1].is_empty());
    seen
}

fn skills() -> Arc<Library> {
    Arc::new(demo::learn_skills(&DemoConfig::default()).unwrap())
}

#[test]
fn the_levels_of_before_go_back_when_the_run_ends() {
    for ends in [Ends::Sent, Ends::Measuring, Ends::Cancelled] {
        let seen = two_runs(ends, None);
        let before = seen.told[0][0];
        assert_ne!(before.mvc_v[0], 1e-3);
        assert_eq!(seen.told[1].last(), Some(&before));
        let left = seen.messages.iter().any(|text| text.contains(LEFT));
        assert!(!left && seen.armed, "{:?}", seen.messages);
    }
}

#[test]
fn a_calibration_that_was_never_finished_is_recognised_by_the_next_run() {
    let seen = two_runs(Ends::OutOfReach, Some(profile(5)));
    assert_eq!(seen.told[1][0].mvc_v[0], 1e-3, "levels to measure by");
    let left = seen.messages.iter().find(|text| text.contains(LEFT));
    let left = left.expect("somebody is told");
    assert!(left.contains("calibrate again, or recall a person"));
    // Nothing was followed until somebody did what it says; then it follows.
    assert_eq!(seen.commands[0], 0);
    assert!(seen.recalled && seen.armed && seen.commands[1] > 100);
}
