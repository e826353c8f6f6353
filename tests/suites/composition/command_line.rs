//! `tonus infer` with `--via` and `--start`.

use std::fmt::Write as _;
use std::path::Path;
use std::process::{Command, Output};

use crate::random::near;

fn tonus(arguments: &[&str]) -> Output {
    Command::new(tonus_tests::program())
        .args(arguments)
        .output()
        .unwrap()
}

/// Eight demonstrations of a straight reach to various ends, 2 s long: `x = end s`, `y = end s^2`, a stiffness
/// that grows with the reach.
fn model(folder: &Path) -> String {
    let mut text = "t_s,x,y,k,label,trial\n".to_owned();
    for trial in 0..8 {
        let end = 0.3 + 0.05 * f64::from(trial % 4) + 0.01 * f64::from(trial);
        for sample in 0..=40 {
            let s = f64::from(sample) / 40.0;
            let wobble = 0.01 * (f64::from(trial) * 2.4 + s * 3.0).sin();
            let (x, y) = (end * s + wobble, end * s * s - 2.0 * wobble * s);
            let k = 100.0 + 400.0 * end * s + 500.0 * wobble;
            writeln!(text, "{},{x},{y},{k},reach,{trial}", 2.0 * s).unwrap();
        }
    }
    let (demos, file) = (folder.join("demos.csv"), folder.join("reach.tonus"));
    std::fs::write(&demos, text).unwrap();
    let (demos, file) = (demos.to_str().unwrap(), file.to_str().unwrap());
    let output = tonus(&[
        "train",
        demos,
        "--dofs",
        "x,y,k:N/m:log",
        "--basis",
        "gaussian:12",
        "-o",
        file,
    ]);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{errors}");
    file.to_owned()
}

/// Rows of the written trajectory: time, and the column asked for.
fn column(file: &Path, name: &str) -> Vec<(f64, f64)> {
    let mut reader = csv::Reader::from_path(file).unwrap();
    let headers = reader.headers().unwrap().clone();
    let at = |name| headers.iter().position(|header| header == name).unwrap();
    let (time, value) = (at("t_s"), at(name));
    let rows = reader.records().map(|row| {
        let row = row.unwrap();
        (row[time].parse().unwrap(), row[value].parse().unwrap())
    });
    rows.collect()
}

#[test]
fn infer_starts_where_told_and_passes_where_told() {
    let folder = tempfile::tempdir().unwrap();
    let model = model(folder.path());
    let out = folder.path().join("plan.csv");
    let file = out.to_str().unwrap();
    let output = tonus(&[
        "infer",
        &model,
        "--label",
        "reach",
        "--start",
        "x=0.02/0.25,k=120/20",
        "-o",
        file,
    ]);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{errors}");
    let x = column(&out, "x");
    near(x[0].1, 0.02, 1e-12);
    // The first rows' second-order slope; the bridge bends it by its third order only.
    let step = x[1].0 - x[0].0;
    let slope = (-3.0 * x[0].1 + 4.0 * x[1].1 - x[2].1) / (2.0 * step);
    near(slope, 0.25, 0.03);
    // The mean of a log-normal exceeds the median that is met.
    near(column(&out, "k")[0].1, 120.0, 0.1);
    let mut arguments = vec!["infer", &model, "--label", "reach", "--via", "0.75:x=0.27"];
    arguments.extend(["--via-sigma", "0.0005", "-o", file]);
    assert!(tonus(&arguments).status.success());
    near(column(&out, "x")[75].1, 0.27, 0.0005);
    assert!(column(&out, "x_std")[75].1 <= 0.0005);
    // A start in mid-movement leaves what was before it to the skill.
    let mut arguments = vec![
        "infer",
        &model,
        "--label",
        "reach",
        "--start",
        "0.5:y=0.12/0.1",
    ];
    arguments.extend(["--overlap", "0.3", "-o", file]);
    assert!(tonus(&arguments).status.success());
    near(column(&out, "y")[50].1, 0.12, 1e-12);
}

#[test]
fn starts_and_via_points_that_make_no_sense_are_usage_errors() {
    let folder = tempfile::tempdir().unwrap();
    let model = model(folder.path());
    let out = folder.path().join("plan.csv");
    let file = out.to_str().unwrap();
    let cases = [
        (["--via", "x=0.1"], 2),
        (["--via", "1.5:x=0.1"], 2),
        (["--start", "x=0.1"], 2),
        (["--start", "0.2:x=0.1/fast"], 2),
        (["--overlap", "0"], 2),
        (["--via", "0.5:q=0.1"], 1),
        (["--start", "k=-5/0"], 1),
    ];
    for (options, code) in cases {
        let mut arguments = vec!["infer", &model, "--label", "reach", "-o", file];
        arguments.extend(options);
        let output = tonus(&arguments);
        let errors = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{options:?}: {errors}");
        assert!(!out.exists(), "{options:?} wrote a file");
    }
}
