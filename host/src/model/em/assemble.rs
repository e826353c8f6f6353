//! From what EM found to a model.

use nalgebra::{DMatrix, DVector};

use super::complete::Completed;
use super::step::{Posterior, State, Statistics};
use crate::model::assembly::{Learnt, choose, outside_variance, subspace_of};
use crate::model::placement::Placement;
use crate::model::shrinkage::{Scatter, Targets, size};
use crate::model::subspace::Deviations;
use crate::model::{Hyperparameters, LearnError, Learner, Model, Predictive};

/// Shrinks the covariances and adds what new performances differ in, as least squares does after its fits.
///
/// With [`Predictive::PlugIn`] and no shrinkage the model is what maximises the likelihood, nothing else. Otherwise
/// covariances are unbiased (`n / (n - 1)`), widened for the mean (`1 + 1 / n`), and what a movement has outside the span
/// of the others is added to the noise.
pub(super) fn model(
    completed: Completed,
    statistics: &Statistics,
    state: &State,
    posterior: &Posterior,
    given: &Hyperparameters,
) -> Result<Model, LearnError> {
    let groups = completed.groups;
    let b = &statistics.directions;
    let weights: Vec<DVector<f64>> = posterior.means.iter().map(|c| b * c).collect();
    let deviations = Deviations::new(&weights, groups.skill.clone(), groups.counts.clone());
    let subspace = subspace_of(&deviations)?;
    let mut residual = DVector::from_column_slice(&state.noise);
    let predictive = given.predictive != Predictive::PlugIn;
    if predictive {
        residual += outside_variance(&subspace.outside, given)?;
    }
    let scatter = Scatter::new(&deviations, &subspace);
    let placement = Placement::new(given, &completed.scale)?;
    let choice = choose(&scatter, &placement, &residual, given)?;
    let counts = &groups.counts;
    let lost = usize::from(predictive);
    let scatters = state.roots.iter().zip(counts);
    let scatters: Vec<DMatrix<f64>> = scatters
        .map(|(l, &n)| l * l.transpose() * n as f64)
        .collect();
    let mut pooled = DMatrix::zeros(b.ncols(), b.ncols());
    for scatter in &scatters {
        pooled += scatter;
    }
    pooled /= (weights.len() - lost * counts.len()) as f64;
    let half = b * &pooled;
    let mut weighted = b.clone();
    for (row, mut line) in weighted.row_iter_mut().enumerate() {
        line *= half.row(row).dot(&b.row(row));
    }
    let diagonal = b.transpose() * weighted;
    let covariances = scatters.iter().zip(counts).map(|(scatter, &n)| {
        let own = scatter / (n - lost) as f64;
        let targets = Targets {
            pooled: &pooled * size(own.trace(), pooled.trace()),
            own,
            diagonal: diagonal.clone(),
        };
        targets.mix(choice.shares) * (1.0 + lost as f64 / n as f64)
    });
    let learnt = Learnt {
        covariances: covariances.collect(),
        groups,
        means: state.means.iter().map(|m| b * m).collect(),
        directions: b.clone(),
        residual,
        scale: completed.scale,
        choice,
        learner: Learner::Em,
        demonstrations: Vec::new(),
    };
    learnt.model(&placement, given)
}
