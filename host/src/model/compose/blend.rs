//! Several plans at once.

use tonus_shared::promp::{Active, Blend, ComposeError, Quantity, Signal, blend_len};

use super::{Plan, PlanError, Planned, signal};

/// Share of a DoF's spread (its velocity's: per duration) that no skill of a blend minds.
const TOLERANCE: f64 = 1e-3;

/// A plan that takes part in a blend at an instant.
#[derive(Clone, Copy, Debug)]
pub struct Part<'p, 'm> {
    /// The plan. Its via-points count; its bridge does not, for a blend has no start of its own.
    pub plan: &'p Plan<'m>,
    /// How far it is.
    pub phase: f64,
    /// How much it counts, from 0; activations that sum to one blend, all at one co-activate.
    pub activation: f64,
}

/// What several plans agree on at one instant for these DoFs ([`Blend`]): positions and velocities
/// jointly, so that what is coupled stays coupled.
///
/// A skill's residual, and a thousandth of the DoF's spread, is what it does not mind.
///
/// # Errors
/// Plans of different models, a DoF that there is not, what [`Blend::at`] refuses.
pub fn blend(parts: &[Part<'_, '_>], dofs: &[usize]) -> Result<Vec<Planned>, PlanError> {
    let Some(first) = parts.first().map(|part| part.plan) else {
        return Err(ComposeError::Inactive.into());
    };
    let model = first.model;
    if parts
        .iter()
        .any(|part| !std::ptr::eq(part.plan.model, model))
    {
        return Err(PlanError::Models);
    }
    let mut signals = Vec::with_capacity(2 * dofs.len());
    for quantity in [Quantity::Position, Quantity::Velocity] {
        for &dof in dofs {
            signal(model, dof)?;
            let spread = TOLERANCE * model.parts().scale[dof];
            let residual = model.parts().residual_variance[dof];
            let tolerance = match quantity {
                Quantity::Position => spread * spread + residual,
                Quantity::Velocity => (spread / first.duration_s).powi(2),
            };
            signals.push(Signal {
                dof,
                quantity,
                tolerance,
            });
        }
    }
    let active = parts.iter().map(|part| {
        Ok(Active {
            trajectory: part.plan.trajectory()?,
            activation: part.activation,
            phase: part.phase,
            duration_s: part.plan.duration_s,
        })
    });
    let active = active.collect::<Result<Vec<_>, PlanError>>()?;
    let latent = &first.view.latent;
    let room = blend_len(signals.len(), latent.basis().count(), latent.rank());
    let mut product = Blend::new(&signals, vec![0.0; room])?;
    product.at(&active)?;
    let (mean, covariance) = (product.mean(), product.covariance());
    let answers = dofs.iter().enumerate().map(|(i, &dof)| {
        let dof = signal(model, dof)?;
        let (value, std) = dof.decode(mean[i], covariance[i * signals.len() + i]);
        Ok(Planned {
            mean: value,
            std,
            rate: dof.decode_rate(value, mean[dofs.len() + i]),
        })
    });
    answers.collect()
}
