//! Somebody who was measured before.

use tonus::calibration::Profile;
use tonus::live::{Act, Lamp, Person, View};
use tonus::source::simulated::SimulatedConfig;
use tonus::studio::hands::Hands;
use tonus::studio::terminal::{Calibrates, Enter};
use tonus::studio::virtually::Someone;

use crate::world::{run, somebody};

struct Measured {
    hands: Calibrates,
    profile: Option<Profile>,
}

impl Someone for Measured {
    fn look(&mut self, view: &View) -> Vec<Act> {
        self.hands.look(view)
    }

    fn over(&self) -> bool {
        self.profile.is_some()
    }

    fn measured(&mut self, profile: &Profile) {
        self.profile = Some(profile.clone());
    }
}

pub(crate) fn profile(seed: u64) -> Profile {
    let person = Person {
        name: "Zoë, left".to_owned(),
        ..somebody()
    };
    let hands = Calibrates::new(person, Enter::at_once(), Box::new(|_| {}));
    let measured = Measured {
        hands,
        profile: None,
    };
    let devices = SimulatedConfig {
        seed,
        ..SimulatedConfig::default()
    };
    run(devices, measured, 200).profile.unwrap()
}

/// Recalls somebody, then has the fit checked.
#[derive(Default)]
struct Recalls {
    act: Option<Act>,
    in_use: Option<String>,
    asked: bool,
    fit: Option<Lamp>,
    problems: Vec<String>,
}

impl Someone for Recalls {
    fn look(&mut self, view: &View) -> Vec<Act> {
        self.in_use.clone_from(&view.calibration.in_use);
        self.fit = view.calibration.fit.as_ref().map(|fit| fit.lamp);
        for message in view.messages.iter().filter(|message| message.problem) {
            if !self.problems.contains(&message.text) {
                self.problems.push(message.text.clone());
            }
        }
        if let Some(act) = self.act.take() {
            return vec![act];
        }
        if self.in_use.is_none() || self.fit.is_some() {
            return Vec::new();
        }
        match &view.calibration.step {
            None if self.asked => Vec::new(),
            None => {
                self.asked = true;
                vec![Act::CheckFit]
            }
            Some(step) if step.done => vec![Act::CalibrationNext],
            Some(step) if step.measuring => Vec::new(),
            Some(_) => vec![Act::CalibrationStep],
        }
    }

    fn over(&self) -> bool {
        self.fit.is_some()
    }
}

fn recall(seed: u64, act: Act) -> Recalls {
    let person = Recalls {
        act: Some(act),
        ..Recalls::default()
    };
    let devices = SimulatedConfig {
        seed,
        ..SimulatedConfig::default()
    };
    run(devices, person, 40)
}

#[test]
fn a_person_measured_before_is_used_and_checked_without_measuring_again() {
    let profile = profile(5);
    let again = Profile::parse(&profile.text()).unwrap();
    assert_eq!(again, profile);
    let recalled = recall(
        5,
        Act::Recall {
            name: profile.person.name.clone(),
            profile: Some(Box::new(again)),
        },
    );
    assert_eq!(recalled.in_use.as_deref(), Some("Zoë, left"));
    assert_eq!(recalled.fit, Some(Lamp::Good), "{:?}", recalled.problems);

    // Another wearable: its third electrode sits on another head.
    let text = profile.text().replace("triceps_lateral", "other");
    let other = Profile::parse(&text).unwrap();
    let refused = recall(
        5,
        Act::Recall {
            name: profile.person.name,
            profile: Some(Box::new(other)),
        },
    );
    assert_eq!(refused.in_use, None);
    assert!(
        refused
            .problems
            .iter()
            .any(|text| text.contains("another wearable")),
        "{:?}",
        refused.problems
    );

    let nobody = recall(
        5,
        Act::Recall {
            name: "nobody".to_owned(),
            profile: None,
        },
    );
    assert_eq!(nobody.in_use, None);
    assert!(
        nobody
            .problems
            .iter()
            .any(|text| text.contains("calibrate")),
        "{:?}",
        nobody.problems
    );
}
