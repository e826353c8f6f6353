//! What a recogniser is shown of a recorded movement, and what it says.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::demonstration::Demonstration;
use crate::experiment::{ExperimentError, Score};
use crate::model::calibration::Forecast;
use crate::model::recognise::Recogniser;

/// Least log probability that is counted: hypotheses beyond it are dropped.
const FLOOR_NATS: f64 = -25.0;

/// What is observed.
#[derive(Debug, Clone, Copy)]
pub(super) struct Look {
    pub(super) observations: usize,
    /// Samples after it are not looked at.
    pub(super) fraction: f64,
    /// Noise that is added, which the recogniser knows of besides what it assumes, metres.
    pub(super) noise_m: f64,
    pub(super) seed: u64,
}

impl Look {
    /// Equally spaced from the start, no later than the last sample within the fraction; a single one is there.
    pub(super) fn phases(&self, movement: &Demonstration) -> Vec<f64> {
        let within = movement.phases().take_while(|p| *p <= self.fraction);
        let last = within.last().unwrap_or(0.0);
        let spaced = (0..self.observations).map(|step| match self.observations {
            1 => self.fraction,
            count => self.fraction * step as f64 / (count - 1) as f64,
        });
        let mut phases: Vec<f64> = spaced.map(|phase| phase.min(last)).collect();
        phases.dedup();
        phases
    }

    /// Observes `movement` from rest, with so much noise assumed; `each` is told after every instant.
    pub(super) fn watch(
        &self,
        recogniser: &mut Recogniser<'_>,
        sigma_m: f64,
        movement: &Demonstration,
        mut each: impl FnMut(f64, &Recogniser<'_>) -> Result<(), ExperimentError>,
    ) -> Result<(), ExperimentError> {
        recogniser.reset();
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        let std = libm::hypot(sigma_m, self.noise_m);
        for phase in self.phases(movement) {
            for dof in 0..movement.values().len() {
                let normal: f64 = StandardNormal.sample(&mut random);
                let value = movement.value_at(dof, phase).unwrap_or(f64::NAN);
                recogniser.observe(dof, phase, value + self.noise_m * normal, std)?;
            }
            each(phase, recogniser)?;
        }
        Ok(())
    }
}

/// Answers counted.
pub(super) fn score(forecasts: &[Forecast]) -> Score {
    Score::of(forecasts.iter().map(|forecast| {
        let own = forecast.log_posterior()[forecast.truth()];
        (floored(own), forecast.answer().0 == forecast.truth())
    }))
}

/// A log probability, of what was dropped as improbable the greatest that it can have had.
pub(super) fn floored(log_probability: f64) -> f64 {
    log_probability.max(FLOOR_NATS)
}
