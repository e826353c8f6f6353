//! From demonstrations to a model.

use std::path::PathBuf;

use tonus_shared::promp::RowError;

use super::assembly::{Learnt, choose, outside_variance, subspace_of};
use super::fits::{Fitted, Groups, Member, fit_all, residual_variance, scaled, scales};
use super::parts::same;
use super::placement::Placement;
use super::shrinkage::Scatter;
use super::subspace::Deviations;
use super::{
    Hyperparameters, HyperparametersError, Learner, Model, NotPositive, PartsError, Predictive,
    Valid,
};
use crate::demonstration::Demonstration;

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
    /// Values missing where the learner needs all.
    #[error("{}: a demonstration of `{label}` has values missing: learn by EM", file.display())]
    Gaps {
        /// The file it comes from.
        file: PathBuf,
        /// Its label.
        label: String,
    },
    /// A DoF of which a skill has no value at all.
    #[error("no demonstration of `{label}` has a value of `{dof}`: leave out one or the other")]
    NeverSeen {
        /// The skill.
        label: String,
        /// The DoF.
        dof: String,
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

/// Learns a model: weights of every demonstration by regularised least squares on scaled DoFs, the subspace of their
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
    let members: Vec<_> = fits.iter().map(Member::of_fit).collect();
    let groups = Groups::of(&members)?;
    let scale = scales(&fits, &given.dofs)?;
    let weights = scaled(&fits, &scale, given.basis.count());
    let deviations = Deviations::new(&weights, groups.skill.clone(), groups.counts.clone());
    let subspace = subspace_of(&deviations)?;
    let outside_variance = outside_variance(&subspace.outside, given)?;
    let residual = residual_variance(&fits, &scale) + outside_variance;
    let scatter = Scatter::new(&deviations, &subspace);
    let placement = Placement::new(given, &scale)?;
    let choice = choose(&scatter, &placement, &residual, given)?;
    let covariances = groups.counts.iter().enumerate().map(|(skill, &n)| {
        let inside = scatter.covariance(skill, choice.shares);
        if given.predictive == Predictive::PlugIn {
            return inside;
        }
        // The mean's own uncertainty.
        inside * (1.0 + 1.0 / n as f64)
    });
    let learnt = Learnt {
        covariances: covariances.collect(),
        groups,
        means: deviations.means,
        directions: subspace.directions,
        residual,
        scale,
        choice,
        learner: Learner::LeastSquares,
        demonstrations: fits,
    };
    learnt.model(&placement, given)
}
