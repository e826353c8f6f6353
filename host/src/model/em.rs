//! Learning with the trajectory as the observation: the weights of a demonstration are latent, and expectation
//! maximisation finds what makes the samples most likely.
//!
//! A demonstration of skill `q` has samples `y = psi(s)^T w_d + noise`, the noise of variance `sigma_d^2` in each DoF
//! `d`, and weights `w = B c`, `c` Gaussian of mean `m_q` and covariance `L_q L_q^T`. `B` (`D K x r`, orthonormal) spans the
//! means and the largest deviations of the weights that least squares completes from each demonstration alone,
//! so that everything is `r x r`. Samples may be irregular, and any of them may be missing.
//!
//! - E: with `c = m + L u` and `A = sum_d Phi_d^T Phi_d / sigma_d^2` (`Phi_d = Psi B_d`), the posterior of `u` has the
//!   covariance `P = (I + L^T A L)^-1`, well conditioned however small a covariance becomes; demonstrations with
//!   the same phases and gaps share it.
//! - M: `m <- m + L mean(u)`, `L <- L chol(cov(u) + mean(P))`, `sigma_d^2` the mean square left plus its posterior variance.
//!
//! The log-likelihood of the samples never falls. Sources: Dempster, Laird and Rubin 1977; for movement primitives
//! Gomez-Gonzalez, Neumann, Schölkopf and Peters 2020 (IEEE T-RO 36), here without their prior on the covariance:
//! shrinkage takes its place, after the last step.

mod assemble;
mod complete;
mod step;

use super::{LearnError, Model, Valid};
use crate::demonstration::Demonstration;
use complete::Completed;
use step::{State, Statistics};

/// How long EM runs, and in how many directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmConfig {
    /// It stops when the log-likelihood grows by less than this, nats per recorded number.
    pub tolerance: f64,
    /// It stops after this many steps, converged or not.
    pub steps: usize,
    /// Most directions in which demonstrations deviate from the mean of their skill.
    pub directions: usize,
}

impl Default for EmConfig {
    fn default() -> Self {
        Self {
            tolerance: 1e-6,
            steps: 500,
            directions: 60,
        }
    }
}

/// A model and how EM came to it.
#[derive(Clone, Debug)]
pub struct Em {
    /// The model.
    pub model: Model,
    /// Log-likelihood of all recorded numbers, as they enter the model, before each step and after the last, nats.
    pub log_likelihoods: Vec<f64>,
    /// Whether it stopped because the log-likelihood no longer grew.
    pub converged: bool,
}

/// Learns a model from demonstrations of which values may be missing
/// ([`Demonstration::with_gaps`]). It keeps nothing of the demonstrations: [`super::extend`] refuses it.
///
/// # Errors
/// [`LearnError`].
pub fn learn_em(
    demonstrations: &[Demonstration],
    valid: &Valid,
    config: &EmConfig,
) -> Result<Model, LearnError> {
    run_em(demonstrations, valid, config).map(|em| em.model)
}

/// The same, with the course of the log-likelihood.
///
/// # Errors
/// [`LearnError`].
pub fn run_em(
    demonstrations: &[Demonstration],
    valid: &Valid,
    config: &EmConfig,
) -> Result<Em, LearnError> {
    let given = valid.get();
    let completed = Completed::of(demonstrations, given)?;
    let statistics = Statistics::of(&completed, config.directions)?;
    let mut state = State::start(&completed, &statistics)?;
    let enough = config.tolerance * statistics.numbers();
    let mut log_likelihoods: Vec<f64> = Vec::new();
    let mut converged = false;
    let posterior = loop {
        let posterior = state.expect(&statistics)?;
        let log = posterior.log_likelihood + completed.log_units(&statistics);
        let before = log_likelihoods.last().copied();
        log_likelihoods.push(log);
        converged = converged || before.is_some_and(|before| log - before < enough);
        if converged || log_likelihoods.len() > config.steps {
            break posterior;
        }
        state = state.maximise(&statistics, &posterior)?;
    };
    let model = assemble::model(completed, &statistics, &state, &posterior, given)?;
    Ok(Em {
        model,
        log_likelihoods,
        converged,
    })
}
