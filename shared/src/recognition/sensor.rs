//! What the two sensors saw, and when motion begins by either.

use super::RecognitionError;
use crate::onset::{MotionEdge, OnsetDetector, OnsetError};

/// Which sensor; its numbers are along the three axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Sensor {
    Hand,
    Stiffness,
}

/// What a sensor saw, as the model has it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen {
    pub(super) sensor: Sensor,
    pub(super) at_us: u64,
    pub(super) values: [f32; 3],
}

/// One sensor: its newest instant, and the interval in which it was last observed.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Newest {
    pub(super) seen: Option<Seen>,
    interval: Option<u64>,
}

impl Newest {
    /// The newest instant, once in each interval.
    pub(super) fn take(&mut self, interval_us: u64) -> Option<Seen> {
        let seen = self.seen.take()?;
        let interval = seen.at_us / interval_us;
        // An instant that overtook another is not gone back to.
        if self.interval.is_some_and(|last| interval <= last) {
            return None;
        }
        self.interval = Some(interval);
        Some(seen)
    }
}

/// Steps a detector; an instant that comes late tells nothing about the speed.
#[allow(clippy::cast_precision_loss, reason = "microseconds of 285 years")]
pub(super) fn step(
    detector: &mut OnsetDetector<f64>,
    at_us: u64,
    values: [f32; 3],
) -> Result<Option<MotionEdge<f64>>, RecognitionError> {
    match detector.step(at_us as f64 * 1e-6, values.map(f64::from)) {
        Err(OnsetError::Time { .. }) => Ok(None),
        edge => Ok(edge?),
    }
}
