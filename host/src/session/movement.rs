//! One movement: when it began, how far it is, what was observed of it.

use super::follower::Sensor;

/// The first moment at which the posterior sufficed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Decision {
    /// Index of the skill in the model.
    pub skill: usize,
    /// Its posterior probability then.
    pub posterior: f64,
    /// Time since the movement began, seconds.
    pub after_s: f64,
}

/// A movement under way, as it was announced or detected.
#[derive(Debug, Clone, Copy)]
pub(super) struct Movement {
    pub(super) began_us: u64,
    duration_us: u64,
    pub(super) hands: Sampled,
    pub(super) stiffnesses: Sampled,
    pub(super) decision: Option<Decision>,
}

impl Movement {
    /// Nothing observed yet. A duration of zero counts as a microsecond.
    pub(super) fn new(began_us: u64, duration_us: u64) -> Self {
        Self {
            began_us,
            duration_us: duration_us.max(1),
            hands: Sampled::default(),
            stiffnesses: Sampled::default(),
            decision: None,
        }
    }

    /// One that was detected: its duration is not known here, and its phase is not asked for.
    pub(super) fn since(began_us: u64) -> Self {
        Self::new(began_us, 1)
    }

    /// What was observed of a sensor.
    pub(super) fn sampled(&mut self, sensor: Sensor) -> &mut Sampled {
        match sensor {
            Sensor::Hand => &mut self.hands,
            Sensor::Stiffness => &mut self.stiffnesses,
        }
    }

    /// How long it takes, seconds.
    #[allow(clippy::cast_precision_loss, reason = "movements last seconds")]
    pub(super) fn duration_s(&self) -> f64 {
        self.duration_us as f64 * 1e-6
    }

    /// Phase at a time, clamped to the movement.
    #[allow(clippy::cast_precision_loss, reason = "movements last seconds")]
    pub(super) fn phase(&self, at_us: u64) -> f64 {
        let since_us = at_us.saturating_sub(self.began_us).min(self.duration_us);
        since_us as f64 / self.duration_us as f64
    }

    /// Which of `wanted` equal parts of the movement `at_us` lies in, from 0; none outside the movement.
    pub(super) fn part(&self, at_us: u64, wanted: u32) -> Option<u32> {
        let since_us = at_us.checked_sub(self.began_us)?;
        if since_us >= self.duration_us {
            return None;
        }
        let part = u128::from(since_us) * u128::from(wanted) / u128::from(self.duration_us);
        u32::try_from(part).ok()
    }
}

/// What was observed of one sensor: at most once in each part of the movement, so that the frames after an
/// occlusion do not make up for it by repeating one error many times.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Sampled {
    /// Observations so far.
    pub(super) count: u32,
    /// The first part that has none yet.
    next: u32,
}

impl Sampled {
    /// Whether an observation in this part is wanted; it counts as made then.
    pub(super) fn take(&mut self, part: Option<u32>) -> bool {
        let Some(part) = part.filter(|part| *part >= self.next) else {
            return false;
        };
        self.next = part.saturating_add(1);
        self.count += 1;
        true
    }
}
