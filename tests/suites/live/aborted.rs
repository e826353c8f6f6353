//! A calibration that is given up while the wearable is out of reach: its levels mean nothing until those of before are back.

use tonus::live::{Act, Input, View};
use tonus::robot::command::Command;
use tonus::source::simulated::{SimulatedConfig, SimulatedDevices};
use tonus::studio::virtually::Someone;
use tonus_shared::wire::{Calibration, Packet, decode};

use crate::world::{run, somebody};

/// Longer than the engine goes on asking for one answer, microseconds.
const CUT_US: u64 = 20_000_000;

#[derive(Default)]
struct GivesUp {
    began: bool,
    cut_us: Option<u64>,
    cancelled: bool,
    now_us: u64,
    /// What the wearable said that it works with, and when.
    told: Vec<(u64, Calibration)>,
    /// Whether anybody was told why the robot cannot be armed.
    refused: bool,
    armed: bool,
}

impl Someone for GivesUp {
    fn look(&mut self, view: &View) -> Vec<Act> {
        self.now_us = view.at_us;
        self.armed |= view.robot.state == "following";
        let text = "levels of a measurement";
        self.refused |= view.messages.iter().any(|told| told.text.contains(text));
        if !self.began {
            self.began = !self.told.is_empty() && view.semg.is_some() && !view.calibration.waiting;
            return if self.began {
                vec![Act::Calibrate(somebody())]
            } else {
                Vec::new()
            };
        }
        let Some(cut_us) = self.cut_us else {
            let answered = view.calibration.step.is_some() && !view.calibration.waiting;
            // Out of reach first, so that nothing of what follows arrives.
            self.cut_us = answered.then_some(view.at_us);
            return Vec::new();
        };
        if !self.cancelled {
            self.cancelled = true;
            return vec![Act::CalibrationCancel];
        }
        // Somebody who wants to go on.
        let restored = self.told.last().is_some_and(|(us, _)| *us > cut_us);
        if restored { Vec::new() } else { vec![Act::Arm] }
    }

    fn over(&self) -> bool {
        self.cut_us
            .is_some_and(|us| self.now_us > us + CUT_US + 12_000_000)
    }

    fn meddle(&mut self, devices: &mut SimulatedDevices, now_us: u64) {
        devices.cut(self.cut_us.is_some_and(|us| now_us < us + CUT_US));
    }

    fn commanded(&mut self, _devices: &SimulatedDevices, _at_us: u64, _command: &Command) {
        panic!("there are no skills");
    }

    fn input(&mut self, at_us: u64, input: &Input) {
        let Input::Frame(bytes) = input else { return };
        let Ok(frame) = decode(bytes) else { return };
        if let Packet::Calibration(calibration) = frame.packet {
            self.told.push((at_us, calibration));
        }
    }
}

#[test]
fn the_levels_of_before_go_back_however_long_the_wearable_was_away() {
    let seen = run(SimulatedConfig::default(), GivesUp::default(), 200);
    let cut_us = seen.cut_us.expect("it was begun and given up");
    let (_, before) = seen.told.first().expect("it told what it works with");
    let after: Vec<_> = seen.told.iter().filter(|(us, _)| *us > cut_us).collect();
    // It says what it was left with, and then what it has again.
    let [(_, left), .., (_, last)] = &after[..] else {
        panic!("{after:?}");
    };
    assert_eq!(left.mvc_v[0], 1e-3, "the levels of a measurement");
    assert_ne!(before.mvc_v[0], 1e-3);
    assert_eq!(last, before);
    assert!(seen.refused && !seen.armed);
}
