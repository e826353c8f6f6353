//! What a gate looks at, and how often it may be wrong; checked before it learns.

use super::GateError;

/// What a gate looks at, and how often it may be wrong.
#[derive(Clone, Debug, PartialEq)]
pub struct GateConfig {
    /// The DoFs that are observed, indices into the model's: the person's, not those of a robot to be inferred.
    pub dofs: Vec<usize>,
    /// How many times each is observed, equally spaced from the start, at least 1.
    pub observations: usize,
    /// The first part of the movement that they span, above 0, at most 1.
    pub fraction: f64,
    /// Share of known movements that may be called unknown, above 0 and below 1.
    pub false_alarm_rate: f64,
    /// Whether the answer counts at every moment of a movement, as in a live session: the rate is then the share of movements
    /// that are *ever* called unknown, extrapolated where the demonstrations are too few to show one so rare. Otherwise
    /// each is judged once, at whatever moment, and the rate is at least what they can show.
    pub throughout: bool,
}

impl GateConfig {
    /// All of `count` DoFs, ten times over the whole movement, 2 % false alarms; judged once.
    #[must_use]
    pub fn of(count: usize) -> Self {
        Self {
            dofs: (0..count).collect(),
            observations: 10,
            fraction: 1.0,
            false_alarm_rate: 0.02,
            throughout: false,
        }
    }

    pub(super) fn phases(&self) -> Vec<f64> {
        let last = self.observations.saturating_sub(1).max(1) as f64;
        let first = if self.observations == 1 { 1.0 } else { 0.0 };
        (0..self.observations)
            .map(|step| self.fraction * (first + step as f64 / last).min(1.0))
            .collect()
    }

    /// `dofs`: how many the model has.
    pub(super) fn check(&self, dofs: usize) -> Result<(), GateError> {
        let rate = self.false_alarm_rate;
        let observations = self.observations as f64;
        let greatest = self.dofs.iter().max().map_or(f64::NAN, |&dof| dof as f64);
        let numbers = [
            (
                "the number of observations",
                observations,
                observations >= 1.0,
                "at least 1",
            ),
            (
                "the fraction",
                self.fraction,
                self.fraction > 0.0 && self.fraction <= 1.0,
                "above 0 and at most 1",
            ),
            (
                "the false alarm rate",
                rate,
                rate > 0.0 && rate < 1.0,
                "a rate above 0 and below 1",
            ),
            (
                "the greatest DoF",
                greatest,
                greatest < dofs as f64,
                "at least one DoF, each one of the model's",
            ),
        ];
        for (what, value, within, range) in numbers {
            if !within {
                return Err(GateError::Config { what, value, range });
            }
        }
        Ok(())
    }
}
