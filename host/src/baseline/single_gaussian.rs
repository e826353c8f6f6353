//! One Gaussian ProMP over the demonstrations of all skills: the grey band of the paper's figures.
//!
//! Paraschos et al. (2013, *Probabilistic movement primitives*, NIPS). It knows no skills, so it recognises nothing,
//! and between two ways of doing something its mean is neither.

use super::{Answer, BaselineError, Observed, Primitives};
use crate::demonstration::Demonstration;
use crate::model::Valid;

/// Learns one Gaussian from all demonstrations, whatever their labels.
///
/// # Errors
/// As [`Primitives::learn`].
pub fn learn(train: &[Demonstration], valid: &Valid) -> Result<Primitives, BaselineError> {
    let mut alike = Vec::with_capacity(train.len());
    for one in train {
        let same = Demonstration::new(
            "everything",
            one.trial(),
            one.file(),
            one.t_s().to_vec(),
            one.values().to_vec(),
        );
        // A copy of a demonstration is one.
        alike.push(same.map_err(|_| BaselineError::None("learn from"))?);
    }
    Primitives::learn(&alike, valid)
}

/// Predicts; recognises nothing.
///
/// # Errors
/// As [`Primitives::answer`].
pub fn answer(
    model: &Primitives,
    observed: &Observed,
    phases: &[f64],
) -> Result<Answer, BaselineError> {
    let Answer { paths, .. } = model.answer(observed, phases)?;
    Ok(Answer {
        log_posterior: None,
        recognised: None,
        paths,
    })
}
