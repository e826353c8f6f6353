//! From demonstrations to a model.

use std::path::PathBuf;

use nalgebra::{Cholesky, DMatrix, DVector, SymmetricEigen};
use tonus_shared::promp::RowError;

use super::choice::{self, Choice, Observed};
use super::fits::{Fitted, Groups, fit_all, residual_variance, scaled, scales};
use super::parts::same;
use super::placement::Placement;
use super::shrinkage::Scatter;
use super::subspace::{Deviations, Subspace, SubspaceError, extended};
use super::weights::design;
use super::{
    Hyperparameters, HyperparametersError, Learner, Model, NotPositive, Parts, PartsError,
    Predictive, Valid,
};
use crate::demonstration::Demonstration;

/// Phases per DoF at which the leave-one-out likelihood looks at a demonstration.
const LIKELIHOOD_PHASES: usize = 10;
/// Phases per DoF over which a variance of weights is averaged into one of the DoF.
const RESIDUAL_PHASES: usize = 50;
/// Demonstrations that make no model.
#[derive(Debug, thiserror::Error)]
pub enum LearnError {
    /// No demonstrations at all.
    #[error("no demonstrations")]
    None,
    /// A demonstration with another number of DoFs than the hyperparameters name.
    #[error("{}: a demonstration of `{label}` has {got} DoFs, the model {expected}", file.display())]
    Dofs {
        /// The file it comes from.
        file: PathBuf,
        /// Its label.
        label: String,
        /// DoFs of the model.
        expected: usize,
        /// Its DoFs.
        got: usize,
    },
    /// A skill with too few demonstrations.
    #[error(
        "skill `{label}` has {found} demonstration(s) and needs at least {needed}: record more or exclude it"
    )]
    TooFew {
        /// The skill.
        label: String,
        /// Demonstrations found.
        found: usize,
        /// Demonstrations needed.
        needed: usize,
    },
    /// One component of two classes.
    #[error("demonstrations of `{label}` are of two classes, `{}` and `{}`: rename one", classes[0], classes[1])]
    Classes {
        /// The component.
        label: String,
        /// Two of its classes.
        classes: [String; 2],
    },
    /// A model that keeps nothing of its demonstrations.
    #[error("the model was learnt by EM and must be refitted: train it again from all recordings")]
    Refit,
    /// A value without a logarithm.
    #[error("{}: `{label}` at {time_s} s: {reason}", file.display())]
    NotPositive {
        /// The file it comes from.
        file: PathBuf,
        /// The demonstration's label.
        label: String,
        /// The time, seconds.
        time_s: f64,
        /// The DoF and the value.
        reason: NotPositive,
    },
    /// A DoF that is the same everywhere.
    #[error("DoF `{dof}` is {value:?} in every demonstration: leave it out")]
    Constant {
        /// The DoF.
        dof: String,
        /// Its value, as it enters the model.
        value: f64,
    },
    /// A DoF whose spread overflows.
    #[error("DoF `{dof}` holds values too large to learn from: change its unit")]
    TooLarge {
        /// The DoF.
        dof: String,
    },
    /// The demonstrations of each skill are the same.
    #[error("the demonstrations of each skill are identical: nothing to learn a covariance from")]
    Identical,
    /// A factorisation failed.
    #[error("the {0} did not converge: check the demonstrations for values of very different size")]
    Numerical(&'static str),
    /// The hyperparameters of the model to be extended.
    #[error(transparent)]
    Hyperparameters(#[from] HyperparametersError),
    /// The basis refused a phase.
    #[error(transparent)]
    Row(#[from] RowError),
    /// The numbers learnt make no model.
    #[error("what was learnt is no model")]
    Parts(#[from] PartsError),
}

/// Learns a model: weights of every demonstration by ridge least squares on scaled DoFs, the subspace of their
/// within-skill deviations by QR, each skill's covariance in it by shrinkage, priors from counts.
///
/// What the basis leaves of the demonstrations, and what a demonstration has outside the subspace of the others
/// (in closed form, as if each had been left out), is each DoF's residual variance, which inference adds to the
/// noise of every position observed. The second is correlated along a movement and inference treats
/// it as independent: with few demonstrations posteriors are over-confident.
///
/// # Errors
/// [`LearnError`].
pub fn learn(demonstrations: &[Demonstration], valid: &Valid) -> Result<Model, LearnError> {
    learn_fitted(fit(demonstrations, valid)?, valid)
}

/// The first half of [`learn`]: each demonstration on its own. Whoever learns many models from subsets of the same
/// demonstrations fits them once.
///
/// # Errors
/// [`LearnError`] of one demonstration.
pub fn fit(demonstrations: &[Demonstration], valid: &Valid) -> Result<Vec<Fitted>, LearnError> {
    fit_all(demonstrations, valid.get())
}

/// The second half of [`learn`]: everything after the fits, a function of them and of what was decided before.
///
/// # Errors
/// [`LearnError`], also for fits of another number of weights.
pub fn learn_fitted(fits: Vec<Fitted>, valid: &Valid) -> Result<Model, LearnError> {
    let given = valid.get();
    check_lengths(&fits, given)?;
    from_fits(fits, given)
}

/// Adds demonstrations, of skills that the model has or of new ones. The model is the one that [`learn`] makes
/// of all demonstrations, the model's own first: it keeps what was fitted to each of them, and everything after the
/// fits is done again (scales, subspace, shares if they were chosen).
///
/// # Errors
/// [`LearnError`]; [`LearnError::Refit`] for a model that keeps no fits.
pub fn extend(model: &Model, demonstrations: &[Demonstration]) -> Result<Model, LearnError> {
    if model.parts().learner == Learner::Em {
        return Err(LearnError::Refit);
    }
    let valid = model.hyperparameters().check()?;
    let mut fits = model.parts().demonstrations.clone();
    fits.extend(fit(demonstrations, &valid)?);
    learn_fitted(fits, &valid)
}

fn check_lengths(fits: &[Fitted], given: &Hyperparameters) -> Result<(), LearnError> {
    let dofs = given.dofs.len();
    for one in fits {
        let width = dofs.saturating_mul(given.basis.count());
        same("the weights of a demonstration", width, one.weights.len())?;
        same("what they leave", dofs, one.residual_squares.len())?;
        same("the means of a demonstration", dofs, one.means.len())?;
        same("the squares of a demonstration", dofs, one.squares.len())?;
    }
    Ok(())
}

fn from_fits(fits: Vec<Fitted>, given: &Hyperparameters) -> Result<Model, LearnError> {
    let functions = given.basis.count();
    let groups = Groups::of(&fits)?;
    let scale = scales(&fits, &given.dofs)?;
    let weights = scaled(&fits, &scale, functions);
    let deviations = Deviations::new(&weights, groups.skill, groups.counts);
    let subspace = Subspace::of(&deviations).map_err(|error| match error {
        SubspaceError::Nothing => LearnError::Identical,
        SubspaceError::Factorisation => LearnError::Numerical("factorisation of the deviations"),
    })?;
    let outside_variance = outside_variance(&subspace.outside, given)?;
    let residual = residual_variance(&fits, &scale) + outside_variance;
    let scatter = Scatter::new(&deviations, &subspace);
    let placement = Placement::new(given, &scale)?;
    let Choice { shares, freedom } = choose(&scatter, &placement, &residual, given)?;
    let directions = extended(&subspace.directions, &placement.offsets);
    let roots = (0..groups.labels.len()).map(|skill| {
        let mut inside = scatter.covariance(skill, shares);
        if given.predictive != Predictive::PlugIn {
            // The mean's own uncertainty.
            inside *= 1.0 + 1.0 / deviations.counts[skill] as f64;
        }
        root(placement.added_to(&inside, &directions))
    });
    let roots = roots.collect::<Result<Vec<_>, _>>()?.concat();
    let raw = |row: usize| scale[row / functions];
    let loading = (0..directions.nrows()).flat_map(|row| {
        let line = directions.row(row);
        line.iter().map(|v| v * raw(row)).collect::<Vec<_>>()
    });
    let means = deviations.means.iter();
    let means = means.flat_map(|mean| mean.iter().enumerate().map(|(row, v)| v * raw(row)));
    let residual = residual.iter().zip(&scale);
    let counts = deviations.counts.iter();
    let parts = Parts {
        dofs: given.dofs.clone(),
        basis: given.basis,
        classes: groups.classes,
        counts: counts
            .map(|&n| u32::try_from(n).unwrap_or(u32::MAX))
            .collect(),
        durations: groups.durations,
        rank: directions.ncols(),
        loading: loading.collect(),
        weight_means: means.collect(),
        roots,
        residual_variance: residual.map(|(v, s)| v * s * s).collect(),
        freedom: vec![freedom; groups.labels.len()],
        predictive: given.predictive,
        labels: groups.labels,
        scale,
        ridge: given.ridge,
        placement_m: given.placement_m,
        shrinkage: given.shrinkage,
        pooled_share: shares.pooled,
        diagonal_share: shares.diagonal,
        learner: Learner::LeastSquares,
        demonstrations: fits,
    };
    Ok(Model::assemble(parts)?)
}

/// Mean square along the movement of what the rows of `outside` (weights) draw, per DoF.
fn outside_variance(
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

fn choose(
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
/// some are zero; those that rounding put below zero are zero.
fn root(covariance: DMatrix<f64>) -> Result<Vec<f64>, LearnError> {
    let symmetric = (&covariance + covariance.transpose()) * 0.5;
    if let Some(factor) = Cholesky::new(symmetric.clone()) {
        return Ok(factor.unpack().transpose().as_slice().to_vec());
    }
    let eigen = SymmetricEigen::try_new(symmetric, f64::EPSILON, 0)
        .ok_or(LearnError::Numerical("eigenvalue decomposition"))?;
    let mut vectors = eigen.eigenvectors;
    for (mut column, value) in vectors.column_iter_mut().zip(eigen.eigenvalues.iter()) {
        column *= libm::sqrt(value.max(0.0));
    }
    Ok(vectors.transpose().as_slice().to_vec())
}
