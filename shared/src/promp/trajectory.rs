//! What a belief says about the movement: mean, variance and covariance of any rows.

use super::belief::{Belief, Posterior, project};
use super::error::{ModelError, RowError};
use super::latent::{Latent, Row, Skill, dot};
use crate::Real;

/// Scratch that [`Trajectory`]'s questions need: `K + 3 r` numbers.
#[must_use]
pub const fn trajectory_scratch_len(basis: usize, rank: usize) -> usize {
    basis + 3 * rank
}

/// Mean and variance of one row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moments<T> {
    /// In the row's unit (DoF's unit, or that per second).
    pub mean: T,
    /// In the row's unit squared; never negative. It is the variance of `psi^T w`: a sensor would see
    /// the skill's residual variance and its own noise on top.
    pub variance: T,
}

/// The movement of one skill under its prior or under a belief.
#[derive(Clone, Copy, Debug)]
pub struct Trajectory<'a, T> {
    latent: Latent<'a, T>,
    skill: Skill<'a, T>,
    /// `None` is zero.
    mean: Option<&'a [T]>,
    /// `None` is the identity.
    root: Option<&'a [T]>,
    /// Factor on every covariance, one for a Gaussian.
    inflation: T,
}

impl<'a, T: Real> Trajectory<'a, T> {
    /// Before any observation.
    ///
    /// # Errors
    /// A skill of another shape than the latent space.
    pub fn prior(latent: Latent<'a, T>, skill: Skill<'a, T>) -> Result<Self, ModelError> {
        skill.matches(&latent)?;
        Ok(Self {
            latent,
            skill,
            mean: None,
            root: skill.root(),
            inflation: T::one(),
        })
    }

    /// After what `belief` was conditioned on.
    ///
    /// # Errors
    /// A skill or a belief of another shape than the latent space.
    pub fn posterior<B: AsRef<[T]>>(
        latent: Latent<'a, T>,
        skill: Skill<'a, T>,
        belief: &'a Belief<T, B>,
    ) -> Result<Self, ModelError> {
        skill.matches(&latent)?;
        if belief.rank() != latent.rank() {
            return Err(ModelError::Length {
                what: "the belief's mean",
                expected: latent.rank(),
                got: belief.rank(),
            });
        }
        Ok(Self::of(latent, skill, belief.posterior()))
    }

    /// As [`Trajectory::posterior`], shapes known to agree.
    pub(super) const fn of(
        latent: Latent<'a, T>,
        skill: Skill<'a, T>,
        posterior: Posterior<'a, T>,
    ) -> Self {
        Self {
            latent,
            skill,
            mean: Some(posterior.mean),
            root: Some(posterior.root),
            inflation: posterior.inflation,
        }
    }

    /// Mean and variance of a row. Cost: `K r + r^2` multiply-adds and the basis. `scratch` is at least
    /// [`trajectory_scratch_len`] long.
    ///
    /// # Errors
    /// As [`Latent::row`]; scratch too short; a result that the scalar cannot hold.
    pub fn moments(&self, row: &Row<T>, scratch: &mut [T]) -> Result<Moments<T>, RowError> {
        let [psi, a, f, _] = self.split(scratch)?;
        let mean = self.project(row, psi, a, f)?;
        let variance = self.inflation * dot(f, f);
        row.bounded(mean.is_finite() && variance.is_finite())?;
        Ok(Moments { mean, variance })
    }

    /// Covariance between two rows: of two DoFs, two phases, a position and a velocity. In the product
    /// of the rows' units. Cost: `2 (K r + r^2)` multiply-adds and two bases. `scratch` as for
    /// [`Trajectory::moments`].
    ///
    /// # Errors
    /// As [`Trajectory::moments`].
    pub fn covariance(
        &self,
        one: &Row<T>,
        other: &Row<T>,
        scratch: &mut [T],
    ) -> Result<T, RowError> {
        let [psi, a, f, g] = self.split(scratch)?;
        self.project(one, psi, a, f)?;
        self.project(other, psi, a, g)?;
        let covariance = self.inflation * dot(f, g);
        one.bounded(covariance.is_finite())?;
        Ok(covariance)
    }

    /// Writes the mean weights `mu + L z` (`D * K`, DoF-major) to `out`. `D K r` multiply-adds.
    ///
    /// # Errors
    /// `out` of another length.
    pub fn weight_mean(&self, out: &mut [T]) -> Result<(), RowError> {
        if out.len() != self.latent.weights() {
            return Err(RowError::Buffer {
                what: "weight mean",
                expected: self.latent.weights(),
                got: out.len(),
            });
        }
        out.copy_from_slice(self.skill.weight_mean());
        if let Some(z) = self.mean {
            let lines = self.latent.loading().chunks_exact(self.latent.rank());
            for (weight, line) in out.iter_mut().zip(lines) {
                *weight += dot(line, z);
            }
        }
        Ok(())
    }

    /// Writes `S^T a` of the row to `f`; returns the row's mean.
    fn project(
        &self,
        row: &Row<T>,
        psi: &mut [T],
        a: &mut [T],
        f: &mut [T],
    ) -> Result<T, RowError> {
        self.latent.row(row, psi, a)?;
        match self.root {
            Some(root) => project(root, a, f),
            None => f.copy_from_slice(a),
        }
        let offset = self.skill.offset(self.latent.basis(), row, psi)?;
        Ok(self.mean.map_or(offset, |z| offset + dot(a, z)))
    }

    fn split<'s>(&self, scratch: &'s mut [T]) -> Result<[&'s mut [T]; 4], RowError> {
        let (basis, rank) = (self.latent.basis().count(), self.latent.rank());
        let expected = trajectory_scratch_len(basis, rank);
        if scratch.len() < expected {
            return Err(RowError::Buffer {
                what: "trajectory scratch",
                expected,
                got: scratch.len(),
            });
        }
        let (psi, rest) = scratch.split_at_mut(basis);
        let (a, rest) = rest.split_at_mut(rank);
        let (f, rest) = rest.split_at_mut(rank);
        Ok([psi, a, f, &mut rest[..rank]])
    }
}
