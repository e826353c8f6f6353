//! Rows shared between hypotheses at one phase.

use super::super::belief::Belief;
use super::super::error::ConditionError;
use super::super::hypothesis::{Hypothesis, Observed};
use super::super::latent::{Latent, Skill};
use super::super::row::{Quantity, Row};
use crate::Real;

/// The row computed last, for as long as hypotheses ask for the same.
pub(super) struct RowCache<'s, T> {
    pub(super) psi: &'s mut [T],
    pub(super) a: &'s mut [T],
    /// Which row, and whether it is a velocity outside the movement.
    pub(super) of: Option<(Row<T>, bool)>,
}

impl<T: Real> RowCache<'_, T> {
    /// Prepares the belief in `block` for what was seen, at the hypothesis' phase.
    pub(super) fn prepare(
        &mut self,
        latent: &Latent<'_, T>,
        skill: &Skill<'_, T>,
        hypothesis: &Hypothesis<T>,
        seen: &Observed<T>,
        block: &mut [T],
    ) -> Result<(), ConditionError> {
        let row = hypothesis.row(seen.dof, seen.quantity, seen.time_s);
        let still = seen.quantity == Quantity::Velocity && !hypothesis.moving(seen.time_s);
        if self.of != Some((row, still)) {
            self.of = None;
            latent.row(&row, self.psi, self.a)?;
            if still {
                self.psi.fill(T::zero());
                self.a.fill(T::zero());
            }
            self.of = Some((row, still));
        }
        let offset = skill.offset(latent.basis(), &row, self.psi)?;
        let noise = seen.variance + skill.residual(&row);
        Belief::view(latent.rank(), block).prepare(self.a, offset, seen.value, noise)?;
        Ok(())
    }
}
