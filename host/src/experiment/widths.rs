//! How wide 95 % intervals must be, found on the demonstrations alone.
//!
//! A covariance that thirty demonstrations gave was drawn towards a diagonal, and what the basis leaves is taken for
//! independent noise: an interval read off the model is only nominal. So each demonstration is left out in turn, asked
//! about in the way that new motions will be, and the intervals are scaled, per DoF, until they hold 95 % of what was
//! recorded of the ones left out (the jackknife of conformal prediction: Barber et al. 2021). New motions have no part
//! in it.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::bands::{centre_and_half, infer};
use super::look::Look;
use super::{ExperimentError, data};
use crate::demonstration::Demonstration;
use crate::model::recognise::Recogniser;
use crate::model::{Model, learn};
use crate::session::DOFS;

/// Factor on the half-width of each DoF's interval.
pub(super) type Widths = [f64; DOFS.len()];
/// Intervals as the model has them.
pub(super) const NOMINAL: Widths = [1.0; DOFS.len()];
/// Share of recorded values that an interval is to hold.
const HELD: f64 = 0.95;

/// A model without each demonstration of one skill.
pub(super) struct LeftOut<'d> {
    demonstrations: &'d [Demonstration],
    models: Vec<Model>,
    seed: u64,
}

impl<'d> LeftOut<'d> {
    /// Learns without each demonstration, with the shrinkage and degrees of freedom of `model`, which was learnt from all.
    pub(super) fn learn(
        demonstrations: &'d [Demonstration],
        model: &Model,
        seed: u64,
    ) -> Result<Self, ExperimentError> {
        let valid = data::as_chosen(model)?;
        let without = |left_out: usize| {
            let (before, after) = demonstrations.split_at(left_out);
            let others: Vec<_> = before.iter().chain(after.iter().skip(1)).cloned().collect();
            Ok(learn(&others, &valid)?)
        };
        let models = (0..demonstrations.len()).map(without);
        Ok(Self {
            demonstrations,
            models: models.collect::<Result<_, ExperimentError>>()?,
            seed,
        })
    }

    /// Widths for what `look` observes.
    pub(super) fn widths(&self, look: &Look) -> Result<Widths, ExperimentError> {
        let mut noise = ChaCha8Rng::seed_from_u64(self.seed);
        let mut off: Vec<Vec<f64>> = vec![Vec::new(); DOFS.len()];
        for (model, movement) in self.models.iter().zip(self.demonstrations) {
            let view = model.view()?;
            let mut recogniser = Recogniser::new(model, &view)?;
            look.observe(&mut recogniser, &look.of(movement, &mut noise))?;
            let bands = infer(&mut recogniser, (0, &NOMINAL), movement)?;
            for ((band, dof), off) in bands.iter().zip(model.dofs()).zip(&mut off) {
                for ((low, high), truth) in band.low.iter().zip(&band.high).zip(&band.truth) {
                    let (centre, half) = centre_and_half(dof, (*low, *high));
                    off.push((dof.encode(*truth).unwrap_or(f64::NAN) - centre).abs() / half);
                }
            }
        }
        Ok(std::array::from_fn(|dof| quantile(&mut off[dof])))
    }
}

/// The value that [`HELD`] of them do not exceed; one without values.
fn quantile(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    let rank = (HELD * values.len() as f64).ceil() as usize;
    values.get(rank.saturating_sub(1)).copied().unwrap_or(1.0)
}
