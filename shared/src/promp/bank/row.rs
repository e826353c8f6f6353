//! Rows shared between hypotheses at one phase.

use super::super::belief::Belief;
use super::super::error::ConditionError;
use super::super::hypothesis::{Hypothesis, Observed};
use super::super::latent::Latent;
use super::super::row::{Functions, Quantity, Row, Support};
use super::super::skill::Skill;
use crate::Real;

/// The row computed last, for as long as hypotheses ask for the same.
pub(super) struct RowCache<'s, T> {
    pub(super) psi: &'s mut [T],
    pub(super) a: &'s mut [T],
    /// Which row `psi` is of.
    pub(super) of: Option<Cached<T>>,
}

/// What is known of the row.
#[derive(Clone, Copy)]
pub(super) struct Cached<T> {
    row: Row<T>,
    /// A velocity outside the movement.
    still: bool,
    support: Support,
    /// `a` is the latent space's, not one skill's own.
    shared: bool,
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
        let known = self.of.take();
        let known = known.filter(|known| known.row == row && known.still == still);
        let functions = match known {
            Some(known) => Functions::on(self.psi, known.support),
            None => {
                latent.functions(&row, self.psi)?;
                if still {
                    self.psi.fill(T::zero());
                }
                Functions::of(self.psi)
            }
        };
        let a = &mut self.a[..skill.rank()];
        let shared = skill.shares_rows();
        if !(shared && known.is_some_and(|known| known.shared)) {
            skill.project(latent, &row, functions, a)?;
        }
        let support = functions.support();
        let offset = skill.offset_of(latent.basis(), &row, functions)?;
        let noise = seen.variance + skill.residual(&row);
        Belief::view(skill.rank(), block).prepare(a, offset, seen.value, noise)?;
        self.of = Some(Cached {
            row,
            still,
            support,
            shared,
        });
        Ok(())
    }
}
