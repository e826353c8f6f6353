//! What every learner does last: choices, residual, and the numbers of a model.

use nalgebra::{Cholesky, DMatrix, DVector, SymmetricEigen};

use super::choice::{self, Choice, Observed};
use super::fits::{Fitted, Groups};
use super::placement::Placement;
use super::shrinkage::Scatter;
use super::subspace::{Deviations, Subspace, SubspaceError, extended};
use super::weights::design;
use super::{Hyperparameters, LearnError, Learner, Model, Parts};

/// Phases per DoF at which the leave-one-out likelihood looks at a demonstration.
const LIKELIHOOD_PHASES: usize = 10;
/// Phases per DoF over which a variance of weights is averaged into one of the DoF.
const RESIDUAL_PHASES: usize = 50;
/// What a learner found; weights and variances of DoFs scaled to unit variance.
pub(super) struct Learnt {
    pub(super) groups: Groups,
    /// Standard deviation of each DoF.
    pub(super) scale: Vec<f64>,
    /// Mean weights of each skill.
    pub(super) means: Vec<DVector<f64>>,
    /// `D K x r`, orthonormal.
    pub(super) directions: DMatrix<f64>,
    /// Covariance of each skill along them.
    pub(super) covariances: Vec<DMatrix<f64>>,
    /// Residual variance of each DoF.
    pub(super) residual: DVector<f64>,
    pub(super) choice: Choice,
    pub(super) learner: Learner,
    pub(super) demonstrations: Vec<Fitted>,
}

impl Learnt {
    /// With the scales folded in and the placement added.
    pub(super) fn model(
        self,
        placement: &Placement,
        given: &Hyperparameters,
    ) -> Result<Model, LearnError> {
        let functions = given.basis.count();
        let directions = extended(&self.directions, &placement.offsets);
        let added = self.covariances.iter();
        let roots = added.map(|inside| root(placement.added_to(inside, &directions)));
        let roots = roots.collect::<Result<Vec<_>, _>>()?.concat();
        let scale = self.scale;
        let raw = |row: usize| scale[row / functions];
        let mut loading = Vec::with_capacity(directions.len());
        for (row, line) in directions.row_iter().enumerate() {
            loading.extend(line.iter().map(|v| v * raw(row)));
        }
        let means = self.means.iter();
        let means = means.flat_map(|mean| mean.iter().enumerate().map(|(row, v)| v * raw(row)));
        let residual = self.residual.iter().zip(&scale);
        let counts = self.groups.counts.iter();
        let parts = Parts {
            dofs: given.dofs.clone(),
            basis: given.basis,
            classes: self.groups.classes,
            counts: counts
                .map(|&n| u32::try_from(n).unwrap_or(u32::MAX))
                .collect(),
            durations: self.groups.durations,
            rank: directions.ncols(),
            loading,
            weight_means: means.collect(),
            roots,
            residual_variance: residual.map(|(v, s)| v * s * s).collect(),
            freedom: vec![self.choice.freedom; self.groups.labels.len()],
            predictive: given.predictive,
            labels: self.groups.labels,
            scale,
            ridge: given.ridge,
            placement_m: given.placement_m,
            shrinkage: given.shrinkage,
            pooled_share: self.choice.shares.pooled,
            diagonal_share: self.choice.shares.diagonal,
            learner: self.learner,
            demonstrations: self.demonstrations,
        };
        Ok(Model::assemble(parts)?)
    }
}

/// The subspace of these deviations.
pub(super) fn subspace_of(deviations: &Deviations) -> Result<Subspace, LearnError> {
    Subspace::of(deviations).map_err(|error| match error {
        SubspaceError::Nothing => LearnError::Identical,
        SubspaceError::Factorisation => LearnError::Numerical("factorisation of the deviations"),
    })
}

/// Mean square along the movement of what the rows of `outside` (weights) draw, per DoF.
pub(super) fn outside_variance(
    outside: &DMatrix<f64>,
    given: &Hyperparameters,
) -> Result<DVector<f64>, LearnError> {
    let phases = design(&given.basis, even(RESIDUAL_PHASES))?;
    let functions = given.basis.count();
    let of_dof = |dof: usize, _| {
        let drawn = outside.columns(dof * functions, functions) * phases.transpose();
        drawn.norm_squared() / drawn.len() as f64
    };
    Ok(DVector::from_fn(given.dofs.len(), of_dof))
}

/// `count` phases from 0 to 1.
pub(super) fn even(count: usize) -> impl Iterator<Item = f64> {
    (0..count).map(move |step| step as f64 / (count - 1) as f64)
}

pub(super) fn choose(
    scatter: &Scatter<'_>,
    placement: &Placement,
    residual: &DVector<f64>,
    given: &Hyperparameters,
) -> Result<Choice, LearnError> {
    let phases = design(&given.basis, even(LIKELIHOOD_PHASES))?;
    let dofs = given.dofs.len();
    let rows = DMatrix::<f64>::identity(dofs, dofs).kronecker(&phases);
    let observed = Observed {
        noise: DVector::from_fn(rows.nrows(), |row, _| residual[row / LIKELIHOOD_PHASES]),
        offset: placement.seen(&rows),
        rows,
    };
    choice::choose(scatter, &observed, given.shrinkage, given.predictive)
        .ok_or(LearnError::Numerical("leave-one-out likelihood"))
}

/// A square root of a positive semi-definite matrix, row-major: the Cholesky factor, or from the eigenvalues where
/// some are zero but for rounding. Largest first, so that the columns of the others, which are zero, come last.
fn root(covariance: DMatrix<f64>) -> Result<Vec<f64>, LearnError> {
    let symmetric = (&covariance + covariance.transpose()) * 0.5;
    let rounding = f64::EPSILON * symmetric.nrows() as f64;
    if let Some(factor) = Cholesky::new(symmetric.clone()) {
        let diagonal = factor.l_dirty().diagonal();
        if diagonal.min().powi(2) > rounding * diagonal.max().powi(2) {
            return Ok(factor.unpack().transpose().as_slice().to_vec());
        }
    }
    let eigen = SymmetricEigen::try_new(symmetric, f64::EPSILON, 0)
        .ok_or(LearnError::Numerical("eigenvalue decomposition"))?;
    let least = rounding * eigen.eigenvalues.max();
    let mut columns: Vec<_> = eigen
        .eigenvalues
        .iter()
        .zip(eigen.eigenvectors.column_iter())
        .collect();
    columns.sort_by(|one, other| other.0.total_cmp(one.0));
    let columns = columns.into_iter().map(|(&value, vector)| {
        let deviation = if value > least {
            libm::sqrt(value)
        } else {
            0.0
        };
        vector * deviation
    });
    let columns: Vec<_> = columns.collect();
    Ok(DMatrix::from_columns(&columns)
        .transpose()
        .as_slice()
        .to_vec())
}
