//! Where somebody stands: a constant offset of each position that the demonstrations do not show.

use nalgebra::{DMatrix, DVector};

use super::assembly::even;
use super::weights::Design;
use super::{Hyperparameters, LearnError};

/// Phases that a constant is fitted at, for each basis function.
const PHASES_PER_FUNCTION: usize = 4;
/// Small enough that a constant is fitted as one.
const RIDGE: f64 = 1e-9;

/// The offsets as weights.
pub(super) struct Placement {
    /// Weights that draw the constant 1 in the DoF, times the offset's standard deviation; scaled.
    pub(super) offsets: Vec<DVector<f64>>,
}

impl Placement {
    pub(super) fn new(given: &Hyperparameters, scale: &[f64]) -> Result<Self, LearnError> {
        let mut offsets = Vec::new();
        if given.placement_m > 0.0 {
            // Least squares, like any other movement: the basis may or may not sum to one.
            let phases = even(PHASES_PER_FUNCTION * given.basis.count()).collect();
            let design = Design::new(&given.basis, phases, RIDGE)?;
            let ones = design.fit(&DMatrix::from_element(design.samples(), 1, 1.0));
            let functions = given.basis.count();
            let positions = given.dofs.iter().zip(scale).enumerate();
            for (dof, (_, s)) in positions.filter(|(_, (dof, _))| dof.is_position()) {
                let mut offset = DVector::zeros(given.dofs.len() * functions);
                let std = given.placement_m / s;
                offset
                    .rows_mut(dof * functions, functions)
                    .copy_from(&(&ones.weights * std));
                offsets.push(offset);
            }
        }
        Ok(Self { offsets })
    }

    /// The covariance of the offsets as the rows of `observe` see it.
    pub(super) fn seen(&self, observe: &DMatrix<f64>) -> DMatrix<f64> {
        let mut sum = DMatrix::zeros(observe.nrows(), observe.nrows());
        for offset in &self.offsets {
            let drawn = observe * offset;
            sum += &drawn * drawn.transpose();
        }
        sum
    }

    /// `inside` (of the first of the `directions`) and the offsets, along all of them.
    pub(super) fn added_to(
        &self,
        inside: &DMatrix<f64>,
        directions: &DMatrix<f64>,
    ) -> DMatrix<f64> {
        let (inner, all) = (inside.nrows(), directions.ncols());
        let mut sum = DMatrix::zeros(all, all);
        sum.view_mut((0, 0), (inner, inner)).copy_from(inside);
        for offset in &self.offsets {
            let along = directions.tr_mul(offset);
            sum += &along * along.transpose();
        }
        sum
    }
}
