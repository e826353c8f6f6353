//! A row of the observation matrix: one DoF, its position or velocity, at one phase.

use core::ops::Range;

use super::basis::Basis;
use super::error::RowError;
use super::linear::dot;
use crate::Real;

/// What of a DoF is observed or asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Order<T> {
    /// `y_d = psi(s)^T w_d`, in the DoF's own unit.
    Position,
    /// `dy_d/dt = psi'(s)^T w_d / duration`, in the DoF's unit per second.
    Velocity {
        /// How long the whole movement takes, seconds.
        duration_s: T,
    },
}

/// The same where the duration is given beside it, or not known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// In the DoF's own unit.
    Position,
    /// In the DoF's unit per second.
    Velocity,
}

/// One DoF, its position or velocity, at one phase: a row of the observation matrix (eq. 13-16).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row<T> {
    /// Which DoF, from 0.
    pub dof: usize,
    /// Position or velocity.
    pub order: Order<T>,
    /// Phase of the movement; outside `[0, 1]` see [`Basis`].
    pub phase: T,
}

impl<T> Row<T> {
    /// The position of a DoF.
    pub const fn position(dof: usize, phase: T) -> Self {
        Self {
            dof,
            order: Order::Position,
            phase,
        }
    }

    /// The velocity of a DoF in a movement that takes `duration_s`.
    pub const fn velocity(dof: usize, phase: T, duration_s: T) -> Self {
        Self {
            dof,
            order: Order::Velocity { duration_s },
            phase,
        }
    }
}

impl<T: Real> Row<T> {
    /// `Ok` when what was computed for this row is finite.
    pub(super) fn bounded(&self, finite: bool) -> Result<(), RowError> {
        if finite {
            return Ok(());
        }
        Err(RowError::Overflow {
            dof: self.dof,
            phase: self.phase.widen(),
        })
    }
}

/// Where the functions are that are not zero.
pub(super) fn support<T: Real>(psi: &[T]) -> Range<usize> {
    let nonzero = |value: &T| !value.is_zero();
    let first = psi.iter().position(nonzero).unwrap_or(0);
    let last = psi.iter().rposition(nonzero).map_or(first, |last| last + 1);
    first..last
}

/// `psi^T weights`: some functions, among them all that are not zero, and their weights of one DoF.
///
/// Where the functions sum to one (their derivatives to zero) the sum is taken about the weight `c`
/// under the largest of them, `c + psi^T (weights - c)`: the rounding of `psi` and of the sum then falls
/// on small differences, which halves the error of `f32` after many observations.
pub(super) fn weighted<T: Real>(basis: &Basis, order: Order<T>, psi: &[T], weights: &[T]) -> T {
    if !basis.sums_to_one() {
        return dot(psi, weights);
    }
    let pairs = || psi.iter().zip(weights);
    let (_, center) = pairs().fold((T::zero(), T::zero()), |best, (value, weight)| {
        if *value > best.0 {
            (*value, *weight)
        } else {
            best
        }
    });
    let sum = pairs().fold(T::zero(), |sum, (value, weight)| {
        sum + *value * (*weight - center)
    });
    match order {
        Order::Position => sum + center,
        Order::Velocity { .. } => sum,
    }
}
