//! Each skill's covariance, drawn towards what the skills share ([`super::Shrinkage`]).

use nalgebra::{Cholesky, DMatrix, DVector};

use super::subspace::{Deviations, Subspace};

/// Shares that the leave-one-out likelihood is tried at, for `a` and for `b`.
const SHARES: [f64; 9] = [0.0, 0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 0.9, 1.0];
/// Least noise variance the likelihood is taken with, in units of each DoF's variance: data that the basis fits
/// exactly must not make it infinite.
const NOISE_FLOOR: f64 = 1e-8;

/// `a` and `b`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Shares {
    pub(super) pooled: f64,
    pub(super) diagonal: f64,
}

/// Skill's, pooled and diagonal covariance, in some coordinates.
struct Targets {
    own: DMatrix<f64>,
    pooled: DMatrix<f64>,
    diagonal: DMatrix<f64>,
}

impl Targets {
    fn mix(&self, shares: Shares) -> DMatrix<f64> {
        let Shares { pooled, diagonal } = shares;
        let own = (1.0 - pooled - diagonal).max(0.0);
        &self.own * own + &self.pooled * pooled + &self.diagonal * diagonal
    }
}

/// Ratio of a skill's total variance to the pooled one; one where the skill has none of its own to go by.
fn size(own: f64, pooled: f64) -> f64 {
    if own > 0.0 && pooled > 0.0 {
        own / pooled
    } else {
        1.0
    }
}

/// Scatter matrices (sums of outer products) of the deviations in the subspace.
pub(super) struct Scatter<'a> {
    deviations: &'a Deviations,
    subspace: &'a Subspace,
    /// `r x r`, per skill.
    own: Vec<DMatrix<f64>>,
    /// `r x r`.
    pooled: DMatrix<f64>,
    /// `D K`: sums of squares over weights.
    squares: DVector<f64>,
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

    /// The shares of greatest likelihood of each demonstration under its own skill learnt from all the others,
    /// summed over the demonstrations; the first of equals.
    ///
    /// A demonstration is what its weights draw at a few phases, the rows of `observe` (`M D x D K`), seen with the
    /// `noise` variance of each row and the covariance `offset` (`M D x M D`) of where it is placed. Leaving one out
    /// moves its skill's mean and takes its share from every scatter; the subspace stays that of all
    /// demonstrations, and the part of the one left out that the others do not span is in `noise`.
    ///
    /// Cost: `N` times the number of pairs of shares times `(M D)^3 / 3` multiply-adds. `None` when no
    /// covariance is positive definite.
    pub(super) fn choose(
        &self,
        observe: &DMatrix<f64>,
        noise: &DVector<f64>,
        offset: &DMatrix<f64>,
    ) -> Option<Shares> {
        let pairs = SHARES.iter().flat_map(|&pooled| {
            let fitting = SHARES.iter().filter(move |&&b| pooled + b <= 1.0);
            fitting.map(move |&diagonal| Shares { pooled, diagonal })
        });
        let mut tried: Vec<(Shares, f64)> = pairs.map(|shares| (shares, 0.0)).collect();
        let seen = Seen::new(self, observe);
        let floored = noise.map(|variance| variance.max(NOISE_FLOOR));
        let always = offset + DMatrix::from_diagonal(&floored);
        for left_out in 0..self.deviations.rows.nrows() {
            let (targets, error) = seen.without(self, left_out);
            for (shares, sum) in &mut tried {
                let covariance = targets.mix(*shares) + &always;
                *sum += log_density(covariance, &error).unwrap_or(f64::NEG_INFINITY);
            }
        }
        let possible = tried.into_iter().filter(|(_, sum)| sum.is_finite());
        let best = possible.reduce(|best, next| if next.1 > best.1 { next } else { best });
        best.map(|(shares, _)| shares)
    }
}

/// The scatters as the rows of `observe` see them, `M D x M D`.
struct Seen {
    /// `M D x r`.
    rows: DMatrix<f64>,
    /// `M D x D K`: the same, back in weights.
    spread: DMatrix<f64>,
    own: Vec<DMatrix<f64>>,
    pooled: DMatrix<f64>,
}

impl Seen {
    fn new(scatter: &Scatter<'_>, observe: &DMatrix<f64>) -> Self {
        let v = &scatter.subspace.directions;
        let rows = observe * v;
        let seen = |matrix: &DMatrix<f64>| &rows * matrix * rows.transpose();
        Self {
            own: scatter.own.iter().map(seen).collect(),
            pooled: seen(&scatter.pooled),
            spread: &rows * v.transpose(),
            rows,
        }
    }

    /// The three covariances learnt without one demonstration, and that one's distance from its skill's mean.
    fn without(&self, scatter: &Scatter<'_>, left_out: usize) -> (Targets, DVector<f64>) {
        let skill = scatter.deviations.skill[left_out];
        let n = scatter.deviations.counts[skill];
        // The mean without x_i moves by -x_i / (n - 1): the distance from it is n / (n - 1) x_i, and the scatter about
        // it is less by n / (n - 1) x_i x_i^T.
        let grown = n as f64 / (n - 1) as f64;
        let z = scatter.subspace.coordinates.row(left_out).transpose();
        let x = &self.rows * &z;
        let outer = &x * x.transpose() * grown;
        let lost = z.norm_squared() * grown;
        let own_freedom = n.saturating_sub(2).max(1) as f64;
        let freedom = (scatter.deviations.freedom() - 1) as f64;
        let own_size = if n > 2 {
            (scatter.own[skill].trace() - lost) / own_freedom
        } else {
            0.0
        };
        let pooled_size = (scatter.pooled.trace() - lost) / freedom;
        let mut spread = self.spread.clone();
        let deviation = scatter.deviations.rows.row(left_out);
        for (k, mut column) in spread.column_iter_mut().enumerate() {
            let square = scatter.squares[k] - grown * deviation[k] * deviation[k];
            column *= square.max(0.0) / freedom;
        }
        let targets = Targets {
            own: (&self.own[skill] - &outer) / own_freedom,
            pooled: (&self.pooled - &outer) * (size(own_size, pooled_size) / freedom),
            diagonal: spread * self.spread.transpose(),
        };
        (targets, x * grown)
    }
}

/// Log density of a centred Gaussian; `None` when the covariance is not positive definite.
fn log_density(covariance: DMatrix<f64>, error: &DVector<f64>) -> Option<f64> {
    let factor = Cholesky::new(covariance)?;
    let l = factor.l_dirty();
    let solved = l.solve_lower_triangular(error)?;
    let log_root: f64 = l.diagonal().iter().map(|value| libm::log(*value)).sum();
    let constant = 0.5 * error.len() as f64 * libm::log(core::f64::consts::TAU);
    Some(-0.5 * solved.norm_squared() - log_root - constant)
}
