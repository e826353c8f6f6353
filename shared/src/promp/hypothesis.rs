//! One hypothesis about a movement under way: which skill, how long, since when.

use super::row::{Order, Quantity, Row};
use crate::Real;

/// Which skill is performed, how long the whole movement takes and when it began.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hypothesis<T> {
    /// Index of the skill.
    pub skill: usize,
    /// From onset to end, seconds; positive.
    pub duration_s: T,
    /// When the movement began, or will, seconds on the observations' clock.
    pub onset_s: T,
    /// Log prior probability of this duration and onset given the skill; need not be normalised. (The skill's own
    /// prior is the skill's.)
    pub log_prior: T,
}

impl<T: Real> Default for Hypothesis<T> {
    /// The first skill, one second from time zero: what a slot holds that is not in use.
    fn default() -> Self {
        Self {
            skill: 0,
            duration_s: T::one(),
            onset_s: T::zero(),
            log_prior: T::zero(),
        }
    }
}

impl<T: Real> Hypothesis<T> {
    /// Progress at a time, from 0 to 1: `clamp((t - onset) / duration, 0, 1)`. Before the onset the hand is where the
    /// movement starts, after the end where it ends.
    #[must_use]
    pub fn phase(&self, time_s: T) -> T {
        ((time_s - self.onset_s) / self.duration_s).clamp(T::zero(), T::one())
    }

    /// Whether the movement is under way at a time.
    #[must_use]
    pub fn moving(&self, time_s: T) -> bool {
        let since_s = time_s - self.onset_s;
        since_s >= T::zero() && since_s <= self.duration_s
    }

    /// The row of a DoF at a time; a velocity has this hypothesis' duration.
    pub(super) fn row(&self, dof: usize, quantity: Quantity, time_s: T) -> Row<T> {
        let order = match quantity {
            Quantity::Position => Order::Position,
            Quantity::Velocity => Order::Velocity {
                duration_s: self.duration_s,
            },
        };
        Row {
            dof,
            order,
            phase: self.phase(time_s),
        }
    }
}

/// One observed number and when it was.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observed<T> {
    /// Which DoF, from 0.
    pub dof: usize,
    /// Position or velocity.
    pub quantity: Quantity,
    /// When, seconds.
    pub time_s: T,
    /// What was seen, in the unit of the quantity.
    pub value: T,
    /// Variance of the sensor's noise, that unit squared; each skill adds its own residual to a position's.
    pub variance: T,
}
