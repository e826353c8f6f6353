//! A row of the observation matrix: one DoF, its position or velocity, at one phase.

use super::basis::Basis;
use super::error::RowError;
use super::linear::{combine, dot, dot_about};
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

/// Where the functions of one phase are that are not zero, and which is the largest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Support {
    from: usize,
    to: usize,
    peak: usize,
}

impl Support {
    pub(super) fn of<T: Real>(psi: &[T]) -> Self {
        let nonzero = |value: &T| !value.is_zero();
        let from = psi.iter().position(nonzero).unwrap_or(0);
        let to = psi.iter().rposition(nonzero).map_or(from, |last| last + 1);
        let mut peak = (from, T::zero());
        for (index, value) in (from..).zip(&psi[from..to]) {
            if *value > peak.1 {
                peak = (index, *value);
            }
        }
        let peak = peak.0;
        Self { from, to, peak }
    }
}

/// The functions of one phase. A narrow basis is zero but for a few of them around the phase.
#[derive(Clone, Copy, Debug)]
pub(super) struct Functions<'p, T> {
    psi: &'p [T],
    support: Support,
}

impl<'p, T: Real> Functions<'p, T> {
    /// Looks where they are not zero.
    pub(super) fn of(psi: &'p [T]) -> Self {
        Self::on(psi, Support::of(psi))
    }

    /// Where they are not zero is known.
    pub(super) const fn on(psi: &'p [T], support: Support) -> Self {
        Self { psi, support }
    }

    pub(super) const fn support(&self) -> Support {
        self.support
    }

    /// `M_d^T psi`, `matrix` the lines of one DoF, as long as `out`.
    pub(super) fn combine(&self, matrix: &[T], out: &mut [T]) {
        let Support { from, to, .. } = self.support;
        let lines = &matrix[from * out.len()..to * out.len()];
        combine(lines, &self.psi[from..to], out);
    }

    /// `psi^T weights`, the weights of one DoF.
    ///
    /// Where the functions sum to one (their derivatives to zero) the sum is taken about the weight `c`
    /// under the largest of them, `c + psi^T (weights - c)`: the rounding of `psi` and of the sum then falls
    /// on small differences, which halves the error of `f32` after many observations.
    pub(super) fn weighted(&self, basis: &Basis, order: Order<T>, weights: &[T]) -> T {
        let Support { from, to, peak } = self.support;
        let (psi, some) = (&self.psi[from..to], &weights[from..to]);
        if !basis.sums_to_one() {
            return dot(psi, some);
        }
        let sum = dot_about(psi, some, weights[peak]);
        match order {
            Order::Position => sum + weights[peak],
            Order::Velocity { .. } => sum,
        }
    }
}
