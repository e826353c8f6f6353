//! Recordings and options that give no envelope, and demos that cannot be run.

use std::fmt::Write as _;
use std::path::Path;

use super::{Case, data, usage};

pub(super) const CASES: &[Case] = &[
    usage("envelope emg.csv -o out", &["required", "--rate"]),
    usage("envelope emg.csv --rate 1000", &["required", "--output"]),
    usage(
        "envelope emg.csv --rate fast -o out",
        &["invalid value 'fast'"],
    ),
    data(
        "envelope absent.csv --rate 1000 -o out",
        &["absent.csv: cannot be read"],
    ),
    usage(
        "envelope emg.csv --rate 100 -o out",
        &["sample rate 100 Hz: give one between 200 and 2000 Hz"],
    ),
    usage(
        "envelope emg.csv --rate NaN -o out",
        &["`NaN` is not a finite number"],
    ),
    data(
        "envelope emg.csv --rate 1000 --channels emg9 -o out",
        &["no column `emg9`", "present: emg0, label"],
    ),
    data(
        "envelope emg.csv --rate 1000 --channels label -o out",
        &["emg.csv:2: column `label`", "`lift` is not a number"],
    ),
    data(
        "envelope words.csv --rate 1000 -o out",
        &["no numeric column besides t_s, label and trial"],
    ),
    data(
        "envelope broken.csv --rate 1000 --channels emg0 -o out",
        &["broken.csv:3: column `emg0`", "NaN is not finite"],
    ),
    data(
        "envelope timed.csv --rate 1000 -o out",
        &["t_s runs at 100.0 samples/s, but --rate says 1000"],
    ),
    usage(
        "envelope emg.csv --rate 1000 --highpass 600 -o out",
        &["600 Hz", "1000 samples/s"],
    ),
    usage(
        "envelope emg.csv --rate 1000 --cutoff 0 -o out",
        &["--cutoff", "`0` is not above 0"],
    ),
    usage(
        "envelope emg.csv --rate 1000 --cutoff 499 -o out",
        &["a cutoff of 499 Hz cannot be built at 1000 samples/s"],
    ),
    usage(
        "envelope emg.csv --rate 1000 --order 9 -o out",
        &["Butterworth order 9: give one between 1 and 8"],
    ),
    usage(
        "envelope emg.csv --rate 1000 --smoother mean --window-ms 0 -o out",
        &["--window-ms", "`0` is not above 0"],
    ),
    usage(
        "envelope emg.csv --rate 1000 --smoother mean --window-ms 1e12 -o out",
        &["a window of 1000000000 s at 1000 samples/s"],
    ),
    usage(
        "envelope emg.csv --rate 1000 --channels emg0,emg0 -o out",
        &["--channels names a column twice"],
    ),
    usage(
        "envelope emg.csv --rate 1000 -o ./emg.csv",
        &["--output names an input, which would be lost"],
    ),
    usage(
        "train good.csv -o good.csv --dofs x",
        &["--output names an input, which would be lost"],
    ),
    usage(
        "infer good.safetensors --label lift -o good.safetensors",
        &["--output names an input, which would be lost"],
    ),
    data(
        "envelope broken.csv --rate 1000 -o out",
        &["broken.csv:3: column `emg0`", "NaN is not finite"],
    ),
    data(
        "envelope loud.csv --rate 1000 -o out",
        &["loud.csv:3: column `emg0`: 1e300", "overflows the filter"],
    ),
    data(
        "envelope back.csv --rate 1000 -o out",
        &["back.csv:4: column `t_s`: 0.001 does not come after 0.001"],
    ),
    data(
        "envelope semicolons.csv --rate 1000 -o out",
        &["semicolons.csv:1", "separate cells by commas"],
    ),
    data(
        "envelope short.csv --rate 1000 --zero-phase -o out",
        &["3 samples are too few"],
    ),
    usage(
        "envelope emg.csv --rate 1000 --notch 55 -o out",
        &["invalid value '55'", "50, 60"],
    ),
    usage(
        "envelope emg.csv --rate 1000 --highpass 20 --dc-block 1 -o out",
        &["cannot be used with"],
    ),
    usage(
        "envelope emg.csv --rate 1000 --smoother rms --cutoff 5 -o out",
        &["--order and --cutoff belong to --smoother butterworth"],
    ),
    usage(
        "envelope emg.csv --rate 1000 --window-ms 150 -o out",
        &["--window-ms belongs to --smoother mean or rms"],
    ),
    data(
        "envelope emg.csv --rate 1000 -o nowhere/out",
        &["nowhere/out: cannot be written"],
    ),
    usage("demo --seconds 0", &["--seconds takes a number above zero"]),
    usage(
        "demo --seconds NaN",
        &["--seconds takes a number above zero"],
    ),
    usage("demo --seed many", &["invalid value 'many'"]),
    usage(
        "--seed 3 info emg.csv",
        &["unexpected argument '--seed'", "--help"],
    ),
];

/// Writes every recording that the cases name.
pub(super) fn write(folder: &Path) {
    let mut emg = String::from("emg0,label\n");
    let mut timed = String::from("t_s,emg0\n");
    for row in 0..40 {
        let _infallible = writeln!(emg, "{},lift", (row % 7) - 3);
        let _infallible = writeln!(timed, "{},{}", f64::from(row) * 0.01, row % 5);
    }
    let short: String = emg.lines().take(4).flat_map(|line| [line, "\n"]).collect();
    let files = [
        ("emg.csv", emg.as_str()),
        ("timed.csv", timed.as_str()),
        ("short.csv", short.as_str()),
        ("words.csv", "t_s,what\n0,rest\n1,lift\n"),
        ("broken.csv", "emg0\n1\nNaN\n2\n"),
        ("loud.csv", "emg0\n1\n1e300\n2\n"),
        ("back.csv", "t_s,emg0\n0,1\n0.001,1\n0.001,2\n"),
        ("semicolons.csv", "t_s;emg0\n0,0;1\n0,001;1\n"),
    ];
    for (name, text) in files {
        std::fs::write(folder.join(name), text).expect("a recording is written");
    }
}
