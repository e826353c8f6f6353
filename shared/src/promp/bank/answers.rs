//! What the hypotheses of a bank say together.

use super::super::error::RowError;
use super::super::hypothesis::Hypothesis;
use super::super::row::Quantity;
use super::super::trajectory::Moments;
use super::{Bank, BankError, check_time};
use crate::Real;

impl<T, S, B> Bank<'_, T, S, B>
where
    T: Real,
    S: AsRef<[Hypothesis<T>]> + AsMut<[Hypothesis<T>]>,
    B: AsRef<[T]> + AsMut<[T]>,
{
    /// The most probable hypothesis; the first of equals, `None` in an empty bank.
    #[must_use]
    pub fn most_likely(&self) -> Option<usize> {
        let mut best: Option<(usize, T)> = None;
        for (index, joint) in self.log_joints().enumerate() {
            if best.is_none_or(|(_, largest)| joint > largest) {
                best = Some((index, joint));
            }
        }
        best.map(|(index, _)| index)
    }

    /// Writes the log posterior probability of every skill to `out` (one each), durations and onsets summed over,
    /// by log-sum-exp. Negative infinity for a skill of which no hypothesis is left.
    ///
    /// # Errors
    /// `out` of another length than the skills; an empty bank.
    pub fn log_posterior(&self, out: &mut [T]) -> Result<(), BankError> {
        if out.len() != self.skills.len() {
            return Err(BankError::from(RowError::Buffer {
                what: "log posterior",
                expected: self.skills.len(),
                got: out.len(),
            }));
        }
        let largest = self.largest(None).ok_or(BankError::NoHypothesis)?;
        for (skill, slot) in out.iter_mut().enumerate() {
            let of_skill = || {
                let joints = self.hypotheses().iter().zip(self.log_joints());
                let joints = joints.filter(move |(h, _)| h.skill == skill);
                joints.map(move |(_, joint)| joint - largest)
            };
            *slot = log_sum_exp(of_skill).unwrap_or_else(|| T::of(f64::NEG_INFINITY));
        }
        let largest = out.iter().fold(out[0], |best, joint| best.max(*joint));
        let sum = (out.iter()).fold(T::zero(), |sum, joint| sum + (*joint - largest).exp());
        for slot in out {
            *slot = *slot - largest - sum.ln();
        }
        Ok(())
    }

    /// Posterior probability of one hypothesis, `None` for an index that is none.
    #[must_use]
    pub fn probability(&self, hypothesis: usize) -> Option<T> {
        let (joint, largest) = (self.log_joint(hypothesis)?, self.largest(None)?);
        // Relative to the largest before it is summed: far from zero a log-evidence is rounded.
        let total = self
            .log_joints()
            .fold(T::zero(), |sum, other| sum + (other - largest).exp());
        Some((joint - largest).exp() / total)
    }

    /// Posterior mean and variance of the duration, seconds; `None` in an empty bank. Of one skill alone if one is
    /// named (`None` too if no hypothesis of it is left).
    #[must_use]
    pub fn duration(&self, skill: Option<usize>) -> Option<Moments<T>> {
        self.spread(skill, |hypothesis| hypothesis.duration_s)
    }

    /// As [`Bank::duration`], of the onset.
    #[must_use]
    pub fn onset(&self, skill: Option<usize>) -> Option<Moments<T>> {
        self.spread(skill, |hypothesis| hypothesis.onset_s)
    }

    /// As [`Bank::duration`], of the phase at a time.
    #[must_use]
    pub fn phase(&self, skill: Option<usize>, time_s: T) -> Option<Moments<T>> {
        self.spread(skill, |hypothesis| hypothesis.phase(time_s))
    }

    /// Posterior probability that the movement is over at a time; `None` in an empty bank.
    #[must_use]
    pub fn over(&self, time_s: T) -> Option<T> {
        let over = |hypothesis: &Hypothesis<T>| {
            if hypothesis.onset_s + hypothesis.duration_s <= time_s {
                T::one()
            } else {
                T::zero()
            }
        };
        self.spread(None, over).map(|moments| moments.mean)
    }

    /// Mean and variance of what the hypotheses together expect of a DoF at a time: the variance within each and
    /// between them. Of one skill alone if one is named. Cost: `K r + r^2` multiply-adds and a
    /// basis for each hypothesis; `scratch` as for [`Trajectory::moments`].
    ///
    /// # Errors
    /// No hypothesis (of that skill), a time that is not finite, and as [`Trajectory::moments`].
    pub fn moments(
        &self,
        skill: Option<usize>,
        (dof, quantity): (usize, Quantity),
        time_s: T,
        scratch: &mut [T],
    ) -> Result<Moments<T>, BankError> {
        check_time(time_s)?;
        let (mut mean, mut square, mut total) = (T::zero(), T::zero(), T::zero());
        let largest = self.largest(skill).ok_or(BankError::NoHypothesis)?;
        let mut first = None;
        for (index, hypothesis) in self.hypotheses().iter().enumerate() {
            let chosen = skill.is_none_or(|skill| skill == hypothesis.skill);
            let (Some(joint), Some(trajectory), true) =
                (self.log_joint(index), self.trajectory(index), chosen)
            else {
                continue;
            };
            let weight = (joint - largest).exp();
            let mut one = trajectory.moments(&hypothesis.row(dof, quantity, time_s), scratch)?;
            if quantity == Quantity::Velocity && !hypothesis.moving(time_s) {
                (one.mean, one.variance) = (T::zero(), T::zero());
            }
            // About the first mean, or the squares of large coordinates would cancel.
            let about = *first.get_or_insert(one.mean);
            let offset = one.mean - about;
            mean += weight * offset;
            square += weight * (one.variance + offset * offset);
            total += weight;
        }
        let shift = mean / total;
        Ok(Moments {
            mean: first.unwrap_or_else(T::zero) + shift,
            variance: (square / total - shift * shift).max(T::zero()),
        })
    }

    /// Posterior mean and variance of what `of` says about a hypothesis.
    fn spread(&self, skill: Option<usize>, of: impl Fn(&Hypothesis<T>) -> T) -> Option<Moments<T>> {
        let largest = self.largest(skill)?;
        let weighted = || {
            let joints = self.hypotheses().iter().zip(self.log_joints());
            let joints = joints.filter(|(h, _)| skill.is_none_or(|skill| skill == h.skill));
            joints.map(|(hypothesis, joint)| ((joint - largest).exp(), of(hypothesis)))
        };
        let total = weighted().fold(T::zero(), |sum, (weight, _)| sum + weight);
        let mean = weighted().fold(T::zero(), |sum, (weight, x)| sum + weight * x) / total;
        let square = |sum, (weight, x): (T, T)| sum + weight * (x - mean) * (x - mean);
        let variance = weighted().fold(T::zero(), square) / total;
        Some(Moments { mean, variance })
    }
}

/// `ln sum exp`, `None` of nothing. Exact for one number.
fn log_sum_exp<T: Real, I: Iterator<Item = T>>(numbers: impl Fn() -> I) -> Option<T> {
    let largest = numbers().reduce(T::max)?;
    let sum = numbers().fold(T::zero(), |sum, number| sum + (number - largest).exp());
    Some(largest + sum.ln())
}
