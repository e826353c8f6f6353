//! Recordings as other programs read them: pyedflib, pyarrow, and Python's own csv.

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;
use tonus::live::{Act, HandSeen, Input, RobotSeen};
use tonus_shared::wire::{Packet, RawSemg, Stream};
use tonus_tests::frames::golden_stream;

use crate::sent::{DEVICE_US, Sender, configuration};

/// Scans of a raw packet; one is sent every 20 ms.
const SCANS: u32 = 20;
const PACKETS: u32 = 150;

/// Both channels count their scans: upwards, and downwards twice as fast.
fn counts(scan: u32) -> [i32; 2] {
    let at = i32::try_from(scan % 1000).expect("small");
    [100 + at, 100 - 2 * at]
}

/// Three seconds: packets 60 to 64 are lost, packet 80 comes behind the next two.
fn record(path: &Path, microvolts_per_count: f32) {
    let mut sender = Sender::default();
    let label = "lift".to_owned();
    (sender.entries).push((0, Input::Act(Act::Record { label })));
    let configuration = configuration(microvolts_per_count);
    sender.send(DEVICE_US, &Packet::Configuration(configuration), 0);
    for packet in 0..PACKETS {
        let first = packet * SCANS;
        let newest_us = DEVICE_US + u64::from(first + SCANS - 1) * 1000;
        let all = (first..first + SCANS).flat_map(counts);
        let raw = RawSemg {
            first_index: first,
            channels: 2,
            counts: all.collect(),
        };
        if !(60..65).contains(&packet) {
            let late_us = if packet == 80 { 45_000 } else { 0 };
            sender.send(newest_us, &Packet::RawSemg(raw), late_us);
        }
        let Packet::Stream(stream) = golden_stream() else {
            panic!("golden_stream is one");
        };
        let stream = Stream {
            channels: 2,
            activation: packet as f32 / 100.0,
            envelopes: [0.25, 0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
            quality: tonus_tests::frames::quality([0, 2, 0, 0, 0, 0, 0, 0]),
            describes_before_us: 40_000,
            ..stream
        };
        sender.send(newest_us, &Packet::Stream(stream), 0);
        if packet == 10 {
            let position_m = [0.125, -0.5, 0.3];
            let hand = HandSeen {
                exposed_us: 250_000,
                position_m,
            };
            sender.entries.push((255_000, Input::Hand(Some(hand))));
        }
        if packet == 100 {
            sender.entries.push((2_100_000, Input::Hand(None)));
            let robot = RobotSeen {
                measured_us: 2_100_000,
                position_m: [0.4, 0.0, f64::NAN],
                stiffness_n_per_m: [500.0, 600.0, 700.0],
            };
            sender.entries.push((2_100_000, Input::Robot(robot)));
            sender.entries.push((2_000_500, Input::Act(Act::Stop)));
        }
    }
    sender.record(path);
}

pub(crate) fn export(recording: &Path, output: &Path) -> Value {
    let output = Command::new(tonus_tests::program())
        .arg("export")
        .arg(recording)
        .arg("-o")
        .arg(output)
        .arg("--json")
        .output()
        .expect("the program runs");
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{error}");
    serde_json::from_slice(&output.stdout).expect("JSON")
}

fn python(script: &str, arguments: &[&Path]) -> Value {
    let output = Command::new("python3")
        .args(["-c", script])
        .args(arguments)
        .output()
        .expect("python3 is needed for this test");
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{error}");
    serde_json::from_slice(&output.stdout).expect("JSON")
}

fn fresh(microvolts_per_count: f32) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("session.mcap");
    record(&path, microvolts_per_count);
    (folder, path)
}

fn close(got: &Value, expected: f64, within: f64) {
    let number = got.as_f64().unwrap_or_else(|| panic!("{got} is no number"));
    assert!(
        (number - expected).abs() <= within,
        "{number} for {expected}"
    );
}

const READ_TABLES: &str = r#"
import csv, json, sys
import pyarrow.parquet as parquet
table = parquet.read_table(sys.argv[2])
metadata = {k.decode(): v.decode() for k, v in parquet.read_metadata(sys.argv[2]).metadata.items()}
with open(sys.argv[1], newline="") as file:
    rows = list(csv.DictReader(file))
columns = table.to_pydict()
assert list(rows[0]) == table.column_names and len(rows) == table.num_rows
for number, row in enumerate(rows):
    for name, text in row.items():
        value = columns[name][number]
        same = text == "" if value is None else text == value if isinstance(value, str) else float(text) == value
        assert same, (number, name, text, value)
names = ["t_s", "arrived_s", "describes_s", "device_us", "sequence", "envelope_1_biceps_short", "envelope_2_triceps_long",
         "quality_2", "activation", "hand_x_m", "hand_y_m", "hand_exposed_s", "robot_x_m", "robot_z_m", "robot_kz_n_per_m"]
print(json.dumps({
    "rows": len(rows), "types": {str(field.type) for field in table.schema} == {"double", "string"},
    "units": [metadata["unit:" + name] for name in ("t_s", "robot_kz_n_per_m", "activation", "skill")],
    **{str(n): [columns[name][n] for name in names] for n in (5, 50, 149)},
}))
"#;

#[test]
fn tables_hold_every_stream_packet_with_the_newest_of_the_rest() {
    let (folder, recording) = fresh(0.1);
    let (lines, columns) = (folder.path().join("s.csv"), folder.path().join("s.parquet"));
    let told = export(&recording, &lines);
    assert_eq!(told["rows"], 150);
    // One picture of the hand is no demonstration, and it is said.
    assert_eq!(told["demonstrations"]["demonstrations"], 0);
    assert_eq!(
        told["demonstrations"]["problems"].as_array().map(Vec::len),
        Some(1)
    );
    assert_eq!(export(&recording, &columns)["rows"], 150);
    let seen = python(READ_TABLES, &[&lines, &columns]);
    assert_eq!(seen["rows"], 150);
    assert_eq!(seen["types"], true);
    assert_eq!(seen["units"], serde_json::json!(["s", "N/m", "1", ""]));
    // Packet 5: its newest scan is number 119, so 119 ms after the start; it took 3 ms, of which the configuration
    // knows 2.
    let row = &seen["5"];
    close(&row[0], 0.119 + 0.001, 1e-3);
    close(&row[1], 0.119 + 0.003, 1e-9);
    close(&row[2], 0.119 + 0.001 - 0.04, 1e-3);
    assert_eq!(row[3], 7_119_000.0);
    assert_eq!(
        (&row[5], &row[6], &row[7]),
        (&0.25.into(), &0.5.into(), &2.0.into())
    );
    close(&row[8], 0.05, 1e-7);
    assert_eq!(row[9], Value::Null);
    let row = &seen["50"];
    assert_eq!(
        (&row[9], &row[10], &row[11]),
        (&0.125.into(), &(-0.5).into(), &0.25.into())
    );
    assert_eq!(row[12], Value::Null);
    // Unseen again; what the robot said of its height is no number.
    let row = &seen["149"];
    assert_eq!((&row[9], &row[11]), (&Value::Null, &Value::Null));
    assert_eq!(
        (&row[12], &row[13], &row[14]),
        (&0.4.into(), &Value::Null, &700.0.into())
    );
}

const READ_DATASET: &str = r#"
import json, pathlib, sys
import pyedflib
root = pathlib.Path(sys.argv[1])
file, = root.glob("sub-p01/emg/sub-p01_task-tonus_emg.*df")
with pyedflib.EdfReader(str(file)) as edf:
    onsets, durations, texts = edf.readAnnotations()
    signals = [edf.readSignal(n) for n in range(edf.signals_in_file)]
    print(json.dumps({
        "kind": file.suffix, "labels": edf.getSignalLabels(), "rate": edf.getSampleFrequency(0),
        "unit": edf.getPhysicalDimension(0), "start": str(edf.getStartdatetime()), "code": edf.getPatientCode(),
        "length": [len(signal) for signal in signals], "seconds": edf.getFileDuration(),
        "at": {n: [float(signal[n]) for signal in signals] for n in (0, 500, 1200, 1299, 1300, 1610, 2999)},
        "gap": [float(max(abs(signal[1200:1300]))) for signal in signals],
        "late": [float(signals[0][n] - signals[0][n - 1]) for n in (1600, 1610, 1620)],
        "annotations": [list(each) for each in zip(map(float, onsets), map(float, durations), map(str, texts))],
        "files": sorted(str(path.relative_to(root)) for path in root.rglob("*") if path.is_file()),
        "sidecar": json.loads(file.with_suffix(".json").read_text()),
        "channels": [line.split("\t") for line in
                     (file.parent / "sub-p01_task-tonus_channels.tsv").read_text().splitlines()],
        "events": (file.parent / "sub-p01_task-tonus_events.tsv").read_text().splitlines(),
        "people": (root / "participants.tsv").read_text().splitlines(),
        "bids": json.loads((root / "dataset_description.json").read_text())["BIDSVersion"],
    }))
"#;

#[test]
fn pyedflib_opens_the_raw_semg_with_its_gaps_annotated() {
    let (folder, recording) = fresh(0.1);
    let dataset = folder.path().join("dataset");
    let told = export(&recording, &dataset);
    assert_eq!(
        (&told["scans"], &told["missing"]),
        (&3000.into(), &100.into())
    );
    let seen = python(READ_DATASET, &[&dataset]);
    assert_eq!(seen["kind"], ".edf");
    assert_eq!(
        seen["labels"],
        serde_json::json!(["EMG 1 bic-short", "EMG 2 tric-long"])
    );
    assert_eq!(
        (&seen["rate"], &seen["unit"]),
        (&1000.0.into(), &"uV".into())
    );
    assert_eq!(
        (&seen["length"][0], &seen["seconds"]),
        (&3000.into(), &3.0.into())
    );
    assert_eq!(seen["code"], "p01");
    // 1,790,000,000 s is 14:13:20; the first scan was taken 1 ms after the session's start.
    assert!(
        seen["start"]
            .as_str()
            .is_some_and(|at| at.starts_with("2026-09-21 14:13:20"))
    );
    // A tenth of a microvolt each count: 0 to 99.9 and 0 to -199.8 in 65,535 steps.
    for (scan, up) in [
        (0, 0.0),
        (500, 50.0),
        (1300, 30.0),
        (1610, 61.0),
        (2999, 99.9),
    ] {
        let at = &seen["at"][scan.to_string()];
        close(&at[0], up, 0.002);
        close(&at[1], -2.0 * up, 0.004);
    }
    for channel in 0..2 {
        close(&seen["gap"][channel], 0.0, 0.004);
    }
    // Packet 80 came late and is in its place.
    for step in 0..3 {
        close(&seen["late"][step], 0.1, 0.004);
    }
    let annotations = seen["annotations"].as_array().expect("a list");
    assert_eq!(
        annotations.len(),
        1,
        "the demonstration began before the first scan: {annotations:?}"
    );
    close(&annotations[0][0], 1.2, 1e-3);
    close(&annotations[0][1], 0.1, 1e-3);
    assert_eq!(annotations[0][2], "BAD_gap");
    check_sidecars(&seen);
    let again = Command::new(tonus_tests::program())
        .args([
            "export".as_ref(),
            recording.as_os_str(),
            "-o".as_ref(),
            dataset.as_os_str(),
        ])
        .output()
        .expect("the program runs");
    assert_eq!(again.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&again.stderr).contains("name a new folder"));
}

fn check_sidecars(seen: &Value) {
    let files = serde_json::json!([
        "README",
        "dataset_description.json",
        "participants.json",
        "participants.tsv",
        "sub-p01/emg/sub-p01_coordsystem.json",
        "sub-p01/emg/sub-p01_electrodes.tsv",
        "sub-p01/emg/sub-p01_task-tonus_channels.tsv",
        "sub-p01/emg/sub-p01_task-tonus_emg.edf",
        "sub-p01/emg/sub-p01_task-tonus_emg.json",
        "sub-p01/emg/sub-p01_task-tonus_events.json",
        "sub-p01/emg/sub-p01_task-tonus_events.tsv",
        "sub-p01/sub-p01_scans.tsv",
    ]);
    assert_eq!(seen["files"], files);
    assert_eq!(seen["bids"], "1.11.1");
    // The fields that BIDS requires.
    for required in [
        "TaskName",
        "EMGPlacementScheme",
        "EMGReference",
        "SamplingFrequency",
        "PowerLineFrequency",
        "SoftwareFilters",
    ] {
        assert!(!seen["sidecar"][required].is_null(), "{required}");
    }
    assert_eq!(seen["sidecar"]["PowerLineFrequency"], 50);
    let channels = seen["channels"].as_array().expect("lines");
    assert_eq!(
        channels[0].as_array().map(|names| &names[..3]),
        Some(&["name".into(), "type".into(), "units".into()][..])
    );
    assert_eq!(channels[2][0], "EMG 2 tric-long");
    assert_eq!(
        (&channels[2][1], &channels[2][2]),
        (&"EMG".into(), &"uV".into())
    );
    let events = seen["events"].as_array().expect("lines");
    assert_eq!(events.len(), 3);
    assert!(
        events[1]
            .as_str()
            .is_some_and(|line| line.ends_with("\t2.000500\tlift")),
        "{events:?}"
    );
    assert_eq!(seen["people"][1], "sub-p01\t71.5\t179.0");
}

#[test]
fn counts_that_16_bits_cannot_hold_go_to_bdf_as_they_are() {
    // 100 microvolts a count: 0.3 V in 65,535 steps are 4.6 microvolts each.
    let (folder, recording) = fresh(100.0);
    let dataset = folder.path().join("dataset");
    export(&recording, &dataset);
    let seen = python(READ_DATASET, &[&dataset]);
    assert_eq!(seen["kind"], ".bdf");
    let at = &seen["at"]["2999"];
    close(&at[0], 99_900.0, 1e-6);
    close(&at[1], -199_800.0, 1e-6);
}
