//! A view that takes longer than the time between two of them: what happens is taken all the same.

use std::sync::Arc;

use tonus::calibration::Profile;
use tonus::library::Library;
use tonus::live::{Engine, Input, LearnJob, Request, View, World, simulated};
use tonus::robot::command::Command;
use tonus::robot::gate::State;
use tonus::robot::limits::Setpoint;
use tonus::source::LinkChoice;
use tonus::studio::setup;

use crate::world::config;

const END_US: u64 = 10_000_000;
/// An input so often, as from a wearable.
const EVERY_US: u64 = 10_000;
/// What a view costs at a movement's begin on a slow computer.
const VIEW_US: u64 = 75_000;

#[derive(Default)]
struct Slow {
    now_us: u64,
    /// When the oldest input that waits came.
    waits_us: u64,
    longest_us: u64,
    views: u64,
}

impl World for Slow {
    fn next(&mut self) -> Option<(u64, Option<Input>)> {
        if self.now_us >= END_US {
            return None;
        }
        let waited_us = self.now_us.checked_sub(self.waits_us);
        self.now_us += 1_000;
        let Some(waited_us) = waited_us else {
            return Some((self.now_us, None));
        };
        self.longest_us = self.longest_us.max(waited_us);
        self.waits_us += EVERY_US;
        Some((self.now_us, Some(Input::Hand(None))))
    }

    fn took(&mut self, _at_us: u64, _input: &Input) {}

    fn ask(&mut self, _at_us: u64, _request: Request) {}

    fn learn(&mut self, _job: LearnJob) {}

    fn learnt(&mut self) -> Option<Arc<Library>> {
        None
    }

    fn measured(&mut self, _profile: &Profile) {}

    fn commanded(&mut self, _at_us: u64, _command: &Command) {}

    fn set(&mut self, _at_us: u64, _setpoint: &Setpoint, _state: State) {}

    fn show(&mut self, _view: &View) {
        self.views += 1;
        self.now_us += VIEW_US;
    }
}

#[test]
fn slow_views_keep_nothing_waiting() {
    let config = config();
    let told = setup::engine(&config, &LinkChoice::Simulated).unwrap();
    let body = simulated(config.robot.home_m, config.robot.payload_kg).unwrap();
    let mut engine = Engine::new(told, body, None).unwrap();
    let mut world = Slow::default();
    engine.run(&mut world).unwrap();
    assert!(
        world.longest_us <= VIEW_US + EVERY_US,
        "{} us",
        world.longest_us
    );
    assert!((25..=40).contains(&world.views), "{} views", world.views);
}
