//! How wide 95 % intervals must be, found on the demonstrations alone.
//!
//! A covariance that thirty demonstrations gave was drawn towards a diagonal, and what the basis leaves is taken for
//! independent noise: an interval read off the model is only nominal. So each demonstration is left out in turn, asked
//! about in the way that new motions will be, and the intervals are scaled, per DoF, until they hold 95 % of what was
//! recorded of the ones left out (the jackknife of conformal prediction: Barber et al. 2021). New motions have no part
//! in it.
//!
//! Of `n` independent values the one that a share `q` of them does not exceed is exceeded by the next with probability
//! `1 - q n / (n + 1)`, so `q` is raised by `(n + 1) / n`. The instants of one demonstration are not independent: `n` lies
//! between the demonstrations and all their instants, and is taken from how unevenly the misses fall on the demonstrations.

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
        // Of each DoF and each movement.
        let mut off: Vec<Vec<Vec<f64>>> = vec![Vec::new(); DOFS.len()];
        for (model, movement) in self.models.iter().zip(self.demonstrations) {
            let view = model.view()?;
            let mut recogniser = Recogniser::new(model, &view)?;
            look.observe(&mut recogniser, &look.of(movement, &mut noise))?;
            let bands = infer(&mut recogniser, (0, &NOMINAL), movement)?;
            for ((band, dof), off) in bands.iter().zip(model.dofs()).zip(&mut off) {
                let points = band.low.iter().zip(&band.high).zip(&band.truth);
                let point = |((low, high), truth): ((&f64, &f64), &f64)| {
                    let (centre, half) = centre_and_half(dof, (*low, *high));
                    (dof.encode(*truth).unwrap_or(f64::NAN) - centre).abs() / half
                };
                off.push(points.map(point).collect());
            }
        }
        Ok(std::array::from_fn(|dof| width(&off[dof])))
    }
}

/// The value that a next movement exceeds at `1 - HELD` of its instants, from the values of each movement left out.
fn width(movements: &[Vec<f64>]) -> f64 {
    let mut all: Vec<f64> = movements.iter().flatten().copied().collect();
    all.sort_by(f64::total_cmp);
    let first = quantile(&all, HELD);
    let missed = |of: &Vec<f64>| {
        let over = of.iter().filter(|value| **value > first).count();
        over as f64 / of.len().max(1) as f64
    };
    let shares: Vec<f64> = movements.iter().map(missed).collect();
    let least = shares.len() as f64;
    let mean = shares.iter().sum::<f64>() / least;
    let variance = shares
        .iter()
        .map(|share| (share - mean).powi(2))
        .sum::<f64>()
        / least;
    // The mean of `independent` draws of a miss would vary as the mean of these shares does.
    let most = (all.len() as f64).max(least);
    let independent = if variance > 0.0 {
        (least * mean * (1.0 - mean) / variance).clamp(least, most)
    } else {
        most
    };
    quantile(&all, HELD * (independent + 1.0) / independent)
}

/// The value that this share of them, sorted, does not exceed; one without values.
fn quantile(sorted: &[f64], share: f64) -> f64 {
    let rank = (share * sorted.len() as f64).ceil() as usize;
    let last = sorted.len().saturating_sub(1);
    sorted
        .get(rank.saturating_sub(1).min(last))
        .copied()
        .unwrap_or(1.0)
}

#[cfg(test)]
mod tests {
    use super::width;

    /// `instants` of each of forty movements that are all alike, or alike within each movement.
    fn ranked(movements: usize, instants: usize, alike: bool) -> Vec<Vec<f64>> {
        let of = |movement: usize| {
            let value = |instant: usize| {
                let place = if alike { 0 } else { instant };
                ((place * movements + movement) as f64 + 1.0) / (movements * instants) as f64
            };
            (0..instants).map(value).collect()
        };
        (0..movements).map(of).collect()
    }

    #[test]
    fn movements_that_miss_alone_count_once_each() {
        // Twenty values: the nineteenth is exceeded by a next one once in 21; asked for is the largest: 0.95 * 21 / 20.
        let found = width(&ranked(20, 50, true));
        assert_eq!(found, 20.0 / 1000.0);
    }

    #[test]
    fn independent_instants_need_no_more() {
        let found = width(&ranked(20, 50, false));
        assert!((found - 0.95).abs() < 0.002, "{found}");
    }
}
