//! A wearable whose levels were measured on nobody: nobody is followed by them, unless they are the illustrative ones that say so.

use std::sync::Arc;

use tonus::calibration::Profile;
use tonus::demo::{self, DemoConfig};
use tonus::library::Library;
use tonus::live::{Act, Request, View};
use tonus::source::simulated::{SimulatedConfig, SimulatedDevices};
use tonus::studio::virtually::Someone;
use tonus_shared::pipeline::illustrative;
use tonus_shared::wire::{Calibration, Header, MAX_FRAME_BYTES, Muscle, Packet, encode};

use crate::recalled::profile;
use crate::world::run_with;

/// What the wearable has from a host that is not there any more: revision 0.
fn found() -> Calibration {
    let muscles = [
        Muscle::BicepsShort,
        Muscle::BicepsLong,
        Muscle::TricepsLateral,
        Muscle::TricepsLong,
    ];
    let mut found = illustrative(muscles, 1_000);
    for level in &mut found.mvc_v[..4] {
        *level = 3e-4;
    }
    found
}

/// Presses Arm as soon as there is a page, and does what they are told to.
struct Arms {
    finds: Option<Calibration>,
    recalls: Option<Profile>,
    first: Option<String>,
    messages: Vec<String>,
    could_before: bool,
    armed_us: Option<u64>,
    recalled_us: Option<u64>,
    now_us: u64,
}

impl Someone for Arms {
    fn look(&mut self, view: &View) -> Vec<Act> {
        self.now_us = view.at_us;
        for told in view.messages.iter().filter(|told| told.problem) {
            self.first.get_or_insert(told.text.clone());
            if !self.messages.contains(&told.text) {
                self.messages.push(told.text.clone());
            }
        }
        if view.calibration.in_use.is_some() {
            self.recalled_us.get_or_insert(view.at_us);
        }
        if view.robot.state == "following" {
            self.armed_us.get_or_insert(view.at_us);
        }
        self.could_before |= view.robot.can_arm && self.recalled_us.is_none();
        if view.at_us > 6_000_000
            && let Some(profile) = self.recalls.take()
        {
            return vec![Act::Recall {
                name: profile.person.name.clone(),
                profile: Some(Box::new(profile)),
            }];
        }
        vec![Act::Arm]
    }

    fn over(&self) -> bool {
        self.now_us > 12_000_000
    }

    fn meddle(&mut self, devices: &mut SimulatedDevices, now_us: u64) {
        let Some(calibration) = self.finds.take() else {
            return;
        };
        let header = Header {
            boot_id: 99,
            sequence: 0,
            device_us: 0,
        };
        let mut bytes = [0; MAX_FRAME_BYTES];
        let length = encode(&header, &Packet::Calibration(calibration), &mut bytes).unwrap();
        devices.ask(Request::Frame(bytes[..length].to_vec()), now_us);
    }
}

fn arms(library: &Arc<Library>, finds: Option<Calibration>, recalls: Option<Profile>) -> Arms {
    let person = Arms {
        finds,
        recalls,
        first: None,
        messages: Vec::new(),
        could_before: false,
        armed_us: None,
        recalled_us: None,
        now_us: 0,
    };
    let devices = SimulatedConfig {
        seed: 5,
        ..SimulatedConfig::default()
    };
    run_with(Some(Arc::clone(library)), devices, person, 20)
}

#[test]
fn nobody_is_followed_by_levels_that_nobody_knows() {
    let library = Arc::new(demo::learn_skills(&DemoConfig::default()).unwrap());
    let told = |arms: &Arms, what: &str| arms.messages.iter().any(|text| text.contains(what));

    // The illustrative levels say themselves that they are nobody's; with them the robot can be tried.
    let tried = arms(&library, None, None);
    assert!(tried.armed_us.is_some() && tried.could_before);
    assert!(!told(&tried, "nobody knows"), "{:?}", tried.messages);
    // Before the wearable has said what it works with, nobody arms either.
    let first = tried.first.as_deref().unwrap();
    assert!(first.contains("has not told"), "{first}");

    let found = arms(&library, Some(found()), Some(profile(5)));
    assert!(
        told(&found, "nobody knows: calibrate, or recall a person"),
        "{:?}",
        found.messages
    );
    assert!(!found.could_before, "no button that would be refused");
    let recalled_us = found.recalled_us.expect("a person is recalled");
    assert!(found.armed_us.is_some_and(|us| us >= recalled_us));

    // Nobody recalls anybody: it is never armed.
    let never = arms(&library, Some(self::found()), None);
    assert_eq!(never.armed_us, None);
}
