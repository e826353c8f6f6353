//! Conditioning: what one observed number does to the belief about `z`.

use core::marker::PhantomData;

use super::error::{ConditionError, ModelError, RowError};
use super::evidence::{
    self, COUNT, FREEDOM, HEADER, LOG_LIKELIHOOD, MAHALANOBIS, NOISE_SHARE, RESIDUAL, SPREAD,
};
use super::linear::{dot, weighted_dot};
use super::skill::Skill;
use super::triangle::{observe, project, root_len};
use crate::Real;

/// Least share of the predicted variance that is taken for noise: far below any rounding, and far above what `f32`
/// divides by without overflow.
const LEAST_NOISE: f64 = 1e-20;

/// Numbers that a belief of rank `rank` stores: `r (r + 1) / 2 + 3 r + 10`.
#[must_use]
pub const fn belief_len(rank: usize) -> usize {
    root_len(rank) + 3 * rank + HEADER
}

/// What one observation told: how far it lay from the prediction, and how uncertain that was (in the
/// Gaussian's metric: for a Student-t the prediction's variance was [`Belief::inflation`], as it was before the
/// observation, times that).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Innovation<T> {
    /// Observed less predicted, in the observation's unit.
    pub residual: T,
    /// Variance of the residual before the observation: `a^T P a + R`.
    pub variance: T,
}

/// A Gaussian over the coordinates of a skill, `z` here: mean, and covariance `P = S diag(d) S^T` by a triangle `S` and
/// shares `d`, with the joint log-likelihood of all that was observed. The coordinates are the latent space's, or the
/// skill's own ([`Skill::with_loading`]), and `r` is their number. For a skill with degrees of freedom
/// ([`Skill::with_freedom`]) the belief is a Student-t: same mean, covariance [`Belief::inflation`] times `P`.
///
/// `B` is storage of at least [`belief_len`] numbers: `[T; N]` on the chip, `Vec<T>` on the host,
/// `&[T]` where a [`super::Mixture`] lends one of its own.
#[derive(Clone, Debug)]
pub struct Belief<T, B> {
    rank: usize,
    storage: B,
    scalar: PhantomData<T>,
}

/// What a belief says of the movement, for as long as its storage lives.
#[derive(Clone, Copy, Debug)]
pub(super) struct Posterior<'a, T> {
    pub(super) mean: &'a [T],
    pub(super) root: &'a [T],
    pub(super) shares: &'a [T],
    pub(super) inflation: T,
}

/// The storage by its parts.
struct Parts<'s, T> {
    header: &'s mut [T],
    mean: &'s mut [T],
    /// `f = S^T a sqrt(alpha)`, then `P a sqrt(alpha)`: scratch.
    projected: &'s mut [T],
    shares: &'s mut [T],
    root: &'s mut [T],
}

impl<T: Real, B: AsRef<[T]>> Belief<T, B> {
    /// Storage that already holds a belief of this rank (a mixture's own).
    pub(super) const fn view(rank: usize, storage: B) -> Self {
        Self {
            rank,
            storage,
            scalar: PhantomData,
        }
    }

    /// Coordinates, `r`.
    #[must_use]
    pub const fn rank(&self) -> usize {
        self.rank
    }

    /// Joint log-likelihood of all observations since the start, in nats (densities in the
    /// observations' own units): Gaussian, or of the Student-t whose degrees of freedom the skill states.
    #[must_use]
    pub fn log_likelihood(&self) -> T {
        self.storage.as_ref()[LOG_LIKELIHOOD]
    }

    /// How many numbers were observed since the start, `k` (a whole number).
    #[must_use]
    pub fn observations(&self) -> T {
        self.storage.as_ref()[COUNT]
    }

    /// Squared Mahalanobis distance of all that was observed from what the skill expected, `m^2`: the sum
    /// of every [`Innovation`]'s `residual^2 / variance`. Under a Gaussian skill, chi-square
    /// of [`Belief::observations`] degrees of freedom.
    #[must_use]
    pub fn mahalanobis(&self) -> T {
        self.storage.as_ref()[MAHALANOBIS]
    }

    /// What the covariance `P` is to be multiplied by: `(nu - 2 + m^2) / (nu - 2 + k)` for a skill of
    /// `nu` degrees of freedom, one for a Gaussian. [`Trajectory`](super::Trajectory)'s answers carry it.
    #[must_use]
    pub fn inflation(&self) -> T {
        self.prior_freedom()
            .map_or_else(T::one, |_| evidence::inflation(self.storage.as_ref()))
    }

    /// Degrees of freedom of what the belief now expects, `nu + k`; `None` for a Gaussian.
    #[must_use]
    pub fn freedom(&self) -> Option<T> {
        Some(self.prior_freedom()? + self.observations())
    }

    fn prior_freedom(&self) -> Option<T> {
        let freedom = self.storage.as_ref()[FREEDOM];
        (freedom > T::zero()).then_some(freedom)
    }

    /// Mean, root and inflation.
    pub(super) fn posterior(&self) -> Posterior<'_, T> {
        Posterior {
            mean: self.mean(),
            root: self.root(),
            shares: self.shares(),
            inflation: self.inflation(),
        }
    }

    /// Mean of `z`, `r`.
    #[must_use]
    pub fn mean(&self) -> &[T] {
        mean_of(self.rank, self.storage.as_ref())
    }

    /// `S` of the covariance `S diag(d) S^T` of `z` before its [`Belief::inflation`]: a lower triangle, column after column,
    /// each from its diagonal down ([`root_len`] numbers).
    #[must_use]
    pub fn root(&self) -> &[T] {
        root_of(self.rank, self.storage.as_ref())
    }

    /// `d` of the covariance `S diag(d) S^T`: `r` numbers above zero and at most one, but for rounding.
    #[must_use]
    pub fn shares(&self) -> &[T] {
        shares_of(self.rank, self.storage.as_ref())
    }
}

impl<'s, T: Real> Belief<T, &'s [T]> {
    /// As [`Belief::posterior`], for as long as the storage lives, which may be longer than this view of it.
    pub(super) fn lent(&self) -> Posterior<'s, T> {
        Posterior {
            mean: mean_of(self.rank, self.storage),
            root: root_of(self.rank, self.storage),
            shares: shares_of(self.rank, self.storage),
            inflation: self.inflation(),
        }
    }
}

fn shares_of<T>(rank: usize, storage: &[T]) -> &[T] {
    &storage[HEADER + 2 * rank..HEADER + 3 * rank]
}

fn mean_of<T>(rank: usize, storage: &[T]) -> &[T] {
    &storage[HEADER..HEADER + rank]
}

fn root_of<T>(rank: usize, storage: &[T]) -> &[T] {
    &storage[HEADER + 3 * rank..belief_len(rank)]
}

impl<T: Real, B: AsRef<[T]> + AsMut<[T]>> Belief<T, B> {
    /// The skill's prior: mean zero, the skill's root, log-likelihood zero. Takes `storage` over,
    /// whatever it holds.
    ///
    /// # Errors
    /// Storage shorter than [`belief_len`] of [`Skill::rank`], which is at most the latent space's.
    pub fn new(skill: &Skill<'_, T>, storage: B) -> Result<Self, ModelError> {
        let mut belief = Self::view(skill.rank(), storage);
        belief.reset(skill)?;
        Ok(belief)
    }

    /// Forgets every observation: back to the prior of `skill`.
    ///
    /// # Errors
    /// Storage too short for a skill of another rank; the belief is unchanged.
    pub fn reset(&mut self, skill: &Skill<'_, T>) -> Result<(), ModelError> {
        check_storage(self.storage.as_ref(), skill.rank())?;
        self.rank = skill.rank();
        self.start(skill);
        Ok(())
    }

    /// The prior of a skill of the same rank, whatever the storage held.
    pub(super) fn start(&mut self, skill: &Skill<'_, T>) {
        let rank = self.rank;
        let parts = self.parts();
        parts.header.fill(T::zero());
        parts.header[FREEDOM] = skill.freedom().unwrap_or_else(T::zero);
        parts.header[SPREAD] = skill.spread();
        parts.mean.fill(T::zero());
        parts.shares.fill(T::one());
        match skill.prior_root() {
            Some(root) => parts.root.copy_from_slice(root),
            None => {
                parts.root.fill(T::zero());
                let mut diagonal = 0;
                for column in (1..=rank).rev() {
                    parts.root[diagonal] = T::one();
                    diagonal += column;
                }
            }
        }
    }

    /// Conditions on one scalar (eq. 13-16, for one row, by Bierman's factored update, 1976):
    ///
    /// ```text
    /// f = S^T a    alpha = 1 / (sum d_j f_j^2 + R)    g = alpha S diag(d) f
    /// z += g (y - offset - a^T z)             P -= g g^T / alpha, column by column of S
    /// ll -= (e^2 alpha - ln alpha + ln 2 pi) / 2,   e = y - offset - a^T z
    /// m^2 += e^2 alpha                        ln det -= ln alpha
    /// ```
    ///
    /// `P` stays positive semi-definite whatever the rounding, and no matrix is inverted. Several
    /// numbers with independent noise are conditioned one after the other, in any order; correlated
    /// ones are whitened first. `a` and `offset` come from [`Skill::row`] and
    /// [`Skill::offset`]; `variance` is `R`: sensor noise plus the skill's residual variance.
    ///
    /// Cost: `3/2 r^2` multiply-adds, `r` divisions and a logarithm, after the `K * r`
    /// of the row; no memory beyond the belief's own.
    ///
    /// # Errors
    /// `a` not `r` long; value or row not finite; variance not positive and finite (an exact
    /// observation makes `f^T f + R` singular in directions already known: give the sensor's
    /// resolution); a result that the scalar cannot hold. The belief is unchanged by any of them.
    pub fn condition(
        &mut self,
        a: &[T],
        offset: T,
        value: T,
        variance: T,
    ) -> Result<Innovation<T>, ConditionError> {
        let innovation = self.prepare(a, offset, value, variance)?;
        self.commit();
        Ok(innovation)
    }

    /// Everything of [`Belief::condition`] that can fail, into scratch: mean, root and log-likelihood
    /// are untouched until [`Belief::commit`].
    ///
    /// `f` is kept in units that make its length (under `d`) at most one, `f sqrt(alpha)`, and `e` likewise. By Cauchy
    /// and Schwarz `P a` then never exceeds the norm of its row of the root, whose square, the
    /// variance of that coordinate, no observation enlarges and was finite when the skill was made; so neither
    /// it nor the new root needs a check, and a bound on the mean is kept by adding up.
    pub(super) fn prepare(
        &mut self,
        a: &[T],
        offset: T,
        value: T,
        variance: T,
    ) -> Result<Innovation<T>, ConditionError> {
        if a.len() != self.rank {
            return Err(ConditionError::Row(RowError::Buffer {
                what: "row",
                expected: self.rank,
                got: a.len(),
            }));
        }
        if !value.is_finite() {
            return Err(ConditionError::Value {
                value: value.widen(),
            });
        }
        check_variance(variance)?;
        let parts = self.parts();
        project(parts.root, a, parts.projected);
        let innovation_variance =
            weighted_dot(Some(&*parts.shares), parts.projected, parts.projected) + variance;
        let alpha = T::one() / innovation_variance;
        let unit = alpha.sqrt();
        for f in parts.projected.iter_mut() {
            *f *= unit;
        }
        let predicted = offset + dot(a, parts.mean);
        let residual = value - predicted;
        let (share, least) = (variance * alpha, T::of(LEAST_NOISE));
        let share = if share > least { share } else { least };
        parts.header[RESIDUAL..].copy_from_slice(&[residual * unit, alpha.ln(), share]);
        if !(alpha > T::zero() && evidence::bounded(parts.header)) {
            return Err(ConditionError::Overflow {
                value: value.widen(),
                predicted: predicted.widen(),
            });
        }
        Ok(Innovation {
            residual,
            variance: innovation_variance,
        })
    }

    /// Makes the prepared update the belief. Cannot fail.
    pub(super) fn commit(&mut self) {
        let Parts {
            header,
            mean,
            projected,
            shares,
            root,
        } = self.parts();
        evidence::accumulate(header);
        observe(root, shares, projected, header[NOISE_SHARE]);
        let residual = header[RESIDUAL];
        for (mean, gain) in mean.iter_mut().zip(projected.iter()) {
            *mean += *gain * residual;
        }
    }

    fn parts(&mut self) -> Parts<'_, T> {
        let rank = self.rank;
        let (header, rest) = self.storage.as_mut().split_at_mut(HEADER);
        let (mean, rest) = rest.split_at_mut(rank);
        let (projected, rest) = rest.split_at_mut(rank);
        let (shares, rest) = rest.split_at_mut(rank);
        Parts {
            header,
            mean,
            projected,
            shares,
            root: &mut rest[..root_len(rank)],
        }
    }
}

fn check_storage<T>(storage: &[T], rank: usize) -> Result<(), ModelError> {
    let (needed, got) = (belief_len(rank), storage.len());
    if got >= needed {
        return Ok(());
    }
    Err(ModelError::Storage {
        what: "the belief's storage",
        needed,
        got,
    })
}

/// Refuses a noise variance that is not positive and finite.
pub(super) fn check_variance<T: Real>(variance: T) -> Result<(), ConditionError> {
    if variance.is_finite() && variance > T::zero() {
        return Ok(());
    }
    Err(ConditionError::Variance {
        variance: variance.widen(),
    })
}

impl<T: Real, B: AsRef<[T]>> Belief<T, B> {
    /// The same belief in storage of its own, which is taken over: to plan from, while this one goes on observing.
    ///
    /// # Errors
    /// Storage shorter than [`belief_len`].
    pub fn copied<C: AsRef<[T]> + AsMut<[T]>>(
        &self,
        mut storage: C,
    ) -> Result<Belief<T, C>, ModelError> {
        check_storage(storage.as_ref(), self.rank)?;
        let length = belief_len(self.rank);
        storage.as_mut()[..length].copy_from_slice(&self.storage.as_ref()[..length]);
        Ok(Belief::view(self.rank, storage))
    }
}
