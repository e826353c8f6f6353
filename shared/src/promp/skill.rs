//! A skill: a mean, and the directions in which its movements differ.

use super::basis::Basis;
use super::error::{ModelError, RowError};
use super::latent::{Latent, check_finite, check_len};
use super::linear::dot;
use super::row::{Functions, Order, Row};
use super::triangle::root_len;
use crate::Real;

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
    /// Coordinates of its beliefs.
    rank: usize,
    /// Its own loading of them; `None` is the latent space's.
    loading: Option<&'a [T]>,
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
            rank: latent.rank(),
            loading: None,
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

    /// The same skill in the `rank` directions of its own in which it varies, where these are fewer than the latent
    /// space's, as after a few demonstrations: `w = mu + M u`, `u ~ N(0, 1)`. `loading` is `M = L root` without the columns
    /// that are zero (`D*K x rank`, row-major; [`own_loading`] makes it). A belief about the skill is then about `u`
    /// instead of `z`, says the same, and costs less: `3/2 rank^2` multiply-adds an observation, beside
    /// `K rank` for a row that no other skill shares.
    ///
    /// # Errors
    /// No direction or more than the latent space has, another length, a number that is not finite.
    pub fn with_loading(
        self,
        latent: &Latent<'_, T>,
        rank: usize,
        loading: &'a [T],
    ) -> Result<Self, ModelError> {
        check_directions(rank, latent.rank())?;
        let expected = latent.weights().saturating_mul(rank);
        check_len("the skill's loading", loading, expected)?;
        check_finite("the skill's loading", loading)?;
        Ok(Self {
            rank,
            loading: Some(loading),
            spread: T::one(),
            ..self
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
        if let Some(root) = self.root {
            check_len("the root", root, root_len(latent.rank()))?;
        }
        match self.loading {
            Some(loading) => {
                let expected = latent.weights().saturating_mul(self.rank);
                check_len("the skill's loading", loading, expected)
            }
            None if self.rank == latent.rank() => Ok(()),
            None => Err(ModelError::Length {
                what: "the skill's coordinates",
                expected: latent.rank(),
                got: self.rank,
            }),
        }
    }

    /// `mu`, `D * K`.
    #[must_use]
    pub const fn weight_mean(&self) -> &'a [T] {
        self.weight_mean
    }

    /// Coordinates of a belief about the skill: the latent space's, or fewer of its own ([`Skill::with_loading`]).
    #[must_use]
    pub const fn rank(&self) -> usize {
        self.rank
    }

    /// Whether its rows are the latent space's, as those of other skills.
    pub(super) const fn shares_rows(&self) -> bool {
        self.loading.is_none()
    }

    /// The loading of its coordinates.
    pub(super) fn loading(&self, latent: &Latent<'a, T>) -> &'a [T] {
        self.loading.unwrap_or(latent.loading())
    }

    /// As [`Latent::project`], in the skill's coordinates.
    pub(super) fn project(
        &self,
        latent: &Latent<'_, T>,
        row: &Row<T>,
        functions: Functions<'_, T>,
        a: &mut [T],
    ) -> Result<(), RowError> {
        match self.loading {
            Some(loading) => latent.project_by((loading, self.rank), row, functions, a),
            None => latent.project(row, functions, a),
        }
    }

    /// As [`Latent::row`], in the skill's coordinates: `a` is [`Skill::rank`] long.
    ///
    /// # Errors
    /// As [`Latent::row`].
    pub fn row(
        &self,
        latent: &Latent<'_, T>,
        row: &Row<T>,
        psi: &mut [T],
        a: &mut [T],
    ) -> Result<(), RowError> {
        latent.functions(row, psi)?;
        self.project(latent, row, Functions::of(psi), a)
    }

    /// Root of the prior of its coordinates; `None` is the identity.
    pub(super) fn prior_root(&self) -> Option<&'a [T]> {
        self.root.filter(|_| self.shares_rows())
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

    /// The largest prior standard deviation of a coordinate, which no observation enlarges.
    pub(super) const fn spread(&self) -> T {
        self.spread
    }

    /// The row's value at `z = 0`: `psi^T mu_d`, with `psi` from [`Latent::row`]. `K` multiply-adds.
    ///
    /// # Errors
    /// No such DoF.
    pub fn offset(&self, basis: &Basis, row: &Row<T>, psi: &[T]) -> Result<T, RowError> {
        self.offset_of(basis, row, Functions::of(psi))
    }

    /// As [`Skill::offset`].
    pub(super) fn offset_of(
        &self,
        basis: &Basis,
        row: &Row<T>,
        functions: Functions<'_, T>,
    ) -> Result<T, RowError> {
        let dofs = self.residual_variance.len();
        let mean = self
            .weight_mean
            .chunks_exact(basis.count())
            .nth(row.dof)
            .ok_or(RowError::Dof { dof: row.dof, dofs })?;
        Ok(functions.weighted(basis, row.order, mean))
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

/// Writes `L root` to `out` (`D*K x columns`, row-major), the loading of a skill that varies in as many directions as the
/// first `columns` of its root, after which all are zero. `D K r columns` multiply-adds: done once, where a model is made.
///
/// # Errors
/// No column or more than the latent space has dimensions, a length that does not fit.
pub fn own_loading<T: Real>(
    latent: &Latent<'_, T>,
    root: &[T],
    columns: usize,
    out: &mut [T],
) -> Result<(), ModelError> {
    let rank = latent.rank();
    check_directions(columns, rank)?;
    check_len("the root", root, root_len(rank))?;
    check_len("the skill's loading", out, latent.weights() * columns)?;
    let lines = latent.loading().chunks_exact(rank);
    for (line, out) in lines.zip(out.chunks_exact_mut(columns)) {
        let mut rest = root;
        for (index, entry) in out.iter_mut().enumerate() {
            let (column, after) = rest.split_at(rank - index);
            *entry = dot(column, &line[index..]);
            rest = after;
        }
    }
    Ok(())
}

/// Refuses none, and more than a belief has room for.
fn check_directions(count: usize, rank: usize) -> Result<(), ModelError> {
    match count {
        0 => Err(ModelError::Empty {
            what: "direction of the skill",
        }),
        _ if count > rank => Err(ModelError::Length {
            what: "the skill's directions",
            expected: rank,
            got: count,
        }),
        _ => Ok(()),
    }
}

/// Directions in which a skill of this packed root of `rank` rows varies: its columns up to the last that is not zero.
#[must_use]
pub fn directions<T: Real>(root: &[T], rank: usize) -> usize {
    let mut rest = root;
    let mut columns = 0;
    for index in 0..rank {
        let (column, after) = rest.split_at(rank - index);
        if column.iter().any(|entry| !entry.is_zero()) {
            columns = index + 1;
        }
        rest = after;
    }
    columns
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
