//! Where demonstrations are points.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::ClusterError;
use crate::demonstration::Demonstration;
use crate::model::assembly::even;
use crate::model::fits::{fit_all, scaled, scales};
use crate::model::weights::design;
use crate::model::{Fitted, Hyperparameters, LearnError, Valid};

/// Phases at which a movement is drawn.
const PHASES: usize = 50;
/// Demonstrations for each principal direction, at least: a covariance needs more points than dimensions.
const POINTS_PER_DIMENSION: usize = 4;
/// Noise variance along each direction, at least, as a share of the mean variance along them.
const NOISE_FLOOR: f64 = 1e-6;
/// Total variance below this share of the mean square movement is rounding.
const IDENTICAL: f64 = 1e-20;

/// Demonstrations as points in the leading principal coordinates of what their weights draw. The squared distance of
/// two points is their mean squared distance along the movement, summed over the DoFs, each of unit variance; so it
/// depends neither on the units nor on the family of the basis.
pub(super) struct Space {
    /// `p x N`: one column per demonstration, centred.
    pub(super) points: DMatrix<f64>,
    /// Variance of the movements that the `p` coordinates leave, per direction they are spread over.
    pub(super) noise: f64,
}

impl Space {
    pub(super) fn of(
        demonstrations: &[Demonstration],
        valid: &Valid,
        variance_kept: f64,
    ) -> Result<Self, ClusterError> {
        let given = valid.get();
        let fits = fit_all(demonstrations, given)?;
        let drawn = drawn(&fits, given)?;
        let most = given.dofs.len() * given.basis.count();
        Self::principal(drawn, most, variance_kept)
    }

    /// The leading principal coordinates of the columns, of which at most `most` are linearly independent.
    pub(super) fn principal(
        mut columns: DMatrix<f64>,
        most: usize,
        variance_kept: f64,
    ) -> Result<Self, ClusterError> {
        let n = columns.ncols();
        let square = columns.norm_squared();
        let mean: DVector<f64> = columns.column_mean();
        for mut column in columns.column_iter_mut() {
            column -= &mean;
        }
        let gram = columns.tr_mul(&columns);
        let eigen = SymmetricEigen::try_new(gram, f64::EPSILON, 0)
            .ok_or(ClusterError::Numerical("eigenvalue decomposition"))?;
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|&i, &j| eigen.eigenvalues[j].total_cmp(&eigen.eigenvalues[i]));
        let values: Vec<f64> = order
            .iter()
            .map(|&i| eigen.eigenvalues[i].max(0.0))
            .collect();
        let total: f64 = values.iter().sum();
        if !(total.is_finite() && total > IDENTICAL * square) {
            return Err(ClusterError::Identical);
        }
        let rank = (n - 1).min(most).max(1);
        let mut held = 0.0;
        let enough = values.iter().take_while(|&&value| {
            let before = held;
            held += value;
            before < variance_kept * total
        });
        let kept = enough
            .count()
            .clamp(1, (n / POINTS_PER_DIMENSION).max(1))
            .min(rank);
        let inside: f64 = values[..kept].iter().sum();
        let left = ((total - inside) / n as f64) / (rank - kept).max(1) as f64;
        let least = NOISE_FLOOR * inside / (n * kept) as f64;
        let points = DMatrix::from_fn(kept, n, |row, i| {
            eigen.eigenvectors[(i, order[row])] * libm::sqrt(values[row])
        });
        Ok(Self {
            points: with_fixed_signs(points),
            noise: left.max(least),
        })
    }

    pub(super) fn count(&self) -> usize {
        self.points.ncols()
    }

    /// Some of the points, with the same axes and noise.
    pub(super) fn select(&self, which: &[usize]) -> Self {
        Self {
            points: self.points.select_columns(which),
            noise: self.noise,
        }
    }
}

/// What the weights draw, a column per demonstration. The squared distance of two columns is that of [`Space`].
pub(super) fn drawn(
    fits: &[Fitted],
    given: &Hyperparameters,
) -> Result<DMatrix<f64>, ClusterError> {
    let (dofs, functions) = (given.dofs.len(), given.basis.count());
    let scale = scales(fits, &given.dofs)?;
    let phases = design(&given.basis, even(PHASES)).map_err(LearnError::from)?;
    let mut drawn = DMatrix::zeros(dofs * PHASES, fits.len());
    let weights = scaled(fits, &scale, functions);
    for (mut column, weights) in drawn.column_iter_mut().zip(&weights) {
        for dof in 0..dofs {
            let of_dof = &phases * weights.rows(dof * functions, functions);
            column.rows_mut(dof * PHASES, PHASES).copy_from(&of_dof);
        }
    }
    Ok(drawn / libm::sqrt(PHASES as f64))
}

/// A principal direction's sign is chance: each coordinate's greatest is positive.
fn with_fixed_signs(mut points: DMatrix<f64>) -> DMatrix<f64> {
    for mut row in points.row_iter_mut() {
        let wider = |far: f64, next: &f64| if next.abs() > far.abs() { *next } else { far };
        if row.iter().fold(0.0, wider) < 0.0 {
            row.neg_mut();
        }
    }
    points
}
