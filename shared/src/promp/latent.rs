//! The prior: one shared loading, and skills as means and roots over its latent coordinates.

use super::basis::Basis;
use super::error::{ModelError, RowError};
use super::linear::combine;
use super::row::{Order, Row, support, weighted};
use super::triangle::root_len;
use crate::Real;

/// Numbers in a loading of `dofs` DoFs, `basis` functions each, and `rank` columns.
#[must_use]
pub const fn loading_len(dofs: usize, basis: usize, rank: usize) -> usize {
    dofs * basis * rank
}

/// The latent space `w = mu + L z` that all skills of a model share: a basis and a loading.
#[derive(Clone, Copy, Debug)]
pub struct Latent<'a, T> {
    basis: Basis,
    dofs: usize,
    rank: usize,
    loading: &'a [T],
}

impl<'a, T: Real> Latent<'a, T> {
    /// A view of `loading`: `D*K x r`, row-major, rows DoF-major (`loading[(d * K + k) * r + j]`), in
    /// the DoFs' raw units (any scaling used in learning folded in).
    ///
    /// # Errors
    /// A zero dimension, a length other than `dofs * basis.count() * rank`, a number that is not finite.
    pub fn new(
        basis: Basis,
        dofs: usize,
        rank: usize,
        loading: &'a [T],
    ) -> Result<Self, ModelError> {
        for (what, size) in [("DoF", dofs), ("latent dimension", rank)] {
            if size == 0 {
                return Err(ModelError::Empty { what });
            }
        }
        let expected = dofs
            .checked_mul(basis.count())
            .and_then(|weights| weights.checked_mul(rank))
            .ok_or(ModelError::TooLarge {
                dofs,
                basis: basis.count(),
                rank,
            })?;
        check_len("the loading", loading, expected)?;
        check_finite("the loading", loading)?;
        Ok(Self {
            basis,
            dofs,
            rank,
            loading,
        })
    }

    /// The basis.
    #[must_use]
    pub const fn basis(&self) -> &Basis {
        &self.basis
    }

    /// Degrees of freedom, `D`.
    #[must_use]
    pub const fn dofs(&self) -> usize {
        self.dofs
    }

    /// Latent dimensions, `r`.
    #[must_use]
    pub const fn rank(&self) -> usize {
        self.rank
    }

    /// Weights of a movement, `D * K`.
    #[must_use]
    pub const fn weights(&self) -> usize {
        self.dofs * self.basis.count()
    }

    /// The loading, as given.
    #[must_use]
    pub const fn loading(&self) -> &'a [T] {
        self.loading
    }

    /// Writes the basis functions of the row to `psi` (`K` long; `psi'(s) / duration` for a velocity) and
    /// `a = L_d^T psi` to `a` (`r` long). With [`Skill::offset`] the row's value is
    /// `offset(psi) + a^T z`. Cost: the basis and `K * r` multiply-adds.
    ///
    /// # Errors
    /// No such DoF, phase not finite, duration not positive and finite, a buffer of the wrong length,
    /// a row that the scalar cannot hold.
    pub fn row(&self, row: &Row<T>, psi: &mut [T], a: &mut [T]) -> Result<(), RowError> {
        self.functions(row, psi)?;
        self.project(row, psi, a)
    }

    /// The first half of [`Latent::row`], which rows of one phase and order share: `psi`.
    pub(super) fn functions(&self, row: &Row<T>, psi: &mut [T]) -> Result<(), RowError> {
        match row.order {
            Order::Position => self.basis.values(row.phase, psi),
            Order::Velocity { duration_s } => {
                if !(duration_s.is_finite() && duration_s > T::zero()) {
                    return Err(RowError::Duration {
                        duration_s: duration_s.widen(),
                    });
                }
                self.basis.derivatives(row.phase, psi)?;
                for value in psi.iter_mut() {
                    *value /= duration_s;
                }
                Ok(())
            }
        }
    }

    /// The second half: `a`, from `psi`.
    pub(super) fn project(&self, row: &Row<T>, psi: &[T], a: &mut [T]) -> Result<(), RowError> {
        if row.dof >= self.dofs {
            return Err(RowError::Dof {
                dof: row.dof,
                dofs: self.dofs,
            });
        }
        if a.len() != self.rank {
            return Err(RowError::Buffer {
                what: "row",
                expected: self.rank,
                got: a.len(),
            });
        }
        let block = self.basis.count() * self.rank;
        let loading = &self.loading[row.dof * block..(row.dof + 1) * block];
        // A narrow basis is zero but for a few functions around the phase.
        let some = support(psi);
        let lines = &loading[some.start * self.rank..some.end * self.rank];
        combine(lines, &psi[some], a);
        // Zero, unless a number is not finite.
        let nothing = a
            .iter()
            .fold(T::zero(), |sum, value| sum + *value * T::zero());
        row.bounded(nothing.is_zero())
    }
}

/// One skill: the Gaussian `w = mu + L z`, `z ~ N(0, P0)`, `P0 = root root^T`, and its prior; or, by
/// [`Skill::with_freedom`], the Student-t of the same mean and covariance.
#[derive(Clone, Copy, Debug)]
pub struct Skill<'a, T> {
    weight_mean: &'a [T],
    root: Option<&'a [T]>,
    residual_variance: &'a [T],
    log_prior: T,
    freedom: Option<T>,
    spread: T,
}

impl<'a, T: Real> Skill<'a, T> {
    /// A view of a skill's parameters over `latent`.
    ///
    /// - `weight_mean`: `mu`, `D * K`, DoF-major, raw units;
    /// - `root`: lower triangular square root of the latent covariance, column after column, each from its diagonal
    ///   down ([`super::triangular_root`] makes it of any square root), `None` for the identity;
    /// - `residual_variance`: `D`, DoF unit squared: what the basis and the loading leave unexplained,
    ///   added to the noise of every *position* observed; zeros if there is none. (The residual's
    ///   velocity is unknown: velocities carry it in their own noise.)
    /// - `log_prior`: log probability of the skill before any observation; need not be normalised.
    ///
    /// # Errors
    /// A wrong length, a number that is not finite, a negative variance, a root whose covariance
    /// overflows the scalar.
    pub fn new(
        latent: &Latent<'_, T>,
        weight_mean: &'a [T],
        root: Option<&'a [T]>,
        residual_variance: &'a [T],
        log_prior: T,
    ) -> Result<Self, ModelError> {
        let mut skill = Self {
            weight_mean,
            root,
            residual_variance,
            log_prior,
            freedom: None,
            spread: T::one(),
        };
        skill.matches(latent)?;
        check_finite("the weight mean", weight_mean)?;
        check_finite("the residual variance", residual_variance)?;
        // Twice the log prior is finite, twice a log-likelihood is (`Belief::prepare`): their sum is.
        check_finite("twice the log prior", &[log_prior + log_prior])?;
        if let Some(dof) = residual_variance.iter().position(|v| *v < T::zero()) {
            return Err(ModelError::NegativeVariance {
                dof,
                value: residual_variance[dof].widen(),
            });
        }
        if let Some(root) = root {
            check_finite("the root", root)?;
            skill.spread = T::zero();
            for row in 0..latent.rank() {
                let variance = row_variance(root, latent.rank(), row);
                if !variance.is_finite() {
                    return Err(ModelError::RootOverflow { row });
                }
                skill.spread = skill.spread.max(variance.sqrt());
            }
        }
        Ok(skill)
    }

    /// The same skill with the tails of a few demonstrations: all its observations, noise included, are
    /// jointly a multivariate Student-t of `degrees_of_freedom` with the Gaussian's mean and
    /// covariance (its scale matrix is the covariance times `(nu - 2) / nu`). Means and prior variances
    /// are as before; what changes is [`Belief::log_likelihood`](super::Belief::log_likelihood) and,
    /// once something was observed, the posterior's variance
    /// ([`Belief::inflation`](super::Belief::inflation)).
    ///
    /// # Errors
    /// Degrees of freedom not finite or not above 2, below which there is no covariance.
    pub fn with_freedom(self, degrees_of_freedom: T) -> Result<Self, ModelError> {
        if degrees_of_freedom.is_finite() && degrees_of_freedom > T::of(2.0) {
            return Ok(Self {
                freedom: Some(degrees_of_freedom),
                ..self
            });
        }
        Err(ModelError::Freedom {
            freedom: degrees_of_freedom.widen(),
        })
    }

    /// Whether the skill has the shape of `latent`.
    pub(super) fn matches(&self, latent: &Latent<'_, T>) -> Result<(), ModelError> {
        check_len("the weight mean", self.weight_mean, latent.weights())?;
        check_len(
            "the residual variance",
            self.residual_variance,
            latent.dofs(),
        )?;
        match self.root {
            Some(root) => check_len("the root", root, root_len(latent.rank())),
            None => Ok(()),
        }
    }

    /// `mu`, `D * K`.
    #[must_use]
    pub const fn weight_mean(&self) -> &'a [T] {
        self.weight_mean
    }

    /// Triangular root of the latent prior covariance, packed by columns; `None` is the identity.
    #[must_use]
    pub const fn root(&self) -> Option<&'a [T]> {
        self.root
    }

    /// Unexplained position variance of each DoF.
    #[must_use]
    pub const fn residual_variance(&self) -> &'a [T] {
        self.residual_variance
    }

    /// Log prior probability.
    #[must_use]
    pub const fn log_prior(&self) -> T {
        self.log_prior
    }

    /// Degrees of freedom `nu` of a Student-t, `None` for a Gaussian.
    #[must_use]
    pub const fn freedom(&self) -> Option<T> {
        self.freedom
    }

    /// The largest standard deviation of a latent coordinate, which no observation enlarges.
    pub(super) const fn spread(&self) -> T {
        self.spread
    }

    /// The row's value at `z = 0`: `psi^T mu_d`, with `psi` from [`Latent::row`]. `K` multiply-adds.
    ///
    /// # Errors
    /// No such DoF.
    pub fn offset(&self, basis: &Basis, row: &Row<T>, psi: &[T]) -> Result<T, RowError> {
        let dofs = self.residual_variance.len();
        let mean = self
            .weight_mean
            .chunks_exact(basis.count())
            .nth(row.dof)
            .ok_or(RowError::Dof { dof: row.dof, dofs })?;
        let some = support(psi);
        Ok(weighted(basis, row.order, &psi[some.clone()], &mean[some]))
    }

    /// What the skill adds to the noise of an observation of `row`: its residual variance for a
    /// position, nothing for a velocity.
    pub(super) fn residual(&self, row: &Row<T>) -> T {
        match row.order {
            Order::Position => self
                .residual_variance
                .get(row.dof)
                .copied()
                .unwrap_or_else(T::zero),
            Order::Velocity { .. } => T::zero(),
        }
    }
}

/// Variance of one latent coordinate: the sum of squares of the root's row.
fn row_variance<T: Real>(root: &[T], rank: usize, row: usize) -> T {
    let mut start = 0;
    (0..=row).fold(T::zero(), |sum, column| {
        let entry = root[start + row - column];
        start += rank - column;
        sum + entry * entry
    })
}

fn check_len<T>(what: &'static str, slice: &[T], expected: usize) -> Result<(), ModelError> {
    if slice.len() == expected {
        return Ok(());
    }
    Err(ModelError::Length {
        what,
        expected,
        got: slice.len(),
    })
}

fn check_finite<T: Real>(what: &'static str, slice: &[T]) -> Result<(), ModelError> {
    match slice.iter().position(|value| !value.is_finite()) {
        None => Ok(()),
        Some(index) => Err(ModelError::NonFinite {
            what,
            index,
            value: slice[index].widen(),
        }),
    }
}
