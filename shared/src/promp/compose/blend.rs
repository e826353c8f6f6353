//! Several skills at once: the product of their Gaussians at each instant, weighted by activation.

use super::ComposeError;
use crate::Real;
use crate::promp::error::RowError;
use crate::promp::linear::dot;
use crate::promp::row::{Quantity, Row};
use crate::promp::trajectory::{Trajectory, trajectory_scratch_len};

/// Numbers that a [`Blend`] of `signals` signals stores: `3 n^2 + 2 n` and the scratch of a trajectory.
#[must_use]
pub const fn blend_len(signals: usize, basis: usize, rank: usize) -> usize {
    3 * signals * signals + 2 * signals + trajectory_scratch_len(basis, rank)
}

/// One signal of a blend.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Signal<T> {
    /// Which DoF, from 0.
    pub dof: usize,
    /// Its position or its velocity.
    pub quantity: Quantity,
    /// Variance, the signal's unit squared, that is added to each skill's own: how far off no skill minds. It
    /// is what makes a covariance regular that demonstrations left singular (eq. 2's noise).
    pub tolerance: T,
}

/// A skill that takes part at an instant.
#[derive(Clone, Copy, Debug)]
pub struct Active<'a, T> {
    /// Its movement, under its prior or under a belief.
    pub trajectory: Trajectory<'a, T>,
    /// How much it counts, from 0.
    pub activation: T,
    /// How far it is.
    pub phase: T,
    /// How long it takes, seconds.
    pub duration_s: T,
}

impl<T> Active<'_, T>
where
    T: Copy,
{
    fn row(&self, signal: &Signal<T>) -> Row<T> {
        match signal.quantity {
            Quantity::Position => Row::position(signal.dof, self.phase),
            Quantity::Velocity => Row::velocity(signal.dof, self.phase, self.duration_s),
        }
    }
}

/// What active skills agree on at one instant (Paraschos et al. 2013, "Probabilistic movement primitives",
/// section on combination and blending):
///
/// ```text
/// p(y) ~ prod_q N(y; m_q, S_q)^activation_q
/// S^-1 = sum_q activation_q S_q^-1,     m = S sum_q activation_q S_q^-1 m_q
/// ```
///
/// with `y` any positions and velocities together, so that what is coupled stays coupled. Activations that
/// sum to one *blend* (equal skills give themselves); all at one *co-activate* (each demand is met where its
/// skill is certain). Moving them in time with [`super::hand_over`] goes from one skill to the next.
///
/// No matrix is inverted: from the most active skill on, `(C^-1 + a S_q^-1)^-1 = C (a C + S_q)^-1 S_q` by one
/// Cholesky factor each, which loses nothing to a subtraction.
///
/// `B` is storage of at least [`blend_len`] numbers. Cost for `n` signals and `Q` skills: `Q n (n + 1) / 2`
/// covariances of rows and about `3 Q n^3` multiply-adds.
#[derive(Clone, Debug)]
pub struct Blend<'s, T, B> {
    signals: &'s [Signal<T>],
    storage: B,
}

/// Three `n x n` matrices, two vectors and scratch.
struct Room<'s, T> {
    /// Of the product.
    covariance: &'s mut [T],
    /// Of the skill that comes in.
    other: &'s mut [T],
    factor: &'s mut [T],
    mean: &'s mut [T],
    gap: &'s mut [T],
    scratch: &'s mut [T],
}

impl<'s, T: Real, B: AsRef<[T]> + AsMut<[T]>> Blend<'s, T, B> {
    /// Of these signals. Takes `storage` over, whatever it holds.
    ///
    /// # Errors
    /// A tolerance that is not positive and finite.
    pub fn new(signals: &'s [Signal<T>], storage: B) -> Result<Self, ComposeError> {
        for (index, signal) in signals.iter().enumerate() {
            let variance = signal.tolerance;
            if !(variance.is_finite() && variance > T::zero()) {
                let variance = variance.widen();
                return Err(ComposeError::Tolerance { index, variance });
            }
        }
        Ok(Self { signals, storage })
    }

    /// The signals.
    #[must_use]
    pub const fn signals(&self) -> &'s [Signal<T>] {
        self.signals
    }

    /// Multiplies the active skills; [`Blend::mean`] and [`Blend::covariance`] are their product then.
    ///
    /// # Errors
    /// No active skill, an activation below 0, rows that a skill cannot have, storage too short, a covariance
    /// that is singular in this scalar. Mean and covariance mean nothing then.
    pub fn at(&mut self, active: &[Active<'_, T>]) -> Result<(), ComposeError> {
        for (index, skill) in active.iter().enumerate() {
            if !(skill.activation.is_finite() && skill.activation >= T::zero()) {
                let activation = skill.activation.widen();
                return Err(ComposeError::Activation { index, activation });
            }
        }
        let strongest = active.iter().enumerate().fold(None, |best, (i, skill)| {
            let least = best.map_or(T::zero(), |(_, activation)| activation);
            if skill.activation > least {
                Some((i, skill.activation))
            } else {
                best
            }
        });
        let (first, activation) = strongest.ok_or(ComposeError::Inactive)?;
        let signals = self.signals;
        let needed = active.iter().fold(0, |needed, skill| {
            let (basis, rank) = skill.trajectory.shape();
            needed.max(blend_len(signals.len(), basis, rank))
        });
        let mut room = self.room(needed)?;
        write(
            signals,
            &active[first],
            room.mean,
            room.covariance,
            room.scratch,
        )?;
        for entry in room.covariance.iter_mut() {
            *entry /= activation;
        }
        for (index, skill) in active.iter().enumerate() {
            if index != first && skill.activation > T::zero() {
                write(signals, skill, room.gap, room.other, room.scratch)?;
                room.multiply(skill.activation)?;
            }
        }
        Ok(())
    }

    /// Mean of each signal after [`Blend::at`].
    #[must_use]
    pub fn mean(&self) -> &[T] {
        self.storage
            .as_ref()
            .get(..self.signals.len())
            .unwrap_or(&[])
    }

    /// Covariance of the signals after [`Blend::at`], row-major.
    #[must_use]
    pub fn covariance(&self) -> &[T] {
        let n = self.signals.len();
        self.storage.as_ref().get(n..n + n * n).unwrap_or(&[])
    }

    fn room(&mut self, expected: usize) -> Result<Room<'_, T>, ComposeError> {
        let n = self.signals.len();
        let storage = self.storage.as_mut();
        let got = storage.len();
        if got < expected {
            return Err(ComposeError::Row(RowError::Buffer {
                what: "blend",
                expected,
                got,
            }));
        }
        let (mean, rest) = storage.split_at_mut(n);
        let (covariance, rest) = rest.split_at_mut(n * n);
        let (other, rest) = rest.split_at_mut(n * n);
        let (factor, rest) = rest.split_at_mut(n * n);
        let (gap, scratch) = rest.split_at_mut(n);
        Ok(Room {
            covariance,
            other,
            factor,
            mean,
            gap,
            scratch,
        })
    }
}

/// Mean and covariance, tolerance included, that one skill has for the signals.
fn write<T: Real>(
    signals: &[Signal<T>],
    skill: &Active<'_, T>,
    mean: &mut [T],
    covariance: &mut [T],
    scratch: &mut [T],
) -> Result<(), ComposeError> {
    let n = signals.len();
    for (i, one) in signals.iter().enumerate() {
        let row = skill.row(one);
        let moments = skill.trajectory.moments(&row, scratch)?;
        mean[i] = moments.mean;
        covariance[i * n + i] = moments.variance + one.tolerance;
        for (j, other) in signals[..i].iter().enumerate() {
            let value = (skill.trajectory).covariance(&row, &skill.row(other), scratch)?;
            covariance[i * n + j] = value;
            covariance[j * n + i] = value;
        }
    }
    Ok(())
}

impl<T: Real> Room<'_, T> {
    /// Takes the Gaussian in `gap` and `other` into the product, to the power `activation`.
    fn multiply(&mut self, activation: T) -> Result<(), ComposeError> {
        let n = self.mean.len();
        let sums = self.covariance.iter().zip(self.other.iter());
        for (slot, (own, other)) in self.factor.iter_mut().zip(sums) {
            *slot = activation * *own + *other;
        }
        cholesky(n, self.factor)?;
        for (gap, mean) in self.gap.iter_mut().zip(self.mean.iter()) {
            *gap -= *mean;
        }
        // With M M^T = a C + S: X = M^-1 C, Y = M^-1 S, u = M^-1 gap.
        solve(n, 1, self.factor, self.gap);
        solve(n, n, self.factor, self.covariance);
        solve(n, n, self.factor, self.other);
        // m += a X^T u,  C = X^T Y; the factor has served.
        for i in 0..n {
            let column = || self.covariance.iter().skip(i).step_by(n);
            let change = column().zip(self.gap.iter());
            let change = change.fold(T::zero(), |sum, (x, u)| sum + *x * *u);
            self.mean[i] += activation * change;
            for j in 0..n {
                let other = self.other.iter().skip(j).step_by(n);
                let products = column().zip(other);
                self.factor[i * n + j] = products.fold(T::zero(), |sum, (x, y)| sum + *x * *y);
            }
        }
        // Symmetric but for rounding; then without.
        for i in 0..n {
            for j in 0..=i {
                let both = (self.factor[i * n + j] + self.factor[j * n + i]) * T::of(0.5);
                self.covariance[i * n + j] = both;
                self.covariance[j * n + i] = both;
            }
        }
        Ok(())
    }
}

/// Lower factor in place of a symmetric matrix; what lies above the diagonal is left.
fn cholesky<T: Real>(n: usize, matrix: &mut [T]) -> Result<(), ComposeError> {
    for i in 0..n {
        let (above, line) = matrix.split_at_mut(i * n);
        for j in 0..i {
            let other = &above[j * n..j * n + n];
            line[j] = (line[j] - dot(&line[..j], &other[..j])) / other[j];
        }
        let rest = line[i] - dot(&line[..i], &line[..i]);
        if !(rest.is_finite() && rest > T::zero()) {
            return Err(ComposeError::Singular { index: i });
        }
        line[i] = rest.sqrt();
    }
    Ok(())
}

/// `M^-1 B` in place of `B` (`n x columns`, row-major), `M` lower: forward substitution.
fn solve<T: Real>(n: usize, columns: usize, factor: &[T], b: &mut [T]) {
    for i in 0..n {
        let (above, line) = b.split_at_mut(i * columns);
        for (solved, weight) in above.chunks_exact(columns).zip(&factor[i * n..]) {
            for (slot, value) in line.iter_mut().zip(solved) {
                *slot -= *weight * *value;
            }
        }
        let diagonal = factor[i * n + i];
        for slot in &mut line[..columns] {
            *slot /= diagonal;
        }
    }
}
