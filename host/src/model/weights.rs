//! Weights of one demonstration by ridge least squares.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use tonus_shared::promp::{Basis, RowError};

use super::LearnError;

/// Weights of one demonstration and what they leave, in the values' own units.
pub(super) struct Fit {
    /// `D * K`, DoF-major.
    pub(super) weights: DVector<f64>,
    /// Sum of squares of what the weights leave, per DoF. With fewer samples than basis functions it says little:
    /// the weights then pass through nearly every sample.
    pub(super) residual_squares: Vec<f64>,
}

/// `values()` of the basis at each phase, one row each: `T x K`.
pub(super) fn design(
    basis: &Basis,
    phases: impl IntoIterator<Item = f64>,
) -> Result<DMatrix<f64>, RowError> {
    let mut rows = Vec::new();
    let mut psi = vec![0.0; basis.count()];
    for phase in phases {
        basis.values(phase, &mut psi)?;
        rows.extend_from_slice(&psi);
    }
    let samples = rows.len() / basis.count();
    Ok(DMatrix::from_row_slice(samples, basis.count(), &rows))
}

/// The basis at some phases, and the factor of its normal equations.
pub(super) struct Design {
    phases: Vec<f64>,
    /// `T x K`.
    basis: DMatrix<f64>,
    /// `K x T`.
    transposed: DMatrix<f64>,
    /// Of `P^T P + ridge I`.
    factor: Cholesky<f64, Dyn>,
}

impl Design {
    pub(super) fn new(basis: &Basis, phases: Vec<f64>, ridge: f64) -> Result<Self, LearnError> {
        let basis = design(basis, phases.iter().copied())?;
        let transposed = basis.transpose();
        let mut normal = &transposed * &basis;
        for k in 0..normal.nrows() {
            normal[(k, k)] += ridge;
        }
        // A positive ridge makes it positive definite for finite data.
        let factor = Cholesky::new(normal)
            .ok_or(LearnError::Numerical("least squares fit of the weights"))?;
        Ok(Self {
            phases,
            basis,
            transposed,
            factor,
        })
    }

    /// `T`.
    pub(super) fn samples(&self) -> usize {
        self.basis.nrows()
    }

    /// Whether it is at exactly these phases.
    pub(super) fn is_at(&self, phases: &[f64]) -> bool {
        self.phases == phases
    }

    /// `w_d = (P^T P + ridge I)^-1 P^T y_d` for each DoF, a column of `series` (`T x D`).
    pub(super) fn fit(&self, series: &DMatrix<f64>) -> Fit {
        let mut weights = &self.transposed * series;
        self.factor.solve_mut(&mut weights);
        let left = series - &self.basis * &weights;
        let squares = left.column_iter().map(|column| column.norm_squared());
        Fit {
            residual_squares: squares.collect(),
            // Column-major, so DoF-major.
            weights: DVector::from_column_slice(weights.as_slice()),
        }
    }
}
