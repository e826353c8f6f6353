//! Whether the probabilities mean what they say.

use serde::Serialize;

use super::FRACTIONS;
use super::held_out::Held;
use crate::experiment::ExperimentError;
use crate::model::calibration::{Bin, Forecast, Reliability, log_loss};

/// Confidence against accuracy after a part of the movement.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Calibration {
    /// What is called so in figures.
    pub name: &'static str,
    /// The part of the movement.
    pub at: f64,
    /// Answers.
    pub total: usize,
    /// Mean distance of accuracy from confidence, in bins of equal count.
    pub expected_calibration_error: f64,
    /// About what that is if every confidence is right.
    pub by_chance: f64,
    /// Mean of minus the logarithm of the probability of the right answer, nats.
    pub log_loss: f64,
    /// The same of the same mixture without any temperature of the training part.
    pub untempered: Untempered,
    /// The bins, least confident first; of all recordings together alone.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub reliability: Vec<Bin>,
}

/// Posteriors as the model has them.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Untempered {
    /// Mean distance of accuracy from confidence, in bins of equal count.
    pub expected_calibration_error: f64,
    /// Mean of minus the logarithm of the probability of the right answer, nats.
    pub log_loss: f64,
}

const NAMES: [&str; 4] = ["first 20 %", "first 30 %", "first 50 %", "whole movement"];

/// Of one recording.
pub(super) fn of(held: &Held) -> Result<Vec<Calibration>, ExperimentError> {
    let mut all = pooled(&[held])?;
    for one in &mut all {
        one.reliability.clear();
    }
    Ok(all)
}

/// Of all answers together.
pub(super) fn pooled(helds: &[&Held]) -> Result<Vec<Calibration>, ExperimentError> {
    let of = |pick: fn(&Held) -> &[Vec<Forecast>; 4], place: usize| -> Vec<Forecast> {
        helds
            .iter()
            .flat_map(|held| pick(held)[place].iter().cloned())
            .collect()
    };
    let mut all = Vec::with_capacity(FRACTIONS.len());
    for (place, (at, name)) in FRACTIONS.into_iter().zip(NAMES).enumerate() {
        let (tempered, raw) = (
            of(|held| &held.tempered, place),
            of(|held| &held.raw, place),
        );
        let diagram = Reliability::adaptive(&tempered)?;
        all.push(Calibration {
            name,
            at,
            total: tempered.len(),
            expected_calibration_error: diagram.expected_calibration_error(),
            by_chance: diagram.by_chance(),
            log_loss: log_loss(&tempered)?,
            untempered: Untempered {
                expected_calibration_error: Reliability::adaptive(&raw)?
                    .expected_calibration_error(),
                log_loss: log_loss(&raw)?,
            },
            reliability: diagram.bins().to_vec(),
        });
    }
    Ok(all)
}
