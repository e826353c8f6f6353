//! The same questions to recordings of real people by others.

use std::path::Path;

use serde::Serialize;

use super::{Config, ExperimentError, Progress, Score};

/// What was found on one recording.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Recording {
    /// Its folder.
    pub name: String,
    /// How what is tested was held out: `leave one out`, `subject1 -> subject2`.
    pub held_out: String,
    /// Classes.
    pub classes: usize,
    /// Demonstrations learnt from or tested on.
    pub demonstrations: usize,
    /// Ten observations in the first 20, 30, 50, 100 % of the movement, duration known.
    pub by_fraction: Vec<At>,
    /// White noise of 0 to 0.05 m added to each observed position; whole movement.
    pub by_noise_m: Vec<At>,
}

/// One point of a sweep.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct At {
    /// What is swept.
    pub at: f64,
    /// What came of it.
    #[serde(flatten)]
    pub score: Score,
}

/// Evaluates the recordings below `folder`.
///
/// # Errors
/// A recording that is missing or cannot be read; what learning or inference refuses.
pub fn run(
    _folder: &Path,
    _config: &Config,
    _progress: &mut dyn FnMut(Progress),
) -> Result<Vec<Recording>, ExperimentError> {
    unimplemented!("lands within the hour")
}
