//! How sure a skill is of what it expects.

use statrs::distribution::{ContinuousCDF, Normal, StudentsT};
use tonus_shared::promp::{Mixture, Row, RowError, trajectory_scratch_len};

use super::{Dof, Model};

/// A probability that an interval cannot have.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("{0} is no probability of an interval: give one between 0 and 1")]
pub struct ProbabilityError(pub f64);

/// What a skill expects of one DoF at one phase, as a distribution.
#[derive(Clone, Debug, PartialEq)]
pub struct Spread<'m> {
    signal: &'m Dof,
    /// As the model has it.
    pub mean: f64,
    /// The same, of the movement and of what basis and demonstrations left unexplained; without a sensor's noise.
    pub variance: f64,
    /// Degrees of freedom of a Student-t of this variance: the skill's, and one for each number observed. `None` is a
    /// Gaussian.
    pub freedom: Option<f64>,
}

impl<'m> Spread<'m> {
    /// Of a skill of a mixture over `model`'s own view; `None` for a skill or a DoF that is none.
    ///
    /// # Errors
    /// A phase that is not finite.
    pub fn of(
        model: &'m Model,
        mixture: &Mixture<'_, f64, Vec<f64>>,
        (skill, dof, phase): (usize, usize, f64),
    ) -> Result<Option<Self>, RowError> {
        let (Some(signal), Some(belief), Some(trajectory)) = (
            model.dofs().get(dof),
            mixture.belief(skill),
            mixture.trajectory(skill),
        ) else {
            return Ok(None);
        };
        let parts = model.parts();
        let mut scratch = vec![0.0; trajectory_scratch_len(parts.basis.count(), parts.rank)];
        let moments = trajectory.moments(&Row::position(dof, phase), &mut scratch)?;
        Ok(Some(Self {
            signal,
            mean: moments.mean,
            variance: moments.variance + parts.residual_variance[dof] * belief.inflation(),
            freedom: belief.freedom(),
        }))
    }

    /// The central interval that holds the value with this probability, in the DoF's unit: from the quantiles of the
    /// Student-t or the normal. Never negative for a DoF that enters as its logarithm.
    ///
    /// # Errors
    /// A probability that is not between 0 and 1.
    pub fn interval(&self, probability: f64) -> Result<(f64, f64), ProbabilityError> {
        if !(probability > 0.0 && probability < 1.0) {
            return Err(ProbabilityError(probability));
        }
        let quantile = 0.5 * (1.0 + probability);
        let student = self.freedom.map(|nu| (nu, StudentsT::new(0.0, 1.0, nu)));
        let standard = match student {
            // The variance is the distribution's, not the square of its scale.
            Some((nu, Ok(t))) => t.inverse_cdf(quantile) * libm::sqrt((nu - 2.0) / nu),
            _ => Normal::standard().inverse_cdf(quantile),
        };
        let half = standard * libm::sqrt(self.variance);
        let of = |value: f64| self.signal.decode_quantile(value);
        Ok((of(self.mean - half), of(self.mean + half)))
    }
}
