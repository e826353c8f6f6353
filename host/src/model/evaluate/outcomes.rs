//! What came of an evaluation, one by one and added up.

use std::collections::BTreeMap;

use crate::model::Dof;
use crate::model::calibration::{CalibrationError, Forecast};

/// What came of one demonstration.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// Its label.
    pub label: String,
    /// The most probable label.
    pub recognised: String,
    /// Natural logarithm of the probability that the model gave its own label.
    pub log_probability: f64,
    /// Index of its own label in `log_posterior`.
    pub performed: usize,
    /// Log probability of each of the model's classes.
    pub log_posterior: Vec<f64>,
    /// Sum over the unobserved samples of the squared error of the recognised skill's prediction, per DoF, in its
    /// unit squared.
    pub squared_error: Vec<f64>,
    /// How many samples that is.
    pub unobserved: usize,
}

impl Outcome {
    /// For [`crate::model::calibration`].
    ///
    /// # Errors
    /// None for an outcome of an evaluation, whose posterior is normalised.
    pub fn forecast(&self) -> Result<Forecast, CalibrationError> {
        Forecast::new(self.log_posterior.clone(), self.performed)
    }
}

/// Outcomes, added up.
#[derive(Clone, Debug, PartialEq)]
pub struct Evaluation {
    /// All labels that occur, sorted.
    pub labels: Vec<String>,
    /// One per demonstration, in their order.
    pub outcomes: Vec<Outcome>,
    dofs: Vec<Dof>,
}

impl Evaluation {
    /// `None` without outcomes.
    pub(super) fn of(outcomes: Vec<Outcome>, dofs: &[Dof]) -> Option<Self> {
        let named = outcomes.iter().flat_map(|o| [&o.label, &o.recognised]);
        let mut labels: Vec<String> = named.cloned().collect();
        labels.sort_unstable();
        labels.dedup();
        (!outcomes.is_empty()).then(|| Self {
            labels,
            outcomes,
            dofs: dofs.to_vec(),
        })
    }

    /// How many were recognised as what they are.
    #[must_use]
    pub fn correct(&self) -> usize {
        let right = |outcome: &&Outcome| outcome.label == outcome.recognised;
        self.outcomes.iter().filter(right).count()
    }

    /// How many there were, at least 1.
    #[must_use]
    pub fn total(&self) -> usize {
        self.outcomes.len()
    }

    /// Mean of minus the log probability given to the right label, nats.
    #[must_use]
    pub fn log_loss(&self) -> f64 {
        let sum: f64 = self.outcomes.iter().map(|o| -o.log_probability).sum();
        sum / self.total() as f64
    }

    /// `[performed][recognised]`, counts, indices into [`Evaluation::labels`].
    #[must_use]
    pub fn confusion(&self) -> Vec<Vec<usize>> {
        let index: BTreeMap<&str, usize> =
            self.labels.iter().map(String::as_str).zip(0..).collect();
        let mut counts = vec![vec![0; self.labels.len()]; self.labels.len()];
        for outcome in &self.outcomes {
            let performed = index.get(outcome.label.as_str());
            let recognised = index.get(outcome.recognised.as_str());
            if let (Some(&row), Some(&column)) = (performed, recognised) {
                counts[row][column] += 1;
            }
        }
        counts
    }

    /// Each DoF with the root mean squared error over all unobserved samples, in its unit; `None` if all was observed.
    pub fn rmse(&self) -> impl Iterator<Item = (&Dof, Option<f64>)> {
        let samples: usize = self.outcomes.iter().map(|o| o.unobserved).sum();
        self.dofs.iter().enumerate().map(move |(index, dof)| {
            let sum: f64 = self.outcomes.iter().map(|o| o.squared_error[index]).sum();
            let mean = (samples > 0).then(|| libm::sqrt(sum / samples as f64));
            (dof, mean)
        })
    }
}
