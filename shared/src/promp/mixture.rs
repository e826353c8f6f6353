//! Recognition: every skill's belief at once, and how probable each skill is.

use super::belief::{Belief, belief_len, check_variance};
use super::error::{ConditionError, ModelError, RowError};
use super::latent::Latent;
use super::row::{Functions, Order, Row, Support};
use super::skill::Skill;
use super::trajectory::Trajectory;
use crate::Real;

/// Numbers that a mixture of `skills` skills stores: row scratch `K + r`, and a belief per skill.
#[must_use]
pub const fn mixture_len(skills: usize, basis: usize, rank: usize) -> usize {
    basis + rank + skills * belief_len(rank)
}

/// One observed number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation<T> {
    /// Which DoF, position or velocity, at which phase.
    pub row: Row<T>,
    /// What was seen, in the row's unit.
    pub value: T,
    /// Variance of the sensor's noise, the row's unit squared; each skill adds its own residual.
    pub variance: T,
}

/// A mixture of skills over one latent space (eq. 17-19), each conditioned on the same observations.
///
/// The evidence for a skill is the *joint* likelihood of all observations, not the product of their
/// marginals: observations of one movement are correlated, and the product is falsely confident.
///
/// `B` is storage of at least [`mixture_len`] numbers: `[T; N]` on the chip, `Vec<T>` on the host.
#[derive(Clone, Debug)]
pub struct Mixture<'a, T, B> {
    latent: Latent<'a, T>,
    skills: &'a [Skill<'a, T>],
    /// The phase and order whose basis functions the scratch holds, and where these are not zero.
    functions_of: Option<(T, Order<T>, Support)>,
    storage: B,
}

impl<'a, T: Real, B: AsRef<[T]> + AsMut<[T]>> Mixture<'a, T, B> {
    /// All skills at their priors. Takes `storage` over, whatever it holds.
    ///
    /// # Errors
    /// No skill, a skill of another shape than the latent space, storage too short.
    pub fn new(
        latent: Latent<'a, T>,
        skills: &'a [Skill<'a, T>],
        storage: B,
    ) -> Result<Self, ModelError> {
        if skills.is_empty() {
            return Err(ModelError::Empty { what: "skill" });
        }
        for skill in skills {
            skill.matches(&latent)?;
        }
        let needed = mixture_len(skills.len(), latent.basis().count(), latent.rank());
        let got = storage.as_ref().len();
        if got < needed {
            return Err(ModelError::Storage {
                what: "the mixture's storage",
                needed,
                got,
            });
        }
        let mut mixture = Self {
            latent,
            skills,
            functions_of: None,
            storage,
        };
        mixture.reset();
        Ok(mixture)
    }

    /// Forgets every observation, for the next movement.
    pub fn reset(&mut self) {
        let rank = self.latent.rank();
        let skills = self.skills;
        let (_, _, blocks) = self.split();
        for (skill, block) in skills.iter().zip(blocks.chunks_exact_mut(belief_len(rank))) {
            Belief::view(skill.rank(), block).start(skill);
        }
    }

    /// Conditions every skill on one observed number. The row is computed once, the basis once for all
    /// observations that follow each other at one phase: give those of one instant together. Cost for
    /// `Q` skills: `K r + Q (K + 3/2 r^2)` multiply-adds and one basis; memory [`mixture_len`].
    ///
    /// # Errors
    /// As [`Belief::condition`] and [`Latent::row`]. If any skill refuses, none changes.
    pub fn observe(&mut self, observation: &Observation<T>) -> Result<(), ConditionError> {
        let Observation {
            row,
            value,
            variance,
        } = *observation;
        // Before the skills' residuals are added, so that none hides a sensor variance that is wrong.
        check_variance(variance)?;
        let (latent, skills, rank) = (self.latent, self.skills, self.latent.rank());
        let known = self.functions_of.take();
        let known = known.filter(|(phase, order, _)| (*phase, *order) == (row.phase, row.order));
        let (psi, a, blocks) = self.split();
        let functions = match known {
            Some((.., support)) => Functions::on(psi, support),
            None => {
                latent.functions(&row, psi)?;
                Functions::of(psi)
            }
        };
        let mut shared = false;
        for (skill, block) in skills.iter().zip(blocks.chunks_exact_mut(belief_len(rank))) {
            let a = &mut a[..skill.rank()];
            if !(shared && skill.shares_rows()) {
                skill.project(&latent, &row, functions, a)?;
                shared = skill.shares_rows();
            }
            let offset = skill.offset_of(latent.basis(), &row, functions)?;
            let noise = variance + skill.residual(&row);
            Belief::view(skill.rank(), block).prepare(a, offset, value, noise)?;
        }
        for (skill, block) in skills.iter().zip(blocks.chunks_exact_mut(belief_len(rank))) {
            Belief::view(skill.rank(), block).commit();
        }
        self.functions_of = Some((row.phase, row.order, functions.support()));
        Ok(())
    }

    /// The latent space.
    #[must_use]
    pub const fn latent(&self) -> &Latent<'a, T> {
        &self.latent
    }

    /// The skills, in the order of every index here.
    #[must_use]
    pub const fn skills(&self) -> &'a [Skill<'a, T>] {
        self.skills
    }

    /// The belief of one skill, `None` for an index that is none.
    #[must_use]
    pub fn belief(&self, skill: usize) -> Option<Belief<T, &[T]>> {
        self.beliefs().nth(skill)
    }

    /// The movement of one skill under its belief, `None` for an index that is none.
    #[must_use]
    pub fn trajectory(&self, skill: usize) -> Option<Trajectory<'_, T>> {
        let posterior = self.belief(skill)?.lent();
        Some(Trajectory::of(
            self.latent,
            *self.skills.get(skill)?,
            posterior,
        ))
    }

    /// Log prior plus joint log-likelihood of one skill, `None` for an index that is none.
    #[must_use]
    pub fn log_joint(&self, skill: usize) -> Option<T> {
        Some(self.skills.get(skill)?.log_prior() + self.belief(skill)?.log_likelihood())
    }

    /// Writes the log posterior probability of every skill to `out` (one each), normalised by
    /// log-sum-exp: none underflows, however certain the answer.
    ///
    /// # Errors
    /// `out` of another length than the skills.
    pub fn log_posterior(&self, out: &mut [T]) -> Result<(), RowError> {
        if out.len() != self.skills.len() {
            return Err(RowError::Buffer {
                what: "log posterior",
                expected: self.skills.len(),
                got: out.len(),
            });
        }
        for (slot, joint) in out.iter_mut().zip(self.log_joints()) {
            *slot = joint;
        }
        let largest = self
            .log_joints()
            .fold(out[0], |best, joint| best.max(joint));
        let sum = out
            .iter()
            .fold(T::zero(), |sum, joint| sum + (*joint - largest).exp());
        for slot in out {
            *slot = *slot - largest - sum.ln();
        }
        Ok(())
    }

    /// The most probable skill; the first of equals.
    #[must_use]
    pub fn most_likely(&self) -> usize {
        let mut best = 0;
        let mut largest = None;
        for (index, joint) in self.log_joints().enumerate() {
            if largest.is_none_or(|value| joint > value) {
                (best, largest) = (index, Some(joint));
            }
        }
        best
    }

    fn log_joints(&self) -> impl Iterator<Item = T> {
        let each = self.skills.iter().zip(self.beliefs());
        each.map(|(skill, belief)| skill.log_prior() + belief.log_likelihood())
    }

    fn beliefs(&self) -> impl Iterator<Item = Belief<T, &[T]>> {
        let (basis, rank) = (self.latent.basis().count(), self.latent.rank());
        let blocks = self.storage.as_ref()[basis + rank..].chunks_exact(belief_len(rank));
        let each = self.skills.iter().zip(blocks);
        each.map(|(skill, block)| Belief::view(skill.rank(), block))
    }

    /// Scratch for the basis, scratch for the row, and the beliefs, no more than there are skills.
    fn split(&mut self) -> (&mut [T], &mut [T], &mut [T]) {
        let (basis, rank) = (self.latent.basis().count(), self.latent.rank());
        let needed = mixture_len(self.skills.len(), basis, rank);
        let (psi, rest) = self.storage.as_mut()[..needed].split_at_mut(basis);
        let (a, beliefs) = rest.split_at_mut(rank);
        (psi, a, beliefs)
    }
}
