//! Composition: via-points, a start at the present state, smooth hand-over from one skill to the next, and
//! several skills at once ([`Blend`]).
//!
//! A skill is never changed. What is asked of a movement conditions a belief ([`via_point`]); what the belief
//! cannot give exactly, because demonstrations never varied that way, a [`Bridge`] adds and lets fade.

mod blend;

pub use blend::{Active, Blend, Signal, blend_len};

use thiserror::Error;

use super::belief::{Belief, Innovation};
use super::error::{ConditionError, RowError};
use super::latent::Latent;
use super::mixture::Observation;
use super::row::Row;
use super::skill::Skill;
use super::trajectory::Trajectory;
use crate::Real;

/// Scratch that [`via_point`] needs: `K + r` numbers.
#[must_use]
pub const fn via_len(basis: usize, rank: usize) -> usize {
    basis + rank
}

/// What cannot be composed.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum ComposeError {
    /// A row that the model cannot have, or a buffer of the wrong length.
    #[error(transparent)]
    Row(#[from] RowError),
    /// An activation that is negative or not finite.
    #[error("the activation of skill {index} is {activation}: give a finite number from 0")]
    Activation {
        /// Which of the active skills, from 0.
        index: usize,
        /// The activation.
        activation: f64,
    },
    /// No skill is active.
    #[error("no skill is active: give at least one an activation above 0")]
    Inactive,
    /// A tolerance that is not a positive finite number.
    #[error("the tolerance of signal {index} is {variance}: give a positive finite variance")]
    Tolerance {
        /// Which signal, from 0.
        index: usize,
        /// The variance.
        variance: f64,
    },
    /// A covariance without a root in this scalar.
    #[error(
        "the covariance is singular at signal {index}: give it a larger tolerance or leave it out"
    )]
    Singular {
        /// Which signal, from 0.
        index: usize,
    },
    /// A state that is not finite.
    #[error("the {what} is {value}: give a finite number")]
    State {
        /// Position or velocity.
        what: &'static str,
        /// The number.
        value: f64,
    },
    /// An overlap that is not a positive finite part of the movement.
    #[error("the overlap is {overlap} of the movement: give a positive finite number")]
    Overlap {
        /// The overlap, phase.
        overlap: f64,
    },
}

/// Makes a movement pass through a value: conditions `belief`, of `skill`, on a position or a velocity of any
/// DoF at any phase, as closely as `via.variance` says.
///
/// It is [`Belief::condition`] but for one thing: a via-point is asked of the movement `psi^T w` itself, so
/// the skill's residual, which is what a *sensor* sees on top of it, is not added to the variance. With prior
/// mean `m` and variance `v` of that row the mean becomes `m + (value - m) v / (v + variance)` and the
/// variance `v variance / (v + variance)`, less than what was asked for. `scratch` is at least [`via_len`]
/// long.
///
/// # Errors
/// As [`Belief::condition`] and [`Latent::row`]; scratch too short. The belief is as before then.
pub fn via_point<T: Real, B: AsRef<[T]> + AsMut<[T]>>(
    latent: &Latent<'_, T>,
    skill: &Skill<'_, T>,
    belief: &mut Belief<T, B>,
    via: &Observation<T>,
    scratch: &mut [T],
) -> Result<Innovation<T>, ConditionError> {
    let (basis, rank) = (latent.basis().count(), latent.rank());
    let (expected, got) = (via_len(basis, rank), scratch.len());
    let Some(scratch) = scratch.get_mut(..expected) else {
        return Err(ConditionError::Row(RowError::Buffer {
            what: "via-point scratch",
            expected,
            got,
        }));
    };
    let (psi, a) = scratch.split_at_mut(basis);
    let a = &mut a[..skill.rank()];
    skill.row(latent, &via.row, psi, a)?;
    let offset = skill.offset(latent.basis(), &via.row, psi)?;
    belief.condition(a, offset, via.value, via.variance)
}

/// Share of the next skill at a phase, when one hands over to the other from phase `from` on, over `overlap`:
/// 0 before, 1 after, `10 u^3 - 15 u^4 + 6 u^5` between (slope and curvature zero at both ends). The share
/// of the one before is what is left of 1.
///
/// # Errors
/// An overlap that is not positive and finite.
pub fn hand_over<T: Real>(phase: T, from: T, overlap: T) -> Result<T, ComposeError> {
    let u = progress(phase, from, overlap)?.clamp(T::zero(), T::one());
    Ok(T::one() - value_fade(u))
}

/// Where one DoF is, and how it moves, at an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State<T> {
    /// In the DoF's unit as the model has it.
    pub position: T,
    /// The same per second.
    pub velocity: T,
}

/// What brings one DoF of a trajectory exactly to a given position and velocity at a phase, and fades.
///
/// Conditioning alone cannot: its rows have noise, and a skill whose demonstrations all began alike has no
/// direction to move its start in. What is left, the gaps `p` in position and `v` in velocity per unit of
/// phase, is added as `p h(u) + v overlap g(u)` with `u = (phase - start) / overlap`,
///
/// ```text
/// h = 1 - 10 u^3 + 15 u^4 - 6 u^5     h(0) = 1, all else of h, h', h'' at 0 and 1 is 0
/// g = u - 6 u^3 + 8 u^4 - 3 u^5       g'(0) = 1, all else of g, g', g'' at 0 and 1 is 0
/// ```
///
/// the quintics (Hermite) that leave acceleration continuous too. From `start + overlap` on the trajectory is
/// the posterior's own. The variance is the posterior's: the bridge is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bridge<T> {
    start: T,
    overlap: T,
    /// Gap in position, the DoF's unit.
    gap: T,
    /// Gap in velocity, the DoF's unit per unit of phase, times the overlap.
    slope: T,
}

impl<T: Real> Bridge<T> {
    /// From what `trajectory` has for `dof` at phase `start` to `state`, over `overlap` (phase), in a movement
    /// that takes `duration_s`. `scratch` as for [`Trajectory::moments`].
    ///
    /// # Errors
    /// As [`Trajectory::moments`]; a state or overlap that is not finite.
    pub fn new(
        trajectory: &Trajectory<'_, T>,
        dof: usize,
        (start, overlap): (T, T),
        duration_s: T,
        state: State<T>,
        scratch: &mut [T],
    ) -> Result<Self, ComposeError> {
        progress(start, start, overlap)?;
        for (what, value) in [("position", state.position), ("velocity", state.velocity)] {
            if !value.is_finite() {
                let value = value.widen();
                return Err(ComposeError::State { what, value });
            }
        }
        let position = trajectory.moments(&Row::position(dof, start), scratch)?;
        let velocity = trajectory.moments(&Row::velocity(dof, start, duration_s), scratch)?;
        Ok(Self {
            start,
            overlap,
            gap: state.position - position.mean,
            slope: (state.velocity - velocity.mean) * duration_s * overlap,
        })
    }

    /// What to add to the trajectory's position at a phase; nothing before the start.
    pub fn position(&self, phase: T) -> T {
        let u = (phase - self.start) / self.overlap;
        if !(T::zero()..T::one()).contains(&u) {
            return T::zero();
        }
        self.gap * value_fade(u) + self.slope * slope_fade(u)
    }

    /// What to add to the trajectory's velocity (per second) at a phase.
    pub fn velocity(&self, phase: T, duration_s: T) -> T {
        let u = (phase - self.start) / self.overlap;
        if !(T::zero()..T::one()).contains(&u) {
            return T::zero();
        }
        let rest = T::one() - u;
        // h' = -30 u^2 (1 - u)^2,  g' = (1 - u)^2 (1 + 2 u - 15 u^2).
        let value = -T::of(30.0) * u * u;
        let slope = T::one() + T::of(2.0) * u - T::of(15.0) * u * u;
        (self.gap * value + self.slope * slope) * rest * rest / (self.overlap * duration_s)
    }
}

/// `(phase - from) / overlap`.
fn progress<T: Real>(phase: T, from: T, overlap: T) -> Result<T, ComposeError> {
    if !(overlap.is_finite() && overlap > T::zero()) {
        return Err(ComposeError::Overlap {
            overlap: overlap.widen(),
        });
    }
    for phase in [phase, from] {
        if !phase.is_finite() {
            let phase = phase.widen();
            return Err(ComposeError::Row(RowError::Phase { phase }));
        }
    }
    Ok((phase - from) / overlap)
}

/// `h(u) = (1 - u)^3 (1 + 3 u + 6 u^2)`: no difference of large terms near either end.
fn value_fade<T: Real>(u: T) -> T {
    let rest = T::one() - u;
    rest * rest * rest * (T::one() + u * (T::of(3.0) + T::of(6.0) * u))
}

/// `g(u) = u (1 - u)^3 (1 + 3 u)`.
fn slope_fade<T: Real>(u: T) -> T {
    let rest = T::one() - u;
    u * rest * rest * rest * (T::one() + T::of(3.0) * u)
}
