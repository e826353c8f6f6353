//! A hand that the tracker does not see any more while the robot follows.

use tonus::live::{Act, View};
use tonus::robot::gate::State;
use tonus::robot::limits::Setpoint;
use tonus::source::simulated::{SimulatedConfig, SimulatedDevices};
use tonus::studio::story::Story;
use tonus::studio::virtually::Someone;

use crate::world::run;

/// So long the tracker is covered, microseconds.
const COVERED_US: u64 = 3_000_000;

#[derive(Default)]
struct Covers {
    story: Story,
    /// When the robot first followed.
    followed_us: Option<u64>,
    covered_us: Option<u64>,
    told: Vec<(u64, Setpoint, State)>,
    stepped_n_per_m: f32,
    last_n_per_m: Option<f32>,
    now_us: u64,
}

impl Someone for Covers {
    fn look(&mut self, view: &View) -> Vec<Act> {
        self.now_us = view.at_us;
        if self.covered_us.is_some() {
            for value in view.trace.stiffness_n_per_m.first().into_iter().flatten() {
                let before = self.last_n_per_m.replace(*value).unwrap_or(*value);
                self.stepped_n_per_m = self.stepped_n_per_m.max((value - before).abs() / before);
            }
            return Vec::new();
        }
        self.story.look(view)
    }

    fn over(&self) -> bool {
        self.covered_us
            .is_some_and(|us| self.now_us > us + COVERED_US + 1_000_000)
    }

    fn meddle(&mut self, devices: &mut SimulatedDevices, now_us: u64) {
        let moving = devices.performing(now_us).is_some_and(|(_, s)| s > 0.5);
        if self.followed_us.is_some() && moving && self.covered_us.is_none() {
            self.covered_us = Some(now_us);
        }
        devices.cover(self.covered_us.is_some_and(|us| now_us < us + COVERED_US));
    }

    fn set(&mut self, at_us: u64, setpoint: &Setpoint, state: State) {
        if state == State::Following {
            self.followed_us.get_or_insert(at_us);
        }
        if self.covered_us.is_some() {
            self.told.push((at_us, *setpoint, state));
        }
    }
}

#[test]
fn a_hand_that_is_not_seen_holds_the_robot_and_does_not_step_the_stiffness() {
    let covers = run(SimulatedConfig::default(), Covers::default(), 400);
    let covered_us = covers.covered_us.expect("the robot followed a movement");
    let within = |from_us: u64, to_us: u64| {
        let since = move |at_us: u64| at_us - covered_us;
        covers
            .told
            .iter()
            .filter(move |(at_us, ..)| (from_us..to_us).contains(&since(*at_us)))
    };
    // 0.3 s after the last picture, itself up to 16 ms on its way, and a packet later the robot stands.
    let held: Vec<_> = within(350_000, COVERED_US).collect();
    assert!(held.len() > 2_000);
    assert!(held.iter().all(|(_, _, state)| *state != State::Following));
    let place = held[0].1.position_m;
    assert!(
        held.iter()
            .all(|(_, setpoint, _)| setpoint.position_m == place)
    );
    // What is held is not held for ever.
    let soft = within(2_000_000, COVERED_US).all(|(_, _, state)| *state == State::FallingBack);
    assert!(soft);
    println!(
        "stiffness stepped by {:.3} of itself at most",
        covers.stepped_n_per_m
    );
    // A packet every 10 ms, some lost: the wearable's own blending takes a third of a second.
    assert!(covers.stepped_n_per_m < 0.15, "{}", covers.stepped_n_per_m);
}
