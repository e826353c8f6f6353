//! The subspace of weight space in which the demonstrations of one skill differ from each other.

use nalgebra::{DMatrix, DVector};

/// Diagonal entries of the factor below this share of the first are rounding.
const RANK_TOLERANCE: f64 = 1e-10;
/// Deviations below this share of the weights are the rounding of their mean.
const IDENTICAL: f64 = 1e-13;
/// Largest share of the deviations that the factorisation may fail to give back.
const LOST: f64 = 1e-8;
/// A demonstration with less than this of its own, of 1, is within what the others reach.
const FREE: f64 = 1e-8;
/// Less than this share of a vector outside a span is rounding.
const WITHIN: f64 = 1e-8;

/// Each demonstration's weights less the mean of its skill.
pub(super) struct Deviations {
    /// One row per demonstration: `N x D K`, scaled DoFs.
    pub(super) rows: DMatrix<f64>,
    /// Skill of each row.
    pub(super) skill: Vec<usize>,
    /// Demonstrations of each skill, at least 2.
    pub(super) counts: Vec<usize>,
    /// Mean weights of each skill.
    pub(super) means: Vec<DVector<f64>>,
}

impl Deviations {
    pub(super) fn new(weights: &[DVector<f64>], skill: Vec<usize>, counts: Vec<usize>) -> Self {
        let width = weights.first().map_or(0, DVector::len);
        let mut means = vec![DVector::zeros(width); counts.len()];
        for (row, &q) in weights.iter().zip(&skill) {
            means[q] += row / counts[q] as f64;
        }
        let mut rows = DMatrix::zeros(weights.len(), width);
        for (i, (row, &q)) in weights.iter().zip(&skill).enumerate() {
            rows.row_mut(i).copy_from(&(row - &means[q]).transpose());
        }
        Self {
            rows,
            skill,
            counts,
            means,
        }
    }

    /// `N - Q`: what the pooled covariance is divided by.
    pub(super) fn freedom(&self) -> usize {
        self.rows.nrows() - self.counts.len()
    }
}

/// Why there is no subspace.
pub(super) enum SubspaceError {
    /// The demonstrations of each skill are the same.
    Nothing,
    /// The factorisation failed.
    Factorisation,
}

/// Orthonormal directions that span the deviations, of number `r = min(N - Q, D K)` or fewer.
pub(super) struct Subspace {
    /// `D K x r`.
    pub(super) directions: DMatrix<f64>,
    /// `N x r`: the deviations along them.
    pub(super) coordinates: DMatrix<f64>,
    /// `N x D K`: how far each demonstration lies outside what the others span (see [`Subspace::outside`]).
    pub(super) outside: DMatrix<f64>,
}

impl Subspace {
    /// By QR of the deviations with column pivoting, `X^T = V R`: as accurate as an SVD and cheaper, and nothing
    /// needs the principal directions.
    pub(super) fn of(deviations: &Deviations) -> Result<Self, SubspaceError> {
        let x = &deviations.rows;
        let x_t = x.transpose();
        let factor = x_t.clone().col_piv_qr();
        let r = factor.r();
        let sizes = (0..r.nrows()).map(|i| r[(i, i)].abs());
        let largest = x_t.column_iter().map(|column| column.norm());
        let largest = largest.fold(0.0, f64::max);
        let means = deviations.means.iter().map(DVector::norm);
        let least = IDENTICAL * means.fold(0.0, f64::max);
        if !(largest.is_finite() && largest > least) {
            return Err(SubspaceError::Nothing);
        }
        let above = |size: &f64| *size > RANK_TOLERANCE * largest;
        let rank = sizes.take_while(above).count();
        let rank = rank.min(deviations.freedom());
        let directions = factor.q().columns(0, rank).into_owned();
        let coordinates = x * &directions;
        let lost = (&x_t - &directions * coordinates.transpose()).norm();
        if lost.is_nan() || lost > LOST * x_t.norm() {
            return Err(SubspaceError::Factorisation);
        }
        let outside = Self::outside(deviations, &coordinates, &directions)
            .ok_or(SubspaceError::Factorisation)?;
        Ok(Self {
            directions,
            coordinates,
            outside,
        })
    }

    /// What each demonstration, had it been left out, would have had outside the subspace of the others
    /// (and off the mean of its fellows), in closed form.
    ///
    /// The nearest point to `w_i` that the others can reach leaves `d_i = sum_j c_j x_j`, with `c_i = 1` and `c`
    /// summing to zero over each skill. The shortest such `d_i` has `c = G+ e_i / (G+)_ii`, `G = X X^T`. With
    /// `X = Z V^T`, `Z` of full column rank, that is `d_i = V y_i / |y_i|^2`, `y_i` the column of `Z+ = T^-1 U^T` where
    /// `Z = U T`. Where the weights have fewer dimensions than the demonstrations, others reach everything and `d_i = 0`.
    fn outside(
        deviations: &Deviations,
        coordinates: &DMatrix<f64>,
        directions: &DMatrix<f64>,
    ) -> Option<DMatrix<f64>> {
        let factor = coordinates.clone().qr();
        let u = factor.q();
        let mut solved = u.transpose();
        if !factor.unpack_r().solve_upper_triangular_mut(&mut solved) {
            return None;
        }
        for (i, mut column) in solved.column_iter_mut().enumerate() {
            let count = deviations.counts[deviations.skill[i]] as f64;
            // What of e_i is neither the skill's mean nor in the range of G: then d_i = 0 is reached.
            let free = 1.0 - 1.0 / count - u.row(i).norm_squared();
            let square = column.norm_squared();
            column *= if free > FREE || square <= 0.0 {
                0.0
            } else {
                1.0 / square
            };
        }
        Some(solved.transpose() * directions.transpose())
    }
}

/// `directions` and what the `extra` vectors add to their span, orthonormal.
pub(super) fn extended(directions: &DMatrix<f64>, extra: &[DVector<f64>]) -> DMatrix<f64> {
    let mut all = directions.clone();
    for vector in extra {
        let mut rest = vector.clone();
        // Twice: once leaves rounding of the size of the part removed.
        for _ in 0..2 {
            let along = all.tr_mul(&rest);
            rest -= &all * along;
        }
        let norm = rest.norm();
        if norm > WITHIN * vector.norm() {
            let last = all.ncols();
            all = all.insert_column(last, 0.0);
            all.column_mut(last).copy_from(&(rest / norm));
        }
    }
    all
}
