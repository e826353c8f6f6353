//! Each skill's covariance, drawn towards what the skills share ([`super::Shrinkage`]).

use nalgebra::{DMatrix, DVector};

use super::subspace::{Deviations, Subspace};

/// `a` and `b`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Shares {
    pub(super) pooled: f64,
    pub(super) diagonal: f64,
}

/// Skill's, pooled and diagonal covariance, in some coordinates.
pub(super) struct Targets {
    pub(super) own: DMatrix<f64>,
    pub(super) pooled: DMatrix<f64>,
    pub(super) diagonal: DMatrix<f64>,
}

impl Targets {
    pub(super) fn mix(&self, shares: Shares) -> DMatrix<f64> {
        let Shares { pooled, diagonal } = shares;
        let own = (1.0 - pooled - diagonal).max(0.0);
        &self.own * own + &self.pooled * pooled + &self.diagonal * diagonal
    }
}

/// Ratio of a skill's total variance to the pooled one; one where the skill has none of its own to go by.
pub(super) fn size(own: f64, pooled: f64) -> f64 {
    if own > 0.0 && pooled > 0.0 {
        own / pooled
    } else {
        1.0
    }
}

/// Scatter matrices (sums of outer products) of the deviations in the subspace.
pub(super) struct Scatter<'a> {
    pub(super) deviations: &'a Deviations,
    pub(super) subspace: &'a Subspace,
    /// `r x r`, per skill.
    pub(super) own: Vec<DMatrix<f64>>,
    /// `r x r`.
    pub(super) pooled: DMatrix<f64>,
    /// `D K`: sums of squares over weights.
    pub(super) squares: DVector<f64>,
}

impl<'a> Scatter<'a> {
    pub(super) fn new(deviations: &'a Deviations, subspace: &'a Subspace) -> Self {
        let z = &subspace.coordinates;
        let own: Vec<_> = (0..deviations.counts.len())
            .map(|skill| {
                let members = (0..z.nrows()).filter(|&i| deviations.skill[i] == skill);
                let rows: Vec<_> = members.collect();
                let of_skill = z.select_rows(&rows);
                of_skill.tr_mul(&of_skill)
            })
            .collect();
        let pooled = z.tr_mul(z);
        let columns = deviations.rows.column_iter();
        let squares = DVector::from_iterator(
            deviations.rows.ncols(),
            columns.map(|column| column.norm_squared()),
        );
        Self {
            deviations,
            subspace,
            own,
            pooled,
            squares,
        }
    }

    /// The shrunk covariance of a skill, `r x r`.
    pub(super) fn covariance(&self, skill: usize, shares: Shares) -> DMatrix<f64> {
        let v = &self.subspace.directions;
        let freedom = self.deviations.freedom() as f64;
        let own = &self.own[skill] / (self.deviations.counts[skill] - 1) as f64;
        let pooled = &self.pooled / freedom;
        let mut weighted = v.clone();
        for (mut row, square) in weighted.row_iter_mut().zip(self.squares.iter()) {
            row *= *square / freedom;
        }
        let pooled = &pooled * size(own.trace(), pooled.trace());
        let targets = Targets {
            own,
            pooled,
            diagonal: v.tr_mul(&weighted),
        };
        targets.mix(shares)
    }
}
