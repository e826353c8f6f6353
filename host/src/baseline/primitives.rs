//! The mixture of ProMPs, asked as the other methods are: the method that the others are held against, and the
//! machine of those that are its relatives.

use super::{Answer, BaselineError, Observed, Path, largest};
use crate::demonstration::Demonstration;
use crate::model::recognise::Recogniser;
use crate::model::{Model, Transform, Valid, learn};

/// Quantile of the pointwise 95 % interval.
const NORMAL_975: f64 = 1.959_963_984_540_054;

/// A learnt model of this program.
#[derive(Debug, Clone)]
pub struct Primitives(pub(super) Model);

impl Primitives {
    /// Learns from labelled demonstrations.
    ///
    /// # Errors
    /// As [`learn`].
    pub fn learn(train: &[Demonstration], valid: &Valid) -> Result<Self, BaselineError> {
        Ok(Self(learn(train, valid)?))
    }

    /// Joint likelihood of all observations, and the most probable skill's movement given them, at `phases`.
    ///
    /// # Errors
    /// Observations that inference refuses.
    pub fn answer(&self, observed: &Observed, phases: &[f64]) -> Result<Answer, BaselineError> {
        let view = self.0.view()?;
        let mut recogniser = Recogniser::new(&self.0, &view)?;
        for (dof, phase, value, std) in observed.each() {
            recogniser.observe(dof, phase, value, std)?;
        }
        let log_posterior = recogniser.log_posterior();
        let recognised = largest(&log_posterior);
        let paths = match recognised {
            Some(skill) => self.paths(&mut recogniser, skill, phases)?,
            None => Vec::new(),
        };
        Ok(Answer {
            log_posterior: Some(log_posterior),
            recognised,
            paths,
        })
    }

    /// What `skill` expects to be recorded of every DoF, given what `recogniser` has observed.
    pub(super) fn paths(
        &self,
        recogniser: &mut Recogniser<'_>,
        skill: usize,
        phases: &[f64],
    ) -> Result<Vec<Option<Path>>, BaselineError> {
        let mut paths = Vec::new();
        for dof in 0..self.0.dofs().len() {
            let (mut mean, mut interval) = (Vec::new(), Vec::new());
            for &phase in phases {
                let predicted = recogniser.predict(skill, dof, phase)?;
                mean.push(predicted.mean);
                interval.push(self.interval(dof, (predicted.mean, predicted.std)));
            }
            paths.push(Some(Path {
                mean,
                interval_95: Some(interval),
            }));
        }
        Ok(paths)
    }

    /// Of a recorded value, whose residual comes on top of the movement's own uncertainty.
    fn interval(&self, dof: usize, (mean, std): (f64, f64)) -> (f64, f64) {
        let residual = self.0.parts().residual_variance[dof];
        match self.0.dofs()[dof].transform {
            Transform::Identity => {
                let half = NORMAL_975 * libm::sqrt(std * std + residual);
                (mean - half, mean + half)
            }
            Transform::Log => {
                // Back from the log-normal's moments to the logarithm's.
                let variance = libm::log1p((std / mean) * (std / mean));
                let middle = libm::log(mean) - 0.5 * variance;
                let half = NORMAL_975 * libm::sqrt(variance + residual);
                (libm::exp(middle - half), libm::exp(middle + half))
            }
        }
    }
}
