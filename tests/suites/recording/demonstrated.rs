//! Demonstrations of a recording, as `tonus train` reads them.

use std::path::Path;
use std::process::Command;

use tonus::live::{Act, HandSeen, Input, RobotSeen};
use tonus::source::simulated::SHOULDER;
use tonus_shared::wire::{Packet, Stream};
use tonus_tests::frames::golden_stream;

use crate::exported::export;
use crate::sent::{DEVICE_US, Sender, configuration};

/// A reach of 0.4 m with least jerk, from 0.5 to 1.5 s of a demonstration.
fn hand_x_m(t_s: f64) -> f64 {
    let s = (t_s - 0.5).clamp(0.0, 1.0);
    0.4 * s * s * s * (10.0 + s * (6.0 * s - 15.0))
}

/// Demonstrations begin at 1, 5 and 9 s and take two; the last one is discarded.
const BEGIN_S: [u32; 3] = [1, 5, 9];

fn recorded(path: &Path) {
    let mut sender = Sender::default();
    sender.send(DEVICE_US, &Packet::Configuration(configuration(0.1)), 0);
    let Packet::Stream(golden) = golden_stream() else {
        panic!("golden_stream is one");
    };
    for step in 0..1200_u64 {
        let at_us = step * 10_000;
        let t_s = at_us as f64 * 1e-6;
        let begin = BEGIN_S.iter().rev().find(|&&begin| f64::from(begin) <= t_s);
        let within_s = begin.map_or(0.0, |&begin| t_s - f64::from(begin));
        let hand = HandSeen {
            exposed_us: at_us,
            position_m: SHOULDER.in_tracker_m([hand_x_m(within_s), 0.1, -0.2]),
        };
        sender.entries.push((at_us + 5000, Input::Hand(Some(hand))));
        let robot = RobotSeen {
            measured_us: at_us,
            position_m: [0.5, 0.0, 0.25],
            stiffness_n_per_m: [500.0, 600.0, 700.0],
        };
        sender.entries.push((at_us, Input::Robot(robot)));
        let stream = Stream {
            channels: 2,
            envelopes: [0.25, 0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
            quality: tonus_tests::frames::quality([0; 8]),
            stiffness_n_per_m: [310.5, 222.25, 95.125],
            describes_before_us: 40_000,
            ..golden
        };
        sender.send(DEVICE_US + at_us, &Packet::Stream(stream), 0);
    }
    let mut act = |at_us: u64, act: Act| sender.entries.push((at_us, Input::Act(act)));
    for begin in BEGIN_S {
        let label = "reach".to_owned();
        act(u64::from(begin) * 1_000_000 + 1, Act::Record { label });
        act(u64::from(begin) * 1_000_000 + 2_000_001, Act::Stop);
    }
    let label = "push".to_owned();
    act(8_200_000, Act::Label { id: 2, label });
    act(11_900_000, Act::Discard { id: 3 });
    sender.record(path);
}

#[test]
fn demonstrations_come_out_as_they_were_kept() {
    let folder = tempfile::tempdir().unwrap();
    let recording = folder.path().join("session.mcap");
    recorded(&recording);
    let told = export(&recording, &folder.path().join("session.csv"));
    assert_eq!(told["rows"], 1200);
    assert_eq!(told["demonstrations"]["demonstrations"], 2, "{told}");
    assert_eq!(told["demonstrations"]["problems"], serde_json::json!([]));

    let path = folder.path().join("session-demonstrations.csv");
    let mut lines = csv::Reader::from_path(&path).unwrap();
    let names: Vec<String> = lines.headers().unwrap().iter().map(str::to_owned).collect();
    assert_eq!(names[0], "t_s");
    assert_eq!(names[1..13], tonus::session::DOFS);
    assert_eq!(names[13..], ["label", "trial"]);
    let rows: Vec<csv::StringRecord> = lines.records().collect::<Result<_, _>>().unwrap();
    for label in ["reach", "push"] {
        let of_label = || rows.iter().filter(|row| &row[13] == label);
        let number = |row: &csv::StringRecord, column: usize| row[column].parse::<f64>().unwrap();
        // The hand moves for a second; where it is slow it counts as resting, and a margin is kept.
        let count = of_label().count();
        assert!((60..=125).contains(&count), "{count} rows of {label}");
        // By its place in the reach each row says when it was; times between rows must agree.
        let moving: Vec<_> = of_label()
            .filter(|row| (0.02..0.38).contains(&number(row, 1)))
            .collect();
        assert!(moving.len() > 40);
        for row in &moving {
            let since_s = number(row, 0) - number(moving[0], 0);
            let began_s = crossing(number(moving[0], 1));
            // Clocks are compared to a millisecond or so, at up to 0.75 m/s.
            let expected = hand_x_m(began_s + since_s);
            assert!((number(row, 1) - expected).abs() < 0.003);
            assert_eq!(&row[4], "310.5");
            assert_eq!(&row[12], "700");
        }
    }
    // The reader of `tonus train` reads them.
    let output = Command::new(tonus_tests::program())
        .args(["info".as_ref(), path.as_os_str(), "--json".as_ref()])
        .output()
        .expect("the program runs");
    let seen: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(seen["demonstrations"], 2, "{seen}");
    assert_eq!(seen["skills"][0]["label"], "push");
    assert_eq!(seen["skills"][1]["label"], "reach");
    others_stay(&recording, &path);
}

/// A file whose name nobody gave is not lost; the same again is no loss.
fn others_stay(recording: &Path, path: &Path) {
    let table = path.with_file_name("session.csv");
    export(recording, &table);
    std::fs::write(path, "mine").unwrap();
    std::fs::remove_file(&table).unwrap();
    let refused = Command::new(tonus_tests::program())
        .args(["export".as_ref(), recording.as_os_str(), "-o".as_ref()])
        .arg(&table)
        .output()
        .expect("the program runs");
    assert_eq!(refused.status.code(), Some(1));
    let error = String::from_utf8_lossy(&refused.stderr);
    assert!(
        error.contains("session-demonstrations.csv") && error.contains("name another output"),
        "{error}"
    );
    assert_eq!(std::fs::read_to_string(path).unwrap(), "mine");
    assert!(!table.exists(), "nothing is written");
}

/// When the reach is at `x_m`, seconds, by halving.
fn crossing(x_m: f64) -> f64 {
    let (mut low, mut high) = (0.5, 1.5);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if hand_x_m(middle) < x_m {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}
