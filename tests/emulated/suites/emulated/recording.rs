//! Real sEMG as the converter's counts.

use std::path::PathBuf;

/// What an ADS1294 at gain 6 makes of a voltage: 2.4 V in 2^23 counts.
fn count(volts: f64) -> i32 {
    (volts * 6.0 / 2.4 * f64::from(1 << 23)).round() as i32
}

/// Biceps, triceps, front and middle deltoid of one trial of lifting a box (2 kHz), at 1 kHz by the mean of
/// neighbours.
pub(crate) fn lift() -> Vec<Vec<i32>> {
    (0..4).map(channel).collect()
}

fn channel(number: usize) -> Vec<i32> {
    let data = std::env::var_os("TONUS_DATA").map_or_else(
        || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data"),
        PathBuf::from,
    );
    let file = data.join("pyomeca_box_emg_mocap/csv/emg_2000hz.csv");
    let mut reader = csv::Reader::from_path(&file)
        .unwrap_or_else(|error| panic!("{}: {error}: set TONUS_DATA", file.display()));
    let column = reader
        .headers()
        .unwrap()
        .iter()
        .position(|name| name == format!("emg{number}"))
        .unwrap();
    let volts: Vec<f64> = reader
        .records()
        .map(|row| row.unwrap()[column].parse().unwrap())
        .collect();
    assert!(volts.len() > 10_000);
    volts
        .chunks_exact(2)
        .map(|pair| count(f64::midpoint(pair[0], pair[1])))
        .collect()
}
