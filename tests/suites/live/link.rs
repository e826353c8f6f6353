//! A link that is cut while the robot follows, and comes back.

use tonus::live::{Act, View};
use tonus::robot::gate::{Cause, State};
use tonus::robot::limits::Setpoint;
use tonus::source::simulated::{SimulatedConfig, SimulatedDevices};
use tonus::studio::story::Story;
use tonus::studio::virtually::Someone;

use crate::world::run;

/// So long the link is cut, microseconds.
const CUT_US: u64 = 3_000_000;

#[derive(Default)]
struct Cuts {
    story: Story,
    /// When the robot first followed.
    followed_us: Option<u64>,
    cut_us: Option<u64>,
    states: Vec<(u64, State)>,
    seen_after: u64,
    now_us: u64,
}

impl Someone for Cuts {
    fn look(&mut self, view: &View) -> Vec<Act> {
        self.now_us = view.at_us;
        if let Some(cut_us) = self.cut_us {
            // Nobody presses a button any more.
            let mended = view.at_us > cut_us + CUT_US + 1_000_000;
            if mended && view.link.age_ms.is_some_and(|age| age < 100.0) {
                self.seen_after += 1;
            }
            return Vec::new();
        }
        self.story.look(view)
    }

    fn over(&self) -> bool {
        self.cut_us
            .is_some_and(|cut_us| self.now_us > cut_us + CUT_US + 5_000_000)
    }

    fn meddle(&mut self, devices: &mut SimulatedDevices, now_us: u64) {
        if self.followed_us.is_some_and(|us| now_us > us + 1_000_000) && self.cut_us.is_none() {
            self.cut_us = Some(now_us);
        }
        devices.cut(self.cut_us.is_some_and(|cut_us| now_us < cut_us + CUT_US));
    }

    fn set(&mut self, at_us: u64, _setpoint: &Setpoint, state: State) {
        if state == State::Following {
            self.followed_us.get_or_insert(at_us);
        }
        if self.cut_us.is_some() {
            self.states.push((at_us, state));
        }
    }
}

#[test]
fn a_cut_link_holds_falls_back_disarms_and_never_arms_again_by_itself() {
    let cuts = run(SimulatedConfig::default(), Cuts::default(), 400);
    let cut_us = cuts.cut_us.expect("the robot followed");
    let first = |wanted: &dyn Fn(State) -> bool| {
        let found = cuts.states.iter().find(|(_, state)| wanted(*state));
        found.map(|(at_us, _)| at_us - cut_us)
    };
    // Ages count from the scan: those on their way when the link was cut are up to 40 ms old.
    let holds_us = first(&|state| state == State::Holding).expect("it holds");
    let falls_us = first(&|state| state == State::FallingBack).expect("it falls back");
    let disarms_us = first(&|state| matches!(state, State::Disarmed(_))).expect("it disarms");
    println!("held after {holds_us} us, fell back after {falls_us}, disarmed after {disarms_us}");
    assert!(holds_us <= 61_000 && falls_us <= 101_000 && disarms_us <= 501_000);
    assert!(holds_us < falls_us && falls_us < disarms_us);
    let after = cuts
        .states
        .iter()
        .filter(|(at_us, _)| *at_us > cut_us + disarms_us);
    for (at_us, state) in after {
        assert_eq!(*state, State::Disarmed(Cause::Stale), "at {at_us} us");
    }
    assert!(
        cuts.seen_after > 50,
        "the stream came back: {}",
        cuts.seen_after
    );
}
