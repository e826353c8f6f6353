//! The subspace of weight space in which the demonstrations of one skill differ from each other.

use nalgebra::{DMatrix, DVector, SVD};

/// Singular values below this share of the largest are rounding.
const RANK_TOLERANCE: f64 = 1e-10;
/// Deviations below this share of the weights are the rounding of their mean.
const IDENTICAL: f64 = 1e-13;
/// Largest share of the deviations that the factorisation may fail to give back.
const SVD_TOLERANCE: f64 = 1e-8;
/// Far more than the QR iteration needs.
const SVD_ITERATIONS: usize = 100_000;

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
    /// By thin SVD of the deviations, `X = U S V^T`.
    pub(super) fn of(deviations: &Deviations) -> Result<Self, SubspaceError> {
        let x = &deviations.rows;
        let svd = SVD::try_new(x.clone(), true, true, f64::EPSILON, SVD_ITERATIONS)
            .ok_or(SubspaceError::Factorisation)?;
        let (Some(u), Some(v_t)) = (&svd.u, &svd.v_t) else {
            return Err(SubspaceError::Factorisation);
        };
        let largest = svd.singular_values.max();
        let means = deviations.means.iter().map(DVector::norm);
        let least = IDENTICAL * means.fold(0.0, f64::max);
        if !(largest.is_finite() && largest > least) {
            return Err(SubspaceError::Nothing);
        }
        let above = |value: &&f64| **value > RANK_TOLERANCE * largest;
        let rank = svd.singular_values.iter().filter(above).count();
        let rank = rank.min(deviations.freedom());
        let u = u.columns(0, rank).into_owned();
        let directions = v_t.rows(0, rank).transpose();
        let coordinates = x * &directions;
        let lost = (x - &coordinates * directions.transpose()).norm();
        if lost.is_nan() || lost > SVD_TOLERANCE * x.norm() {
            return Err(SubspaceError::Factorisation);
        }
        let outside = Self::outside(deviations, &u, &svd.singular_values, &directions);
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
    /// `X = U S V^T` that is `d_i = V S^-1 u_i / |S^-1 u_i|^2`, `u_i` the row of `U`. Where the weights have fewer
    /// dimensions than the demonstrations, others reach everything and `d_i = 0`.
    fn outside(
        deviations: &Deviations,
        u: &DMatrix<f64>,
        singular: &DVector<f64>,
        directions: &DMatrix<f64>,
    ) -> DMatrix<f64> {
        let mut scaled = u.clone();
        for i in 0..u.nrows() {
            let count = deviations.counts[deviations.skill[i]] as f64;
            // What of e_i is neither the skill's mean nor in the range of G: then d_i = 0 is reached.
            let free = 1.0 - 1.0 / count - u.row(i).norm_squared();
            let mut row = scaled.row_mut(i);
            for (entry, value) in row.iter_mut().zip(singular.iter()) {
                *entry /= *value;
            }
            let square = row.norm_squared();
            row *= if free > SVD_TOLERANCE || square <= 0.0 {
                0.0
            } else {
                1.0 / square
            };
        }
        scaled * directions.transpose()
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
        if norm > SVD_TOLERANCE * vector.norm() {
            let last = all.ncols();
            all = all.insert_column(last, 0.0);
            all.column_mut(last).copy_from(&(rest / norm));
        }
    }
    all
}
