//! Times of exported tables against the truth of the simulation.

use std::collections::HashMap;

use tonus::export::{Cell, Rows};
use tonus::live::{Act, Input, Timed, View};
use tonus::recording::{Entry, Opening, Recorder};
use tonus::source::simulated::{SimulatedConfig, SimulatedDevices};
use tonus::studio::virtually::Someone;
use tonus_shared::wire::decode;

use crate::world::{config, run};

struct Stamped {
    recorder: Recorder,
    noted: u64,
    /// When scans were truly taken, by the wearable's clock.
    truly_us: HashMap<u64, u64>,
    new: Vec<u64>,
}

impl Someone for Stamped {
    fn look(&mut self, _view: &View) -> Vec<Act> {
        Vec::new()
    }

    fn input(&mut self, at_us: u64, input: &Input) {
        if let Input::Frame(bytes) = input
            && let Ok(frame) = decode(bytes)
        {
            self.new.push(frame.header.device_us);
        }
        let input = input.clone();
        self.recorder.note(Entry::Input(Timed { at_us, input }));
        self.noted += 1;
        while self.noted > self.recorder.written() + 1_000 {
            std::thread::sleep(std::time::Duration::from_millis(1));
        }
    }

    fn meddle(&mut self, devices: &mut SimulatedDevices, _now_us: u64) {
        for device_us in self.new.drain(..) {
            let truly_us = devices.truly_us(device_us);
            self.truly_us.insert(device_us, truly_us);
        }
    }
}

#[test]
fn exported_times_are_those_of_the_scans() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("minute.mcap");
    let opening = Opening {
        configuration: config().text(),
        ..Opening::default()
    };
    let person = Stamped {
        recorder: Recorder::create(&file, &opening).unwrap(),
        noted: 0,
        truly_us: HashMap::new(),
        new: Vec::new(),
    };
    let person = run(SimulatedConfig::default(), person, 60);
    assert_eq!(person.recorder.finish().unwrap().dropped, 0);
    let rows = Rows::open(&file).unwrap();
    let of = |name: &str| rows.columns().iter().position(|c| c.name == name).unwrap();
    let (t_s, device_us) = (of("t_s"), of("device_us"));
    let mut errors_us = Vec::new();
    for row in rows {
        let row = row.unwrap();
        let (Cell::Number(t_s), Cell::Number(device_us)) = (&row[t_s], &row[device_us]) else {
            panic!("both are known");
        };
        let truly_us = person.truly_us.get(&(*device_us as u64));
        // After half a minute, as the clock promises.
        if let Some(&truly_us) = truly_us.filter(|us| **us > 30_000_000) {
            errors_us.push((t_s * 1e6 - truly_us as f64).abs());
        }
    }
    errors_us.sort_by(f64::total_cmp);
    let p95_us = errors_us[errors_us.len() * 95 / 100];
    println!("p95 {p95_us:.0} us of {}", errors_us.len());
    assert!(errors_us.len() > 2_000);
    assert!(p95_us <= 1_000.0, "{p95_us} us");
}
