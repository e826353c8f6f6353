//! Why a recording cannot be exported.

use std::path::PathBuf;

use thiserror::Error;

use crate::config::ConfigError;
use crate::live::EngineError;
use crate::recording::ReadError;

/// Why a recording cannot be exported.
#[derive(Debug, Error)]
pub enum ExportError {
    /// The recording cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The configuration that it was made with: it says how late the wearable's packets came.
    #[error("the configuration in the recording: {0}")]
    Config(#[from] ConfigError),
    /// The output cannot be written.
    #[error("{}: cannot be written: {source}", .path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What failed.
        source: std::io::Error,
    },
    /// Somebody's demonstrations are there already.
    #[error("{}: holds other demonstrations already, and would be lost: name another output, or move it away", .path.display())]
    Exists {
        /// The file.
        path: PathBuf,
    },
    /// The engine that joins demonstrations does not start.
    #[error(transparent)]
    Engine(Box<EngineError>),
    /// The folder is not empty.
    #[error("{}: holds files already: name a new folder", .path.display())]
    NotEmpty {
        /// The folder.
        path: PathBuf,
    },
    /// No raw sEMG.
    #[error(
        "the recording holds no raw sEMG: have the wearable send it while you record, or export to CSV or Parquet"
    )]
    NoScans,
    /// Raw sEMG whose scale nobody told.
    #[error(
        "the recording holds raw sEMG, but no configuration packet that tells its rate and scale"
    )]
    NoScale,
    /// The wearable was another one later.
    #[error(
        "at {at_s:.3} s the wearable changes rate, scale or channels: one file holds one setting only"
    )]
    Changed {
        /// Session time, seconds.
        at_s: f64,
    },
    /// Longer than anybody records.
    #[error(
        "raw sEMG at {at_s:.3} s lies {scans} scans after the first, at most {limit} fit a file"
    )]
    TooLong {
        /// Session time, seconds.
        at_s: f64,
        /// Scans.
        scans: u64,
        /// The most.
        limit: u64,
    },
}
