//! Real recordings: nine bursts of a biceps, rest below every gesture on two Myo data sets.

use std::collections::BTreeMap;
use std::path::Path;

use tonus_shared::Real;
use tonus_shared::semg::bursts::{BurstConfig, BurstDetector, BurstState, Edge};
use tonus_shared::semg::chain::{Chain, ChainConfig, ChainState};
use tonus_tests::recordings;

use crate::envelopes::stream;
use crate::{column, table};

/// Onset and offset times, s. A burst still under way at the end has no offset and is not counted.
pub(crate) fn bursts<T: Real>(config: &BurstConfig, envelope: &[f64]) -> Vec<(f64, f64)> {
    let detector = BurstDetector::<T>::new(config).unwrap();
    let mut state = BurstState::new();
    let (mut onset, mut found) = (0, Vec::new());
    for (n, value) in (0_u32..).zip(envelope) {
        match detector.step(&mut state, T::of(*value)).unwrap() {
            Some(Edge::Onset { ago }) => onset = n - ago,
            Some(Edge::Offset { ago }) => {
                let second = |n: u32| f64::from(n) / config.rate_hz;
                found.push((second(onset), second(n - ago)));
            }
            None => {}
        }
    }
    found
}

#[test]
fn nine_bursts_of_a_real_biceps() {
    let path = recordings().join("biosignalsplux_biceps_mit/csv/emg_bursts.csv");
    let x = column(&path, "emg0");
    let envelope = stream::<f32>(&ChainConfig::at_rate(1000.0), &x);
    let default = BurstConfig::at_rate(1000.0);
    for scale in [0.8, 0.9, 1.0, 1.1, 1.2] {
        let config = BurstConfig {
            threshold: scale * default.threshold,
            ..default
        };
        let found = bursts::<f32>(&config, &envelope);
        println!("threshold x {scale}: {found:.2?}");
        assert_eq!(found.len(), 9, "threshold x {scale}");
        assert_eq!(found, bursts::<f64>(&config, &envelope));
        // Cyclic contractions: each lasts 0.5 to 2 s, one about every 3 s.
        assert!(
            found
                .iter()
                .all(|(on, off)| (0.5..2.5).contains(&(off - on)))
        );
        assert!(
            found
                .windows(2)
                .all(|pair| (1.5..5.0).contains(&(pair[1].0 - pair[0].0)))
        );
    }
}

/// Mean envelope over all eight channels of a Myo, per value of `group(row)`; runs of rows with one
/// `file(row)` are separate recordings, whose first half second settles.
fn myo_levels(
    path: &Path,
    file: impl Fn(&csv::StringRecord) -> String,
    group: impl Fn(&csv::StringRecord) -> String,
) -> BTreeMap<String, f64> {
    let (header, rows) = table(path);
    let first = header.iter().position(|name| name == "emg0").unwrap();
    let chain = Chain::<f32>::design(&ChainConfig::at_rate(200.0)).unwrap();
    let mut sums: BTreeMap<String, (f64, f64)> = BTreeMap::new();
    let (mut states, mut present, mut age) = ([ChainState::new(); 8], String::new(), 0);
    for row in &rows {
        if file(row) != present {
            (states, present, age) = ([ChainState::new(); 8], file(row), 0);
        }
        let mut level = 0.0;
        for (channel, state) in states.iter_mut().enumerate() {
            let count: f32 = row[first + channel].parse().unwrap();
            level += f64::from(chain.step(state, count).unwrap());
        }
        age += 1;
        if age > 100 {
            let sum = sums.entry(group(row)).or_default();
            *sum = (sum.0 + level, sum.1 + 1.0);
        }
    }
    sums.into_iter()
        .map(|(group, (sum, count))| (group, sum / count / 8.0))
        .collect()
}

#[test]
fn libemg_myo_rest_is_below_every_gesture() {
    let path = recordings().join("libemg_myo_mit/csv/myo_dataset.csv");
    let (header, _) = table(&path);
    let at = |name: &str| header.iter().position(|h| h == name).unwrap();
    let (label, trial) = (at("label"), at("trial"));
    let name = |row: &csv::StringRecord| format!("{} {}", &row[trial], &row[label]);
    let levels = myo_levels(&path, name, name);
    assert_eq!(levels.len(), 20);
    for rep in 0..4 {
        let level = |class: usize| levels[&format!("rep{rep} class{class}")];
        println!("rep{rep}: {:.2?}", [0, 1, 2, 3, 4].map(level));
        for gesture in [0, 1, 3, 4] {
            assert!(level(2) < level(gesture), "rep{rep} class{gesture}");
        }
    }
}

#[test]
fn wrist_myo_rest_is_below_every_gesture() {
    let folder = recordings().join("myo_readings_wrist_mit/csv");
    let (mut gestures, mut highest_rest, mut lowest_gesture) = (0, 0.0_f64, f64::INFINITY);
    for entry in std::fs::read_dir(&folder).unwrap() {
        let path = entry.unwrap().path();
        let (header, _) = table(&path);
        let label = header.iter().position(|h| h == "label").unwrap();
        let levels = myo_levels(&path, |_| "one".into(), |row| row[label].to_string());
        println!("{}: {levels:.2?}", path.file_name().unwrap().display());
        for (name, level) in levels {
            if name == "hibernation" {
                highest_rest = highest_rest.max(level);
            } else {
                gestures += 1;
                lowest_gesture = lowest_gesture.min(level);
            }
        }
    }
    assert_eq!(gestures, 6);
    // Of any file and either person, though no two need have worn the bracelet alike.
    assert!(
        highest_rest < lowest_gesture,
        "{highest_rest} {lowest_gesture}"
    );
}
