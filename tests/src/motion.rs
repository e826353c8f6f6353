//! Real movements of people, as demonstrations: pick and place, digits drawn in the air, reach to grasp.

use std::path::{Path, PathBuf};

use tonus::demonstration::{Choice, Demonstration, read};
use tonus::table::Table;

use crate::recordings;

/// Six actions of two people in 15 runs (trials), hand position in metres.
///
/// # Panics
/// When the recording is not there or not as expected.
#[must_use]
pub fn pick_and_place() -> Vec<Demonstration> {
    positions("vmci_pick_place_mocap", &["none", "idle"])
}

/// Ten digits drawn 18 times each, finger tip in metres.
///
/// # Panics
/// When the recording is not there or not as expected.
#[must_use]
pub fn digits() -> Vec<Demonstration> {
    positions("leap_digits_mit", &[])
}

/// Reaches to objects of three depths: the mid-point of index and thumb and their distance, metres. Rows in which a
/// finger is occluded are left out.
///
/// # Panics
/// When the recording is not there or not as expected.
#[must_use]
pub fn reach_to_grasp() -> Vec<Demonstration> {
    let path = recordings().join("kinesis_reach_to_grasp_mit/csv/reach_to_grasp.csv");
    let mut reader = csv::Reader::from_path(&path).expect("the recording");
    let headers = reader.headers().expect("a header").clone();
    let column = |name: &str| headers.iter().position(|h| h == name).expect("a column");
    let dofs = ["x", "y", "z", "aperture_m"].map(column);
    let [time, occluded, label, trial] = ["t_s", "occluded", "label", "trial"].map(column);
    let rows: Vec<csv::StringRecord> = reader.records().map(|row| row.expect("a row")).collect();
    let runs = rows.chunk_by(|a, b| (&a[label], &a[trial]) == (&b[label], &b[trial]));
    let one = |run: &[csv::StringRecord]| {
        let seen: Vec<_> = run.iter().filter(|row| &row[occluded] == "0").collect();
        let numbers = |column: usize| -> Vec<f64> {
            let cells = seen.iter().map(|row| row[column].parse());
            cells.collect::<Result<_, _>>().expect("a number")
        };
        let values = dofs.map(numbers).to_vec();
        let (label, trial) = (&run[0][label], &run[0][trial]);
        Demonstration::new(label, trial, &path, numbers(time), values).expect("a demonstration")
    };
    runs.map(one).collect()
}

fn positions(recording: &str, exclude: &[&str]) -> Vec<Demonstration> {
    let folder = recordings().join(recording).join("csv");
    let entries = std::fs::read_dir(&folder).expect("the folder of the recording");
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.expect("a file").path()).collect();
    files.sort();
    let dofs = ["x", "y", "z"].map(str::to_owned);
    let exclude: Vec<String> = exclude.iter().map(|&label| label.to_owned()).collect();
    let choice = Choice {
        dofs: &dofs,
        exclude: &exclude,
    };
    let of_file = |file: &Path| read(&Table::open(file).expect("a table"), &choice);
    let all = files
        .iter()
        .map(|file| of_file(file).expect("demonstrations"));
    all.flatten().collect()
}
