//! Everything from the wearable comes late while the robot follows: it is that old as long as it does.

use tonus::live::{Act, View};
use tonus::robot::gate::State;
use tonus::robot::limits::Setpoint;
use tonus::source::simulated::{SimulatedConfig, SimulatedDevices};
use tonus::studio::story::Story;
use tonus::studio::virtually::Someone;

use crate::world::run;

/// More than a robot falls back at, less than it is disarmed at, microseconds.
const LATE_US: u64 = 300_000;
const LASTS_US: u64 = 60_000_000;

#[derive(Default)]
struct Lags {
    story: Story,
    followed_us: Option<u64>,
    late_us: Option<u64>,
    now_us: u64,
    followed_late: Vec<u64>,
    ages_ms: Vec<f64>,
    told: Vec<String>,
}

impl Lags {
    /// Since everything comes late: time enough for the first that does.
    fn late(&self, now_us: u64) -> bool {
        let since_us = self.late_us.map(|us| now_us.saturating_sub(us));
        since_us.is_some_and(|us| (1_000_000..LASTS_US).contains(&us))
    }
}

impl Someone for Lags {
    fn look(&mut self, view: &View) -> Vec<Act> {
        self.now_us = view.at_us;
        if self.late_us.is_none() {
            return self.story.look(view);
        }
        // Nobody presses a button any more.
        for message in &view.messages {
            if !self.told.contains(&message.text) {
                self.told.push(message.text.clone());
            }
        }
        if self.late(view.at_us) {
            self.ages_ms.extend(view.link.age_ms);
        }
        Vec::new()
    }

    fn over(&self) -> bool {
        self.late_us
            .is_some_and(|us| self.now_us > us + LASTS_US + 3_000_000)
    }

    fn meddle(&mut self, devices: &mut SimulatedDevices, now_us: u64) {
        if self.followed_us.is_some_and(|us| now_us > us + 1_000_000) && self.late_us.is_none() {
            self.late_us = Some(now_us);
        }
        let late = self.late_us.is_some_and(|us| now_us < us + LASTS_US);
        devices.hold_back(if late { LATE_US } else { 0 });
    }

    fn set(&mut self, at_us: u64, _setpoint: &Setpoint, state: State) {
        if state == State::Following {
            self.followed_us.get_or_insert(at_us);
            if self.late(at_us) {
                self.followed_late.push(at_us);
            }
        }
    }
}

#[test]
fn what_comes_late_stays_old_and_is_never_followed() {
    let lags = run(SimulatedConfig::default(), Lags::default(), 500);
    assert!(lags.ages_ms.len() > 1_000, "the robot followed");
    let youngest_ms = lags.ages_ms.iter().copied().fold(f64::INFINITY, f64::min);
    println!("youngest {youngest_ms} ms; {:?}", lags.told);
    // The clock's figure is a millisecond, and a view shows a packet that came up to 40 ms ago.
    assert!(youngest_ms >= 295.0, "{youngest_ms} ms");
    assert_eq!(lags.followed_late, [0; 0]);
    let says = |text: &str| lags.told.iter().any(|told| told.contains(text));
    assert!(says("later than they did") && !says("clock stepped"));
}
