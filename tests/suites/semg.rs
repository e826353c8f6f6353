//! sEMG: designs and envelopes against SciPy, delay by cross-correlation, real recordings, properties.
#![allow(
    missing_docs,
    clippy::unwrap_used,
    clippy::panic,
    reason = "test suite"
)]

use std::path::{Path, PathBuf};

#[path = "semg/bursts.rs"]
mod bursts;
#[path = "semg/delay.rs"]
mod delay;
#[path = "semg/designs.rs"]
mod designs;
#[path = "semg/envelopes.rs"]
mod envelopes;
#[path = "semg/properties.rs"]
mod properties;
#[path = "semg/quality.rs"]
mod quality;
#[path = "semg/recordings.rs"]
mod recordings;

fn golden(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("golden")
        .join(name)
}

/// A CSV file as its header and its rows of text.
fn table(path: &Path) -> (Vec<String>, Vec<csv::StringRecord>) {
    let mut reader =
        csv::Reader::from_path(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let header = reader.headers().unwrap().iter().map(String::from).collect();
    (header, reader.records().map(Result::unwrap).collect())
}

/// One numeric column of a CSV file.
fn column(path: &Path, name: &str) -> Vec<f64> {
    let (header, rows) = table(path);
    let index = header.iter().position(|h| h == name).unwrap();
    rows.iter().map(|row| row[index].parse().unwrap()).collect()
}

fn peak(x: &[f64]) -> f64 {
    x.iter().fold(0.0, |peak: f64, value| peak.max(value.abs()))
}

/// Largest difference of two signals of one length.
fn worst(x: &[f64], y: &[f64]) -> f64 {
    assert_eq!(x.len(), y.len());
    x.iter()
        .zip(y)
        .fold(0.0, |worst, (x, y)| f64::max(worst, (x - y).abs()))
}
