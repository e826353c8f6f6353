//! What a belief says about the movement: mean, variance and covariance of any rows.

use super::belief::{Belief, Posterior};
use super::error::{ModelError, RowError};
use super::latent::Latent;
use super::linear::{dot, weighted_dot};
use super::row::{Functions, Order, Row};
use super::skill::Skill;
use super::triangle::project;
use crate::Real;

/// Scratch that [`Trajectory`]'s questions need: `K + 3 r` numbers.
#[must_use]
pub const fn trajectory_scratch_len(basis: usize, rank: usize) -> usize {
    basis + 3 * rank
}

/// Scratch that [`Trajectory::curves`] needs: `D K (r + 1) + K + r` numbers.
#[must_use]
pub const fn curves_scratch_len(dofs: usize, basis: usize, rank: usize) -> usize {
    dofs * basis * (rank + 1) + basis + rank
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
    /// Weights of the root's columns; `None` is one.
    shares: Option<&'a [T]>,
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
            root: skill.prior_root(),
            shares: None,
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
        if belief.rank() != skill.rank() {
            return Err(ModelError::Length {
                what: "the belief's mean",
                expected: skill.rank(),
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
            shares: Some(posterior.shares),
            inflation: posterior.inflation,
        }
    }

    /// Basis functions and latent dimensions, `(K, r)`.
    pub(super) const fn shape(&self) -> (usize, usize) {
        (self.latent.basis().count(), self.latent.rank())
    }

    /// Mean and variance of a row. Cost: `K r + r^2 / 2` multiply-adds and the basis. `scratch` is at least
    /// [`trajectory_scratch_len`] long.
    ///
    /// # Errors
    /// As [`Latent::row`]; scratch too short; a result that the scalar cannot hold.
    pub fn moments(&self, row: &Row<T>, scratch: &mut [T]) -> Result<Moments<T>, RowError> {
        let [psi, a, f, _] = self.split(scratch)?;
        let mean = self.project(row, psi, a, f)?;
        let variance = self.inflation * weighted_dot(self.shares, f, f);
        row.bounded(mean.is_finite() && variance.is_finite())?;
        Ok(Moments { mean, variance })
    }

    /// The mean of a row alone, as [`Trajectory::moments`] gives it. Cost: `(K + 1) r` multiply-adds and the basis.
    ///
    /// # Errors
    /// As [`Trajectory::moments`].
    pub fn mean(&self, row: &Row<T>, scratch: &mut [T]) -> Result<T, RowError> {
        let [psi, a, _, _] = self.split(scratch)?;
        self.skill.row(&self.latent, row, psi, a)?;
        let mean = self.mean_of(row, psi, a)?;
        row.bounded(mean.is_finite())?;
        Ok(mean)
    }

    /// Mean and variance of every DoF at every one of `phases`, DoF by DoF: `out[d * phases.len() + i]`, as
    /// [`Trajectory::moments`] gives them but for rounding. The basis is evaluated once for each phase
    /// and the root multiplied once for each DoF: `D K r (r + 5) / 2` multiply-adds, and at most `K (r + 1) + r` more for
    /// each number. `scratch` is at least [`curves_scratch_len`] long.
    ///
    /// # Errors
    /// A phase or duration as in [`Latent::row`]; `out` of another length, scratch too short; a result that
    /// the scalar cannot hold.
    pub fn curves(
        &self,
        order: Order<T>,
        phases: &[T],
        scratch: &mut [T],
        out: &mut [Moments<T>],
    ) -> Result<(), RowError> {
        let (dofs, rank) = (self.latent.dofs(), self.skill.rank());
        let basis = self.latent.basis();
        let count = basis.count();
        check_buffer(
            "moments",
            out.len() == dofs * phases.len(),
            dofs * phases.len(),
            out.len(),
        )?;
        let needed = curves_scratch_len(dofs, count, self.latent.rank());
        check_buffer(
            "curves scratch",
            scratch.len() >= needed,
            needed,
            scratch.len(),
        )?;
        let (psi, rest) = scratch.split_at_mut(count);
        let (f, rest) = rest.split_at_mut(rank);
        let (weights, rest) = rest.split_at_mut(dofs * count);
        let rooted = &mut rest[..dofs * count * rank];
        self.roots(rooted, weights, f);
        for (index, &phase) in phases.iter().enumerate() {
            let of = |dof| Row { dof, order, phase };
            self.latent.functions(&of(0), psi)?;
            let functions = Functions::of(psi);
            let each = rooted.chunks_exact(count * rank);
            for (dof, (rooted, weights)) in each.zip(weights.chunks_exact(count)).enumerate() {
                functions.combine(rooted, f);
                let moments = Moments {
                    mean: functions.weighted(basis, order, weights),
                    variance: self.inflation * dot(f, f),
                };
                of(dof).bounded(moments.mean.is_finite() && moments.variance.is_finite())?;
                out[dof * phases.len() + index] = moments;
            }
        }
        Ok(())
    }

    /// `L S sqrt(shares)` and the mean weights of all DoFs; `deviations` is scratch.
    fn roots(&self, rooted: &mut [T], weights: &mut [T], deviations: &mut [T]) {
        let rank = deviations.len();
        weights.copy_from_slice(self.skill.weight_mean());
        deviations.fill(T::one());
        for (deviation, share) in deviations.iter_mut().zip(self.shares.unwrap_or_default()) {
            *deviation = share.sqrt();
        }
        let lines = (self.skill.loading(&self.latent).chunks_exact(rank))
            .zip(rooted.chunks_exact_mut(rank));
        for ((line, rooted), weight) in lines.zip(weights) {
            match self.root {
                Some(root) => project(root, line, rooted),
                None => rooted.copy_from_slice(line),
            }
            if let Some(z) = self.mean {
                *weight += dot(line, z);
            }
            for (entry, deviation) in rooted.iter_mut().zip(&*deviations) {
                *entry *= *deviation;
            }
        }
    }

    /// Covariance between two rows: of two DoFs, two phases, a position and a velocity. In the product
    /// of the rows' units. Cost: `2 K r + r^2` multiply-adds and two bases. `scratch` as for
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
        let covariance = self.inflation * weighted_dot(self.shares, f, g);
        one.bounded(covariance.is_finite())?;
        Ok(covariance)
    }

    /// Writes the mean weights `mu + L z` (`D * K`, DoF-major) to `out`. `D K r` multiply-adds.
    ///
    /// # Errors
    /// `out` of another length.
    pub fn weight_mean(&self, out: &mut [T]) -> Result<(), RowError> {
        let expected = self.latent.weights();
        check_buffer("weight mean", out.len() == expected, expected, out.len())?;
        out.copy_from_slice(self.skill.weight_mean());
        if let Some(z) = self.mean {
            let loading = self.skill.loading(&self.latent);
            let lines = loading.chunks_exact(self.skill.rank());
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
        self.skill.row(&self.latent, row, psi, a)?;
        match self.root {
            Some(root) => project(root, a, f),
            None => f.copy_from_slice(a),
        }
        self.mean_of(row, psi, a)
    }

    fn mean_of(&self, row: &Row<T>, psi: &[T], a: &[T]) -> Result<T, RowError> {
        let offset = self.skill.offset(self.latent.basis(), row, psi)?;
        Ok(self.mean.map_or(offset, |z| offset + dot(a, z)))
    }

    fn split<'s>(&self, scratch: &'s mut [T]) -> Result<[&'s mut [T]; 4], RowError> {
        let (basis, rank) = (self.latent.basis().count(), self.skill.rank());
        let expected = trajectory_scratch_len(basis, self.latent.rank());
        check_buffer(
            "trajectory scratch",
            scratch.len() >= expected,
            expected,
            scratch.len(),
        )?;
        let (psi, rest) = scratch.split_at_mut(basis);
        let (a, rest) = rest.split_at_mut(rank);
        let (f, rest) = rest.split_at_mut(rank);
        Ok([psi, a, f, &mut rest[..rank]])
    }
}

fn check_buffer(
    what: &'static str,
    fits: bool,
    expected: usize,
    got: usize,
) -> Result<(), RowError> {
    if fits {
        return Ok(());
    }
    Err(RowError::Buffer {
        what,
        expected,
        got,
    })
}
