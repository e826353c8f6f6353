//! The whole story: connect, calibrate, record, train, arm, follow, disarm.

use tonus::live::{Act, View};
use tonus::robot::gate::State;
use tonus::robot::limits::{Limits, Setpoint};
use tonus::source::simulated::{SimulatedConfig, SimulatedDevices};
use tonus::studio::story::Story;
use tonus::studio::virtually::Someone;

use crate::world::run;

/// One movement as the engine saw it, and what the person truly did in its midst.
#[derive(Debug, Default, Clone)]
struct Movement {
    truth: Option<&'static str>,
    taken_for: Option<String>,
}

/// Tells the story, and notes what came of it.
#[derive(Default)]
struct Scored {
    story: Story,
    truth: Option<&'static str>,
    now: Option<Movement>,
    movements: Vec<Movement>,
    followed: usize,
    calibration: Option<tonus::live::CalibrationResult>,
    held_out: Option<[usize; 2]>,
}

impl Someone for Scored {
    fn meddle(&mut self, devices: &mut SimulatedDevices, now_us: u64) {
        let performing = devices.performing(now_us);
        let midst = performing.filter(|(_, s)| (0.3..0.7).contains(s));
        self.truth = midst.map(|(label, _)| label);
    }

    fn look(&mut self, view: &View) -> Vec<Act> {
        if view.calibration.result.is_some() {
            self.calibration.clone_from(&view.calibration.result);
        }
        self.held_out = view.library.held_out.or(self.held_out);
        match view.recognition.as_ref().filter(|r| r.under_way) {
            None => self.movements.extend(self.now.take()),
            Some(recognition) => {
                let now = self.now.get_or_insert_default();
                now.truth = now.truth.or(self.truth);
                let likely = recognition.labels.iter().zip(&recognition.posterior);
                let best = likely.max_by(|a, b| a.1.total_cmp(b.1));
                let known = best.filter(|_| !recognition.unknown);
                now.taken_for = known.map(|(label, _)| label.clone());
            }
        }
        self.story.look(view)
    }

    fn over(&self) -> bool {
        self.story.over()
    }

    fn set(&mut self, _at_us: u64, setpoint: &Setpoint, state: State) {
        self.followed += usize::from(state == State::Following);
        let limits = Limits::default();
        assert_eq!(limits.inside(&setpoint.position_m), setpoint.position_m);
        let [least, most] = limits.stiffness_n_per_m;
        let fine = (setpoint.stiffness_n_per_m.iter()).all(|k| (least..=most).contains(k));
        assert!(fine, "{setpoint:?}");
    }
}

/// Three people, with `TONUS_FULL` twenty whom nobody looked at while this was built: everything is done to its end, and most
/// of what they do is recognised; what is in no demonstration is not taken for a skill in most cases.
#[test]
fn the_whole_story_plays_with_simulated_devices() {
    let (mut right, mut known, mut unknown, mut waves) = (0, 0, 0, 0);
    let full = std::env::var_os("TONUS_FULL").is_some();
    for seed in if full { 121..=140 } else { 1..=3 } {
        let devices = SimulatedConfig {
            seed,
            ..SimulatedConfig::default()
        };
        let scored = run(devices, Scored::default(), 400);
        let told = scored.story.told();
        assert_eq!(told.stuck, None);
        assert_eq!(told.performed.len(), 6);
        assert!(
            scored.followed > 5_000,
            "the robot followed {} ms",
            scored.followed
        );
        for movement in &scored.movements {
            match movement.truth {
                Some("wave") => {
                    waves += 1;
                    unknown += usize::from(movement.taken_for.is_none());
                }
                Some(truth) => {
                    known += 1;
                    right += usize::from(movement.taken_for.as_deref() == Some(truth));
                }
                None => {}
            }
        }
        let [held_out, all] = scored.held_out.unwrap();
        assert!(all == 15 && held_out >= 12, "{held_out} of {all} held out");
        let fitted = scored.calibration.unwrap();
        println!(
            "seed {seed}: {:?} l1 {:?} l2 {:?}",
            scored.movements, fitted.l1, fitted.l2
        );
        // The simulated person's joints: 13, 13, 12, 12 N m/rad.
        let truly = [13.0, 13.0, 12.0, 12.0];
        for (found, truly) in fitted.rest_stiffness_nm_per_rad.iter().zip(truly) {
            let off = (found.value - truly).abs();
            assert!(
                off < 4.0 * found.std && found.std < 0.3 * truly,
                "{found:?} for {truly}"
            );
        }
    }
    println!("{right} of {known} recognised, {unknown} of {waves} waves unknown");
    assert!(5 * right >= 4 * known, "{right} of {known}");
    assert!(waves > 0 && 2 * unknown >= waves, "{unknown} of {waves}");
}
