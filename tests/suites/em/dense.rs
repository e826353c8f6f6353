//! A model as dense matrices over weights, and likelihoods from those.

use nalgebra::{Cholesky, DMatrix, DVector};
use tonus::demonstration::Demonstration;
use tonus::model::Model;
use tonus_shared::promp::Basis;

/// One skill.
pub(crate) struct Dense {
    pub(crate) basis: Basis,
    /// `D K`.
    pub(crate) mean: DVector<f64>,
    /// `D K x D K`.
    pub(crate) covariance: DMatrix<f64>,
    /// Per DoF.
    pub(crate) noise: Vec<f64>,
}

impl Dense {
    pub(crate) fn of(model: &Model, skill: usize) -> Self {
        let parts = model.parts();
        let (width, rank) = (parts.dofs.len() * parts.basis.count(), parts.rank);
        let loading = DMatrix::from_row_slice(width, rank, &parts.loading);
        let root = &parts.roots[skill * rank * rank..(skill + 1) * rank * rank];
        let half = loading * DMatrix::from_row_slice(rank, rank, root);
        let mean = &parts.weight_means[skill * width..(skill + 1) * width];
        Self {
            basis: parts.basis,
            mean: DVector::from_column_slice(mean),
            covariance: &half * half.transpose(),
            noise: parts.residual_variance.clone(),
        }
    }
}

/// Log density of every value that was recorded.
pub(crate) fn log_likelihood(model: &Dense, demonstrations: &[Demonstration]) -> f64 {
    let functions = model.basis.count();
    let of_one = |one: &Demonstration| {
        let (mut rows, mut off, mut noise) = (Vec::new(), Vec::new(), Vec::new());
        let mut psi = vec![0.0; functions];
        for (dof, series) in one.values().iter().enumerate() {
            for (sample, (&value, phase)) in series.iter().zip(one.phases()).enumerate() {
                if one.present(dof).is_some_and(|present| !present[sample]) {
                    continue;
                }
                model.basis.values(phase, &mut psi).unwrap();
                let mut row = DVector::zeros(model.mean.len());
                row.rows_mut(dof * functions, functions)
                    .copy_from_slice(&psi);
                off.push(value - row.dot(&model.mean));
                noise.push(model.noise[dof]);
                rows.push(row.transpose());
            }
        }
        let rows = DMatrix::from_rows(&rows);
        let noise = DMatrix::from_diagonal(&DVector::from_vec(noise));
        let total = &rows * &model.covariance * rows.transpose() + noise;
        let factor = Cholesky::new(total).unwrap();
        let off = DVector::from_vec(off);
        let constant = off.len() as f64 * std::f64::consts::TAU.ln();
        -0.5 * (off.dot(&factor.solve(&off)) + factor.ln_determinant() + constant)
    };
    demonstrations.iter().map(of_one).sum()
}
