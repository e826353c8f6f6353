//! What the leave-one-out likelihood chooses: shares of the shrinkage, degrees of freedom.

use std::collections::BTreeMap;

use nalgebra::{Cholesky, DMatrix, DVector};

use super::shrinkage::{Scatter, Shares, size};
use super::{Predictive, Shrinkage};

/// Shares that are tried, for `a` and for `b`.
const SHARES: [f64; 9] = [0.0, 0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 0.9, 1.0];
/// Where the search starts in them: `a = 0.3`, `b = 0.1`.
const START: [usize; 2] = [4, 2];
/// Degrees of freedom that are tried.
const FREEDOMS: [Option<f64>; 7] = [
    None,
    Some(30.0),
    Some(15.0),
    Some(9.0),
    Some(6.0),
    Some(4.0),
    Some(3.0),
];
/// Least noise variance the likelihood is taken with, in units of each DoF's variance: data that the basis fits
/// exactly must not make it infinite.
const NOISE_FLOOR: f64 = 1e-8;
/// Less than this of one left of a variance is computed again instead of by difference.
const CANCELLED: f64 = 1e-4;
/// Demonstrations whose sizes differ by less than this share are taken as one size.
const SAME_SIZE: f64 = 1e-9;

/// What is chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Choice {
    pub(super) shares: Shares,
    /// Of the predictive Student-t, the same for every skill; `None` is a Gaussian.
    pub(super) freedom: Option<f64>,
}

/// How a demonstration is looked at, scaled DoFs.
pub(super) struct Observed {
    /// What its weights draw at a few phases of each DoF: `M D x D K`.
    pub(super) rows: DMatrix<f64>,
    /// Noise variance of each row.
    pub(super) noise: DVector<f64>,
    /// Covariance of where it is placed, `M D x M D`.
    pub(super) offset: DMatrix<f64>,
}

/// The choice of greatest likelihood of each demonstration under its own skill learnt from all the others, summed
/// over the demonstrations.
///
/// Leaving one out moves its skill's mean and takes its share from every scatter; the subspace stays that of all
/// demonstrations, and the part of the one left out that the others do not span is in the noise. Shares are searched
/// from neighbour to neighbour on a grid. `None` when no covariance is positive definite.
pub(super) fn choose(
    scatter: &Scatter<'_>,
    observed: &Observed,
    shrinkage: Shrinkage,
    predictive: Predictive,
) -> Option<Choice> {
    let freedoms: &[Option<f64>] = match predictive {
        Predictive::PlugIn => &[None],
        Predictive::Fixed { freedom } => &[freedom],
        Predictive::LeaveOneOut => &FREEDOMS,
    };
    let fixed = match shrinkage {
        Shrinkage::Fixed { pooled, diagonal } => Some(Shares { pooled, diagonal }),
        Shrinkage::LeaveOneOut => None,
    };
    // Both decided: nothing to look at.
    if let (Some(shares), [freedom]) = (fixed, freedoms) {
        let freedom = *freedom;
        return Some(Choice { shares, freedom });
    }
    let left_out = LeftOut::new(scatter, observed, predictive != Predictive::PlugIn);
    let likelihood = |shares: Shares| left_out.best(shares, freedoms);
    match fixed {
        Some(shares) => likelihood(shares).map(|(freedom, _)| Choice { shares, freedom }),
        None => search(likelihood),
    }
}

/// From neighbour to neighbour on the grid of shares, uphill.
fn search(likelihood: impl Fn(Shares) -> Option<(Option<f64>, f64)>) -> Option<Choice> {
    let mut seen = BTreeMap::new();
    let mut value = |at: [usize; 2]| {
        let (pooled, diagonal) = (SHARES[at[0]], SHARES[at[1]]);
        let of = || likelihood(Shares { pooled, diagonal });
        *seen.entry(at).or_insert_with(of)
    };
    let log = |found: Option<(Option<f64>, f64)>| found.map_or(f64::NEG_INFINITY, |(_, log)| log);
    let mut best = (START, value(START));
    loop {
        let mut next = best;
        for at in neighbours(best.0) {
            let found = value(at);
            if log(found) > log(next.1) {
                next = (at, found);
            }
        }
        if next.0 == best.0 {
            break;
        }
        best = next;
    }
    let (freedom, _) = best.1?;
    let (pooled, diagonal) = (SHARES[best.0[0]], SHARES[best.0[1]]);
    let shares = Shares { pooled, diagonal };
    Some(Choice { shares, freedom })
}

/// Places on the grid beside one, itself among them.
fn neighbours([pooled, diagonal]: [usize; 2]) -> impl Iterator<Item = [usize; 2]> {
    let beside = |index: usize| index.saturating_sub(1)..=(index + 1).min(SHARES.len() - 1);
    let all = beside(pooled).flat_map(move |a| beside(diagonal).map(move |b| [a, b]));
    all.filter(|&[a, b]| SHARES[a] + SHARES[b] <= 1.0)
}

/// The scatters as the rows of [`Observed`] see them, `M D x M D`.
struct LeftOut<'a> {
    skills: Vec<Members>,
    pooled: DMatrix<f64>,
    pooled_trace: f64,
    diagonal: DMatrix<f64>,
    /// Noise and placement.
    always: DMatrix<f64>,
    scatter: &'a Scatter<'a>,
    /// Whether the mean's own uncertainty is counted.
    widened: bool,
}

/// Demonstrations of one skill.
struct Members {
    own: DMatrix<f64>,
    own_trace: f64,
    /// A column each: the deviation from the mean, as seen.
    deviations: DMatrix<f64>,
    /// What the trace of a scatter loses without each.
    lost: Vec<f64>,
}

impl<'a> LeftOut<'a> {
    fn new(scatter: &'a Scatter<'a>, observed: &Observed, widened: bool) -> Self {
        let v = &scatter.subspace.directions;
        let rows = &observed.rows * v;
        let transposed = rows.transpose();
        let seen = |matrix: &DMatrix<f64>| &rows * matrix * &transposed;
        let freedom = scatter.deviations.freedom() as f64;
        let mut spread = &rows * v.transpose();
        for (mut column, square) in spread.column_iter_mut().zip(scatter.squares.iter()) {
            column *= libm::sqrt(square / freedom);
        }
        let of_skill = |skill: usize| {
            let all = scatter.deviations.skill.iter().enumerate();
            let members: Vec<usize> = all.filter(|(_, q)| **q == skill).map(|(i, _)| i).collect();
            let coordinates = scatter.subspace.coordinates.select_rows(&members);
            let grown = grown(members.len());
            let lost = coordinates.row_iter().map(|z| grown * z.norm_squared());
            Members {
                own: seen(&scatter.own[skill]),
                own_trace: scatter.own[skill].trace(),
                lost: lost.collect(),
                deviations: &rows * coordinates.transpose(),
            }
        };
        let floored = observed.noise.map(|variance| variance.max(NOISE_FLOOR));
        Self {
            skills: (0..scatter.own.len()).map(of_skill).collect(),
            pooled: seen(&scatter.pooled),
            pooled_trace: scatter.pooled.trace(),
            diagonal: &spread * spread.transpose(),
            always: &observed.offset + DMatrix::from_diagonal(&floored),
            scatter,
            widened,
        }
    }

    /// The degrees of freedom of greatest likelihood, and that.
    fn best(&self, shares: Shares, freedoms: &[Option<f64>]) -> Option<(Option<f64>, f64)> {
        let dimensions = self.always.nrows();
        let seen: Option<Vec<Vec<Density>>> = self
            .skills
            .iter()
            .map(|members| self.densities(members, shares))
            .collect();
        let seen = seen?.concat();
        let of = |freedom: &Option<f64>| {
            let logs = seen.iter().map(|one| one.log(dimensions, *freedom));
            (*freedom, logs.sum::<f64>())
        };
        let all = freedoms.iter().map(of).filter(|(_, log)| log.is_finite());
        all.reduce(|best, next| if next.1 > best.1 { next } else { best })
    }

    /// What each demonstration of a skill is to the skill learnt without it.
    ///
    /// Without `x_i` the mean moves by `-x_i / (n - 1)`: the distance from it is `g x_i`, `g = n / (n - 1)`, and a
    /// scatter about it is less by `g x_i x_i^T`. The covariance is therefore that of all the demonstrations, in which
    /// the pooled covariance is scaled to the skill's size without this one, less a multiple of `x_i x_i^T`: factored
    /// at three sizes for the whole skill, in between interpolated, and downdated in closed form.
    fn densities(&self, members: &Members, shares: Shares) -> Option<Vec<Density>> {
        let least = members.lost.iter().copied().fold(f64::INFINITY, f64::min);
        let most = members.lost.iter().copied().fold(0.0, f64::max);
        let nodes = if most - least > SAME_SIZE * most {
            vec![least, 0.5 * (least + most), most]
        } else {
            vec![most]
        };
        let at_nodes = nodes.iter().map(|&lost| {
            let mixed = self.mixed(members, shares, lost).covariance;
            let factor = Cholesky::new(mixed)?;
            let mut solved = members.deviations.clone();
            let lower = factor.l_dirty();
            lower.solve_lower_triangular_mut(&mut solved).then(|| {
                let squares = solved.column_iter().map(|column| column.norm_squared());
                (log_determinant(lower), squares.collect::<Vec<f64>>())
            })
        });
        let at_nodes = at_nodes.collect::<Option<Vec<_>>>()?;
        let grown = grown(members.lost.len());
        let one = |(index, &lost): (usize, &f64)| {
            let along = lagrange(&nodes, lost);
            let determinants = at_nodes.iter().zip(&along);
            let log_determinant: f64 = determinants.map(|((log, _), share)| log * share).sum();
            let squares = at_nodes.iter().zip(&along);
            let log_square: f64 = squares
                .map(|((_, squares), share)| {
                    libm::log(squares[index].max(f64::MIN_POSITIVE)) * share
                })
                .sum();
            let square = libm::exp(log_square);
            let removed = self.mixed(members, shares, lost).removed;
            let kept = 1.0 - removed * square;
            if kept > CANCELLED {
                return Some(Density {
                    mahalanobis: grown * grown * square / kept,
                    log_determinant: log_determinant + libm::log(kept),
                });
            }
            self.exact(members, shares, index)
        };
        members.lost.iter().enumerate().map(one).collect()
    }

    /// The same of one demonstration, factored for it alone.
    fn exact(&self, members: &Members, shares: Shares, index: usize) -> Option<Density> {
        let Mixed {
            mut covariance,
            removed,
        } = self.mixed(members, shares, members.lost[index]);
        let x = members.deviations.column(index);
        covariance.ger(-removed, &x, &x, 1.0);
        let factor = Cholesky::new(covariance)?;
        let lower = factor.l_dirty();
        let solved = lower.solve_lower_triangular(&(x * grown(members.lost.len())))?;
        Some(Density {
            mahalanobis: solved.norm_squared(),
            log_determinant: log_determinant(lower),
        })
    }

    /// The covariance of a skill that has lost as much of its trace, before the loss of the demonstration's direction.
    fn mixed(&self, members: &Members, shares: Shares, lost: f64) -> Mixed {
        let n = members.lost.len();
        let grown = grown(n);
        let freedom = self.scatter.deviations.freedom() as f64;
        let own_freedom = n.saturating_sub(2).max(1) as f64;
        let own_size = if n > 2 {
            (members.own_trace - lost) / own_freedom
        } else {
            0.0
        };
        let pooled_size = (self.pooled_trace - lost) / (freedom - 1.0);
        let own = (1.0 - shares.pooled - shares.diagonal).max(0.0) / own_freedom;
        let pooled = shares.pooled * size(own_size, pooled_size) / (freedom - 1.0);
        // Less of every square by the same share.
        let diagonal = shares.diagonal * pooled_size / (self.pooled_trace / freedom);
        let wide = if self.widened {
            1.0 + 1.0 / (n - 1) as f64
        } else {
            1.0
        };
        let mut covariance = self.always.clone();
        let parts = [
            (&members.own, own),
            (&self.pooled, pooled),
            (&self.diagonal, diagonal),
        ];
        for (matrix, share) in parts {
            for (sum, value) in covariance.iter_mut().zip(matrix.iter()) {
                *sum += wide * share * value;
            }
        }
        Mixed {
            covariance,
            removed: wide * grown * (own + pooled),
        }
    }
}

struct Mixed {
    covariance: DMatrix<f64>,
    /// Multiple of `x_i x_i^T` that is still to go.
    removed: f64,
}

/// `n / (n - 1)`.
fn grown(n: usize) -> f64 {
    n as f64 / (n - 1) as f64
}

/// Of `L L^T`.
fn log_determinant(lower: &DMatrix<f64>) -> f64 {
    let diagonal = (0..lower.nrows()).map(|i| libm::log(lower[(i, i)]));
    2.0 * diagonal.sum::<f64>()
}

/// Shares of the nodes in the polynomial through them, at `x`.
fn lagrange(nodes: &[f64], x: f64) -> Vec<f64> {
    let share = |node: &f64| {
        let others = nodes.iter().filter(|other| *other != node);
        others.map(|other| (x - other) / (node - other)).product()
    };
    nodes.iter().map(share).collect()
}

/// What a density is computed from.
#[derive(Clone, Copy)]
struct Density {
    /// Squared distance from the mean in the covariance's metric.
    mahalanobis: f64,
    /// Of the covariance.
    log_determinant: f64,
}

impl Density {
    /// Log density of the Gaussian, or of the Student-t of the same covariance (its scale matrix is the covariance
    /// times `(nu - 2) / nu`).
    fn log(&self, dimensions: usize, freedom: Option<f64>) -> f64 {
        let d = dimensions as f64;
        let Some(nu) = freedom else {
            let constant = d * libm::log(core::f64::consts::TAU);
            return -0.5 * (self.mahalanobis + self.log_determinant + constant);
        };
        let pi = core::f64::consts::PI;
        libm::lgamma(0.5 * (nu + d))
            - libm::lgamma(0.5 * nu)
            - 0.5 * (d * libm::log(pi * (nu - 2.0)) + self.log_determinant)
            - 0.5 * (nu + d) * libm::log1p(self.mahalanobis / (nu - 2.0))
    }
}
