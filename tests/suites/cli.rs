//! The program as a person uses it: each verb on files, its results against what they must be.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;

/// Runs the program; it must succeed. Gives its standard output.
fn tonus(arguments: &[&str]) -> String {
    let output = Command::new(tonus_tests::program())
        .args(arguments)
        .output()
        .unwrap();
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {errors}");
    String::from_utf8(output.stdout).unwrap()
}

fn json(arguments: &[&str]) -> Value {
    let mut with_json = vec!["--json"];
    with_json.extend(arguments);
    serde_json::from_str(&tonus(&with_json)).unwrap()
}

fn column(file: &Path, name: &str) -> Vec<f64> {
    let mut reader = csv::Reader::from_path(file).unwrap();
    let at = reader.headers().unwrap().iter().position(|h| h == name);
    let at = at.unwrap_or_else(|| panic!("no column {name}"));
    let cells = reader
        .records()
        .map(|row| row.unwrap()[at].parse().unwrap());
    cells.collect()
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// SciPy's columns, copied into the project.
fn reference() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("golden/reference/emg_ref.csv")
}

#[test]
fn envelopes_are_those_of_scipy() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("envelope.csv");
    // Arguments, column of the reference, tolerance as a share of the column's peak.
    let cases: [(&[&str], &str, f64); 6] = [
        (&[], "stream_hp2_20Hz", 1e-4),
        (&["--highpass", "20"], "stream_hp2_20Hz", 1e-4),
        (&["--dc-block", "1"], "stream_dcblock_1Hz", 1e-4),
        (&["--detrend"], "lfilter", 1e-9),
        (&["--detrend", "--zero-phase"], "filtfilt", 1e-9),
        (
            &[
                "--detrend",
                "--zero-phase",
                "--smoother",
                "mean",
                "--window-ms",
                "150",
            ],
            "ma150_centered",
            1e-9,
        ),
    ];
    for (options, expected, tolerance) in cases {
        let file = reference();
        let mut arguments = vec!["envelope", text(&file), "--rate", "200", "--channels", "x"];
        arguments.extend(options);
        arguments.extend(["-o", text(&out)]);
        let summary = json(&arguments);
        assert_eq!(summary["samples"], 2000);
        let (got, expected) = (column(&out, "env_x"), column(&file, expected));
        let peak = expected.iter().fold(0.0_f64, |peak, v| peak.max(v.abs()));
        let worst = got.iter().zip(&expected).map(|(a, b)| (a - b).abs());
        let worst = worst.fold(0.0_f64, f64::max);
        assert!(worst <= tolerance * peak, "{options:?}: {worst} of {peak}");
        assert_eq!((got.len(), expected.len()), (2000, 2000));
    }
}

/// Two skills of closed form: x grows with the phase or with its square, y is half of x either way.
fn demonstrations(file: &Path, seed: u64) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut rows = String::from("t_s,x,y,label,trial\n");
    for trial in 0..12 {
        for (label, power) in [("steady", 1), ("late", 2)] {
            let size: f64 = rng.random_range(0.2..0.6);
            let duration_s: f64 = rng.random_range(1.0..3.0);
            for sample in 0..=60 {
                let s = f64::from(sample) / 60.0;
                let x = size * s.powi(power) + rng.random_range(-1e-4..1e-4);
                let _infallible =
                    writeln!(rows, "{},{x},{},{label},{trial}", s * duration_s, 0.5 * x);
            }
        }
    }
    std::fs::write(file, rows).unwrap();
}

#[test]
fn skills_are_learnt_evaluated_and_inferred() {
    let folder = tempfile::tempdir().unwrap();
    let [learnt, fresh, model, out] =
        ["learnt.csv", "fresh.csv", "skills.tonus", "out.csv"].map(|name| folder.path().join(name));
    demonstrations(&learnt, 1);
    demonstrations(&fresh, 2);
    let recorded = json(&["info", text(&learnt)]);
    assert!(recorded.to_string().contains("steady"), "{recorded}");
    tonus(&[
        "train",
        text(&learnt),
        "-o",
        text(&model),
        "--dofs",
        "x,y",
        "--basis",
        "gaussian:8",
    ]);
    let described = json(&["info", text(&model)]);
    assert!(described.to_string().contains("late"), "{described}");
    evaluated([&learnt, &fresh], &model);
    inferred(&model, &out);
}

/// Held-out and left-out movements are recognised.
fn evaluated([learnt, fresh]: [&Path; 2], model: &Path) {
    for held_out in [
        &["eval", text(model), text(fresh), "--sigma-m", "0.002"][..],
        &[
            "eval",
            text(model),
            text(learnt),
            "--sigma-m",
            "0.002",
            "--leave-one-out",
        ][..],
    ] {
        let evaluation = json(held_out);
        assert_eq!(
            (&evaluation["correct"], &evaluation["total"]),
            (&24.into(), &24.into())
        );
        assert!(
            evaluation["log_loss"].as_f64().unwrap() < 0.1,
            "{evaluation}"
        );
        // The second half follows from the first to a millimetre or so.
        assert!(
            evaluation["rmse"]["x"].as_f64().unwrap() < 0.01,
            "{evaluation}"
        );
    }
}

/// A part of a movement is recognised and the rest inferred.
fn inferred(model: &Path, out: &Path) {
    let observe = [
        "--at",
        "0.3",
        "--observe",
        "x=0.12",
        "--at",
        "0.6",
        "--observe",
        "x=0.24",
    ];
    let mut arguments = vec!["infer", text(model), "--recognise"];
    arguments.extend(observe);
    arguments.extend(["--sigma", "0.001", "-o", text(out)]);
    let inferred = json(&arguments);
    assert_eq!(inferred["label"], "steady");
    let (phase, x, y) = (column(out, "phase"), column(out, "x"), column(out, "y"));
    for ((s, x), y) in phase.iter().zip(&x).zip(&y) {
        assert!((x - 0.4 * s).abs() < 0.01, "x is {x} at {s}");
        assert!(
            (y - 0.2 * s).abs() < 0.005,
            "the unobserved y is {y} at {s}"
        );
    }
    // A label that is given is believed, whatever was observed.
    arguments[2..=2].copy_from_slice(&["--label=late"]);
    assert_eq!(json(&arguments)["label"], "late");
}

#[test]
fn models_are_learnt_by_adding_and_by_em() {
    let folder = tempfile::tempdir().unwrap();
    let [learnt, fresh, model, more, by_em] = [
        "learnt.csv",
        "fresh.csv",
        "skills.tonus",
        "more.tonus",
        "em.tonus",
    ]
    .map(|name| folder.path().join(name));
    demonstrations(&learnt, 1);
    demonstrations(&fresh, 2);
    let setting = ["--dofs", "x,y", "--basis", "gaussian:8"];
    let mut train = vec!["train", text(&learnt), "-o", text(&model)];
    train.extend(setting);
    tonus(&train);
    tonus(&[
        "train",
        text(&fresh),
        "--add-to",
        text(&model),
        "-o",
        text(&more),
    ]);
    let kept = |path| json(&["info", text(path)])["demonstrations_kept"].as_u64();
    assert_eq!((kept(&model), kept(&more)), (Some(24), Some(48)));
    train[3] = text(&by_em);
    train.push("--em");
    tonus(&train);
    assert_eq!(json(&["info", text(&by_em)])["learner"], "em");
}
