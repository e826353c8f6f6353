//! Recognition by the product of time marginals: equation 19, which is about one instant, multiplied over instants
//! and DoFs as if they were independent.
//!
//! ```text
//! log p(q) + sum_t sum_d log N(y_d(t); psi(t)^T mu_q, psi(t)^T Sigma_q psi(t) + R)
//! ```
//!
//! A common reading of the paper's equation. One movement's observations are correlated, so the same evidence counts
//! many times over: the answer is often right and its probability is not. What follows from the answer (the
//! movement of the skill decided for) is that of the joint conditioning.

use tonus_shared::promp::{Row, Trajectory, trajectory_scratch_len};

use super::{Answer, BaselineError, Observed, Primitives, largest, normalised};
use crate::model::recognise::Recogniser;

/// `ln(2 pi)`.
const LN_TWO_PI: f64 = 1.837_877_066_409_345_5;

/// Recognises by marginals with `model`, and predicts with the skill decided for.
///
/// # Errors
/// As [`Primitives::answer`].
pub fn answer(
    model: &Primitives,
    observed: &Observed,
    phases: &[f64],
) -> Result<Answer, BaselineError> {
    let view = model.0.view()?;
    let mut recogniser = Recogniser::new(&model.0, &view)?;
    let latent = view.latent;
    let mut scratch = vec![0.0; trajectory_scratch_len(latent.basis().count(), latent.rank())];
    let mut log_joint = Vec::with_capacity(view.skills.len());
    for (skill, freedom) in view.skills.iter().zip(&model.0.parts().freedom) {
        let prior = Trajectory::prior(latent, *skill)?;
        let mut sum = skill.log_prior();
        for (dof, phase, value, std) in observed.each() {
            let signal = model.0.dofs().get(dof).ok_or(BaselineError::Protocol {
                what: "an observed DoF that there is not",
                wanted: "indices of the protocol's DoFs",
            })?;
            let expected = prior.moments(&Row::position(dof, phase), &mut scratch)?;
            let noise = signal.encode_variance(value, std)?;
            let variance = expected.variance + noise + model.0.parts().residual_variance[dof];
            let error = signal.encode(value)? - expected.mean;
            sum += log_density(error, variance, *freedom);
        }
        log_joint.push(sum);
    }
    for (dof, phase, value, std) in observed.each() {
        recogniser.observe(dof, phase, value, std)?;
    }
    let log_posterior = normalised(&log_joint);
    let recognised = largest(&log_posterior);
    let paths = match recognised {
        Some(skill) => model.paths(&mut recogniser, skill, phases)?,
        None => Vec::new(),
    };
    Ok(Answer {
        log_posterior: Some(log_posterior),
        recognised,
        paths,
    })
}

/// Of an error of this variance: Gaussian, or Student-t as the skill is.
fn log_density(error: f64, variance: f64, freedom: Option<f64>) -> f64 {
    let Some(freedom) = freedom else {
        return -0.5 * (error * error / variance + libm::log(variance) + LN_TWO_PI);
    };
    let scale = variance * (freedom - 2.0);
    libm::lgamma(0.5 * (freedom + 1.0))
        - libm::lgamma(0.5 * freedom)
        - 0.5 * libm::log(core::f64::consts::PI * scale)
        - 0.5 * (freedom + 1.0) * libm::log1p(error * error / scale)
}
