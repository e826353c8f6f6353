//! The same mixture of ProMPs, stiffness never observed: what positions alone can tell.
//!
//! Interaction primitives without muscles, as Maeda et al. (2017, *Probabilistic movement primitives for coordination
//! of multiple human-robot collaborative tasks*, Autonomous Robots 41) have them. Stiffness is still learnt and
//! inferred, from positions.

use super::{Answer, BaselineError, Observed, Primitives};

/// Recognises and predicts with `model` from the observed positions alone.
///
/// # Errors
/// As [`Primitives::answer`].
pub fn answer(
    model: &Primitives,
    observed: &Observed,
    phases: &[f64],
) -> Result<Answer, BaselineError> {
    let dofs = model.0.dofs();
    let positions = observed.only(|dof| dofs.get(dof).is_some_and(crate::model::Dof::is_position));
    model.answer(&positions, phases)
}
