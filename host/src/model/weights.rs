//! Weights of one demonstration by regularised least squares.
//!
//! Where samples are dense they say what the weights are. Where there are none, or fewer than basis functions, the drawn
//! trajectory goes straight from sample to sample: `|P w - y|^2 + ridge (|G w - M y|^2 + FLOOR |w|^2)`, with `G` the basis
//! at even phases and `M y` straight lines between the samples, held at the ends. Pulling the weights to zero instead, as
//! a plain ridge does, pulls the trajectory to zero (in the model's unit) wherever the tracker lost the hand.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use tonus_shared::promp::{Basis, RowError};

use super::LearnError;

/// Phases at which a trajectory is drawn straight, for each basis function: none lies between two of them unseen.
const STRAIGHT_PER_FUNCTION: usize = 2;
/// Of the weights themselves: keeps the normal equations of wide bases, which nearly depend on each other, well posed.
const FLOOR: f64 = 1e-6;

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
    /// `P^T + ridge G^T M`: `K x T`.
    gathered: DMatrix<f64>,
    /// Of `P^T P + ridge (G^T G + FLOOR I)`.
    factor: Cholesky<f64, Dyn>,
}

impl Design {
    pub(super) fn new(basis: &Basis, phases: Vec<f64>, ridge: f64) -> Result<Self, LearnError> {
        let drawn_at = even(STRAIGHT_PER_FUNCTION * basis.count());
        let drawn = design(basis, drawn_at.iter().copied())?;
        let lines = straight(&phases, &drawn_at);
        let basis = design(basis, phases.iter().copied())?;
        let gathered = basis.transpose() + drawn.tr_mul(&lines) * ridge;
        let mut normal = basis.tr_mul(&basis) + drawn.tr_mul(&drawn) * ridge;
        for k in 0..normal.nrows() {
            normal[(k, k)] += FLOOR * ridge;
        }
        // A positive ridge makes it positive definite for finite data.
        let factor = Cholesky::new(normal)
            .ok_or(LearnError::Numerical("least squares fit of the weights"))?;
        Ok(Self {
            phases,
            basis,
            gathered,
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

    /// `w_d = (P^T P + ridge (G^T G + FLOOR I))^-1 (P^T + ridge G^T M) y_d` for each DoF, a column of `series`
    /// (`T x D`).
    pub(super) fn fit(&self, series: &DMatrix<f64>) -> Fit {
        let mut weights = &self.gathered * series;
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

/// `count` phases from 0 to 1.
fn even(count: usize) -> Vec<f64> {
    let last = count.saturating_sub(1).max(1) as f64;
    (0..count).map(|i| i as f64 / last).collect()
}

/// Shares of the samples in the straight lines between them: a row for each phase of `at`, a column for each sample.
fn straight(samples: &[f64], at: &[f64]) -> DMatrix<f64> {
    let mut shares = DMatrix::zeros(at.len(), samples.len());
    let last = samples.len().saturating_sub(1);
    for (row, &phase) in at.iter().enumerate() {
        let after = samples.partition_point(|sample| *sample <= phase);
        let before = after.saturating_sub(1);
        let after = after.min(last);
        let span = samples[after] - samples[before];
        let share = if span > 0.0 {
            ((phase - samples[before]) / span).clamp(0.0, 1.0)
        } else {
            0.0
        };
        shares[(row, before)] += 1.0 - share;
        shares[(row, after)] += share;
    }
    shares
}
