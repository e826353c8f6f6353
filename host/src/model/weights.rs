//! Weights of one demonstration by ridge least squares.

use nalgebra::{Cholesky, DMatrix, DVector};
use tonus_shared::promp::{Basis, RowError};

/// Weights and what they leave of one demonstration.
pub(super) struct Fit {
    /// `D * K`, DoF-major, each DoF in units of its scale.
    pub(super) weights: DVector<f64>,
    /// Mean square of what the weights leave, per DoF, in units of its scale squared. With fewer samples than basis
    /// functions it says little: the weights then pass through nearly every sample.
    pub(super) residual_variance: Vec<f64>,
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

/// `w_d = (P^T P + ridge I)^-1 P^T y_d` for each DoF, by Cholesky; the factor is shared. `None` if it fails, which
/// a positive ridge excludes for finite data.
pub(super) fn fit(phases: &DMatrix<f64>, series: &[DVector<f64>], ridge: f64) -> Option<Fit> {
    let functions = phases.ncols();
    let mut normal = phases.tr_mul(phases);
    for k in 0..functions {
        normal[(k, k)] += ridge;
    }
    let factor = Cholesky::new(normal)?;
    let mut weights = DVector::zeros(series.len() * functions);
    let mut residual_variance = Vec::with_capacity(series.len());
    for (dof, values) in series.iter().enumerate() {
        let solved = factor.solve(&phases.tr_mul(values));
        let left = values - phases * &solved;
        residual_variance.push(left.norm_squared() / values.len() as f64);
        weights
            .rows_mut(dof * functions, functions)
            .copy_from(&solved);
    }
    Some(Fit {
        weights,
        residual_variance,
    })
}
