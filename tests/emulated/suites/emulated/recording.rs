//! Real sEMG as the converter's counts.

use std::path::PathBuf;

/// What the amplifier and the converter of the wearable's analogue front end make of a voltage at the electrodes:
/// 200 times, around 1.65 V, 3.6 V in 4096 counts.
fn count(volts: f64) -> i16 {
    ((volts * 200.0 + 1.65) / 3.6 * 4096.0)
        .round()
        .clamp(0.0, 4095.0) as i16
}

/// Biceps of one trial of lifting a box (2 kHz), at 1 kHz by the mean of neighbours.
pub(crate) fn biceps() -> Vec<i16> {
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
        .position(|name| name == "emg0")
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
