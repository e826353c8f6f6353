//! A person at the terminal who goes back, from a step and from the result; and what was found stays to be seen.

use std::sync::mpsc::channel;

use tonus::live::{Act, CalibrationResult, Person, View};
use tonus::source::simulated::SimulatedConfig;
use tonus::studio::hands::Hands;
use tonus::studio::terminal::{Calibrates, Enter, Pressed};
use tonus::studio::virtually::Someone;

use crate::world::run;

struct Watched {
    terminal: Calibrates,
    steps: Vec<(u32, Act)>,
    /// The result while it was there to be used, and when nobody was measured any more.
    offered: Option<CalibrationResult>,
    kept: Option<CalibrationResult>,
}

impl Someone for Watched {
    fn look(&mut self, view: &View) -> Vec<Act> {
        let calibration = &view.calibration;
        match &calibration.step {
            Some(_) => self.offered = calibration.result.clone().or(self.offered.take()),
            None => self.kept.clone_from(&calibration.result),
        }
        let acts = self.terminal.look(view);
        let number = calibration.step.as_ref().map_or(0, |step| step.number);
        self.steps
            .extend(acts.iter().cloned().map(|act| (number, act)));
        acts
    }

    fn over(&self) -> bool {
        self.terminal.over()
    }
}

#[test]
fn back_at_the_terminal_measures_again_and_the_result_stays() {
    let person = Person {
        name: "ada".to_owned(),
        body_mass_kg: 75.0,
        body_height_m: 1.75,
        mains_hz: None,
    };
    let (presses, lines) = channel();
    // Back from step 3 to 2, once; and once from the result.
    let mut backs = vec!["Enter uses this", "step 3 of 23"];
    let say = move |question: &str| {
        let back = backs.last().is_some_and(|from| question.contains(from));
        if back {
            backs.pop();
        }
        let pressed = if back { Pressed::Back } else { Pressed::Enter };
        presses.send(pressed).unwrap();
    };
    let terminal = Calibrates::new(person, Enter::of(lines), Box::new(say));
    let finished = terminal.finished();
    let watched = Watched {
        terminal,
        steps: Vec::new(),
        offered: None,
        kept: None,
    };
    let watched = run(SimulatedConfig::default(), watched, 400);
    assert!(finished.get(), "{:?}", watched.steps);
    let at = |wanted: &Act| -> Vec<u32> {
        let all = watched.steps.iter().filter(|(_, act)| act == wanted);
        all.map(|(number, _)| *number).collect()
    };
    assert_eq!(at(&Act::CalibrationBack), [3, 23]);
    // Each step once, the two gone back to twice.
    let mut measured: Vec<u32> = (1..=22).chain([2, 22]).collect();
    let mut found = at(&Act::CalibrationStep);
    measured.sort_unstable();
    found.sort_unstable();
    assert_eq!(found, measured);
    assert_eq!(at(&Act::CalibrationUse), [23]);
    assert!(watched.offered.is_some());
    assert_eq!(watched.kept, watched.offered, "it stays to be seen");
}
