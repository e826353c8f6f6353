//! A wearable that does not answer the calibration it is to measure with: nobody presses a button that does nothing.

use tonus::live::{Act, Person, View};
use tonus::source::simulated::{SimulatedConfig, SimulatedDevices};
use tonus::studio::hands::Hands;
use tonus::studio::story::Story;
use tonus::studio::terminal::{Calibrates, Enter};
use tonus::studio::virtually::Someone;

use crate::world::run;

/// So long the link is cut once the calibration was begun, microseconds: shorter than the engine goes on trying.
const CUT_US: u64 = 4_000_000;

/// Somebody whose wearable is out of reach just when they begin.
struct OutOfReach<Person> {
    person: Person,
    begun_us: Option<u64>,
    /// The first views with a step: time, whether the wearable is waited for, whether it is measured.
    seen: Vec<(u64, bool, bool)>,
    acted: Vec<(u64, Act)>,
    problems: Vec<String>,
}

impl<Person: Hands> OutOfReach<Person> {
    fn new(person: Person) -> Self {
        Self {
            person,
            begun_us: None,
            seen: Vec::new(),
            acted: Vec::new(),
            problems: Vec::new(),
        }
    }
}

impl<Person: Hands> Someone for OutOfReach<Person> {
    fn look(&mut self, view: &View) -> Vec<Act> {
        let problems = view.messages.iter().filter(|message| message.problem);
        self.problems = problems.map(|message| message.text.clone()).collect();
        if let Some(step) = &view.calibration.step {
            let waiting = view.calibration.waiting;
            self.seen.push((view.at_us, waiting, step.measuring));
        }
        let acts = self.person.look(view);
        for act in &acts {
            if matches!(act, Act::Calibrate(_)) {
                self.begun_us.get_or_insert(view.at_us);
            }
            self.acted.push((view.at_us, act.clone()));
        }
        acts
    }

    fn over(&self) -> bool {
        self.acted.contains(&(self.last_us(), Act::CalibrationNext))
    }

    fn meddle(&mut self, devices: &mut SimulatedDevices, now_us: u64) {
        devices.cut(self.begun_us.is_some_and(|us| now_us < us + CUT_US));
    }
}

impl<Person> OutOfReach<Person> {
    fn last_us(&self) -> u64 {
        self.seen.last().map_or(0, |(at_us, ..)| *at_us)
    }

    /// Every press was answered by what it asks for, and none was too early.
    fn check(&self) {
        assert_eq!(self.problems, [""; 0], "nothing was pressed in vain");
        let begun_us = self.begun_us.expect("it was begun");
        let early = self.seen.iter().filter(|seen| seen.0 < begun_us + CUT_US);
        let early: Vec<_> = early.collect();
        assert!(early.len() > 50, "{} views", early.len());
        assert!(early.iter().all(|(_, waiting, _)| *waiting));
        let presses: Vec<&Act> = self.acted.iter().map(|(_, act)| act).collect();
        let [
            Act::Calibrate(_),
            Act::CalibrationStep,
            Act::CalibrationNext,
        ] = presses[..]
        else {
            panic!("each once: {presses:?}");
        };
        let pressed_us = self.acted[1].0;
        assert!(pressed_us >= begun_us + CUT_US);
        let after = self.seen.iter().find(|(at_us, ..)| *at_us > pressed_us);
        assert!(
            after.is_some_and(|(_, _, measuring)| *measuring),
            "the press begins the measurement at once"
        );
    }
}

#[test]
fn the_story_waits_for_a_wearable_that_has_not_answered() {
    let told = run(
        SimulatedConfig::default(),
        OutOfReach::new(Story::default()),
        60,
    );
    told.check();
}

#[test]
fn a_person_at_the_terminal_is_asked_once_it_has_answered() {
    let person = Person {
        name: "ada".to_owned(),
        body_mass_kg: 75.0,
        body_height_m: 1.75,
        mains_hz: None,
    };
    let terminal = Calibrates::new(person, Enter::at_once(), Box::new(|_| {}));
    run(SimulatedConfig::default(), OutOfReach::new(terminal), 60).check();
}
