//! What is chosen on a training part alone.

use std::collections::BTreeMap;

use rayon::prelude::*;
use serde::Serialize;

use super::FRACTIONS;
use super::data::Set;
use super::look::{Look, floored};
use super::mixture::{mixed, over_classes};
use super::parts::{Fold, Part};
use super::setting::{Choice, Setting};
use crate::experiment::ExperimentError;
use crate::model::calibration::{Forecast, Temperature, Tempering, log_loss};
use crate::model::recognise::Recogniser;
use crate::model::stacking::{LAPLACE, shares};

/// Rounds over all decisions.
const ROUNDS: usize = 2;
/// Settings of a lower weight are not learnt.
const LEAST_WEIGHT: f64 = 0.02;

/// What was decided on one training part.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Chosen {
    /// Which part.
    pub part: String,
    /// What answers together, the heaviest first.
    pub mixture: Vec<Member>,
    /// Temperature (one over the mean inverse) of the mixed posterior after the first 20, 30, 50, 100 % of the movement.
    pub temperatures: Vec<f64>,
    /// All that are possible there.
    #[serde(skip)]
    pub(super) softening: Vec<Tempering>,
}

/// One setting of a mixture.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Member {
    /// What was decided before learning.
    #[serde(flatten)]
    pub setting: Setting,
    /// Noise that the recogniser assumes of positions, metres.
    pub sigma_m: f64,
    /// Stacking weight over all parts of the movement that were chosen on; where nobody knows how much was seen.
    pub weight: f64,
    /// Stacking weights after the first 20, 30, 50, 100 % of the movement.
    pub weights: Vec<f64>,
    /// Temperatures of its own posterior there, before it is mixed.
    pub temperatures: Vec<f64>,
    /// All that are possible there.
    #[serde(skip)]
    pub(super) softening: Vec<Tempering>,
}

impl Chosen {
    /// Where the weights and the temperature for a part of the movement are: those of the next larger part that they
    /// were fitted for.
    pub(super) fn place(fraction: f64) -> usize {
        let place = FRACTIONS.iter().position(|f| *f >= fraction - 1e-9);
        place.unwrap_or(FRACTIONS.len() - 1)
    }

    /// What tempers the mixture after a part of the movement.
    pub(super) fn tempering(&self, fraction: f64) -> &Tempering {
        &self.softening[Self::place(fraction)]
    }

    /// The heaviest setting.
    pub(super) fn heaviest(&self) -> &Member {
        &self.mixture[0]
    }
}

/// For each part.
pub(super) fn each(set: &Set, parts: &[Part]) -> Result<Vec<Chosen>, ExperimentError> {
    parts.par_iter().map(|part| choose(set, part)).collect()
}

/// Forecasts of what is left out, for each noise and then each part of the movement of the grid.
type Known = BTreeMap<Choice, Vec<Vec<Forecast>>>;

/// Every setting that the search has looked at, with each noise, gets its weight in a mixture of least log-loss of what
/// is left out in turn; those with one are weighed again after each part of the movement. Each is tempered before, for one
/// that is too sure of itself would weigh little however often it is right, and the mixture afterwards. What is left out of
/// a training part is little (24 to 150 forecasts), so both are averaged over the temperatures that it leaves possible.
fn choose(set: &Set, part: &Part) -> Result<Chosen, ExperimentError> {
    let mut mixture = stacked(set, &search(set, &part.folds)?)?;
    let mut of_members = Vec::with_capacity(mixture.len());
    for member in &mixture {
        let pairs = FRACTIONS.map(|fraction| (member.sigma_m, fraction));
        of_members.push(left_out(set, &member.setting, &part.folds, &pairs)?);
    }
    let mut softening = Vec::with_capacity(FRACTIONS.len());
    for place in 0..FRACTIONS.len() {
        let mut softened = Vec::with_capacity(mixture.len());
        for (member, at_fractions) in mixture.iter_mut().zip(&of_members) {
            let own = Tempering::fit(&at_fractions[place])?;
            let forecasts = at_fractions[place].iter();
            softened.push(forecasts.map(|f| own.softened(f)).collect::<Vec<_>>());
            member.temperatures.push(own.temperature());
            member.softening.push(own);
        }
        let own: Vec<Vec<f64>> = softened.iter().map(|all| truths(all)).collect();
        let weights = shares(&own, LAPLACE)?;
        let together = (0..own[0].len()).map(|i| {
            let posteriors = softened.iter().map(|all| all[i].log_posterior().to_vec());
            let posteriors: Vec<_> = posteriors.collect();
            mixed(&weights, &posteriors, softened[0][i].truth())
        });
        let together = together.collect::<Result<Vec<_>, ExperimentError>>()?;
        softening.push(Tempering::fit(&together)?);
        for (member, weight) in mixture.iter_mut().zip(weights) {
            member.weights.push(weight);
        }
    }
    Ok(Chosen {
        part: part.name.clone(),
        mixture,
        temperatures: softening.iter().map(Tempering::temperature).collect(),
        softening,
    })
}

/// Looks for the setting of least log-loss, one decision after the other, each at its best given the rest; what it looked
/// at.
fn search(set: &Set, folds: &[Fold]) -> Result<Known, ExperimentError> {
    let grid = &set.plan.grid;
    let pairs: Vec<(f64, f64)> = grid
        .sigmas_m
        .iter()
        .flat_map(|&sigma_m| grid.fractions.iter().map(move |&f| (sigma_m, f)))
        .collect();
    let mut known = Known::new();
    let mut losses: BTreeMap<Choice, f64> = BTreeMap::new();
    let mut best = Choice::default();
    for _ in 0..ROUNDS {
        let before = best;
        for (decision, &values) in grid.sizes().iter().enumerate() {
            let mut found: Option<(f64, Choice)> = None;
            for value in 0..values {
                let mut choice = best;
                choice[decision] = value;
                let loss = match losses.get(&choice) {
                    Some(loss) => *loss,
                    None => {
                        let forecasts = left_out(set, &grid.setting(&choice), folds, &pairs)?;
                        let loss = least_loss(&forecasts, grid.fractions.len())?;
                        known.insert(choice, forecasts);
                        losses.insert(choice, loss);
                        loss
                    }
                };
                if found.is_none_or(|(least, _)| loss < least) {
                    found = Some((loss, choice));
                }
            }
            best = found.map_or(best, |(_, choice)| choice);
        }
        if best == before {
            break;
        }
    }
    Ok(known)
}

/// Over the noises that may be assumed; log-losses of the parts of the movement are added up.
fn least_loss(forecasts: &[Vec<Forecast>], fractions: usize) -> Result<f64, ExperimentError> {
    let mut least = f64::INFINITY;
    for of_sigma in forecasts.chunks(fractions) {
        let mut loss = 0.0;
        for forecasts in of_sigma {
            loss += log_loss(forecasts)?;
        }
        least = least.min(loss);
    }
    Ok(least)
}

/// Settings with a weight over all parts of the movement together, heaviest first.
fn stacked(set: &Set, known: &Known) -> Result<Vec<Member>, ExperimentError> {
    let grid = &set.plan.grid;
    let mut candidates = Vec::new();
    for (choice, forecasts) in known {
        let of_sigmas = forecasts.chunks(grid.fractions.len());
        for (&sigma_m, of_sigma) in grid.sigmas_m.iter().zip(of_sigmas) {
            let mut own = Vec::new();
            for all in of_sigma {
                own.extend(truths(&all_softened(Temperature::fit(all)?, all)));
            }
            candidates.push((grid.setting(choice), sigma_m, own));
        }
    }
    let weigh = |candidates: &[(Setting, f64, Vec<f64>)], prior| {
        let own: Vec<Vec<f64>> = candidates.iter().map(|c| c.2.clone()).collect();
        shares(&own, prior)
    };
    let mut heavy = weigh(&candidates, 0.0)?
        .into_iter()
        .map(|weight| weight >= LEAST_WEIGHT);
    candidates.retain(|_| heavy.next().unwrap_or(false));
    let weights = weigh(&candidates, LAPLACE)?;
    let pairs = candidates.into_iter().zip(weights);
    let mut members: Vec<Member> = pairs
        .map(|((setting, sigma_m, _), weight)| Member {
            setting,
            sigma_m,
            weight,
            weights: Vec::with_capacity(FRACTIONS.len()),
            temperatures: Vec::with_capacity(FRACTIONS.len()),
            softening: Vec::with_capacity(FRACTIONS.len()),
        })
        .collect();
    members.sort_by(|one, other| other.weight.total_cmp(&one.weight));
    Ok(members)
}

fn all_softened(temperature: Temperature, forecasts: &[Forecast]) -> Vec<Forecast> {
    let softened = |forecast| temperature.softened(forecast);
    forecasts.iter().map(softened).collect()
}

/// Log probabilities given to what was true.
fn truths(forecasts: &[Forecast]) -> Vec<f64> {
    let own = |forecast: &Forecast| floored(forecast.log_posterior()[forecast.truth()]).min(0.0);
    forecasts.iter().map(own).collect()
}

/// Forecasts of what each fold leaves out, by models of the rest, for each noise and part of the movement.
fn left_out(
    set: &Set,
    setting: &Setting,
    folds: &[Fold],
    pairs: &[(f64, f64)],
) -> Result<Vec<Vec<Forecast>>, ExperimentError> {
    let of_fold = |fold: &Fold| -> Result<Vec<Vec<Forecast>>, ExperimentError> {
        let model = set.learn(setting, &fold.learned)?;
        let view = model.view()?;
        let mut recogniser = Recogniser::new(&model, &view)?;
        let mut of_pair = |&(sigma_m, fraction): &(f64, f64)| {
            let look = Look {
                observations: set.plan.observations,
                fraction,
                noise_m: 0.0,
                seed: 0,
            };
            let one = |&i: &usize| -> Result<Forecast, ExperimentError> {
                let movement = &set.at(setting.phase)[i];
                look.watch(&mut recogniser, sigma_m, movement, |_, _| Ok(()))?;
                let (posterior, truth) = over_classes(&recogniser, movement)?;
                Ok(Forecast::new(posterior, truth)?)
            };
            fold.tested.iter().map(one).collect()
        };
        pairs.iter().map(&mut of_pair).collect()
    };
    let of_folds: Result<Vec<_>, _> = folds.par_iter().map(of_fold).collect();
    let mut all = vec![Vec::new(); pairs.len()];
    for of_fold in of_folds? {
        for (all, forecasts) in all.iter_mut().zip(of_fold) {
            all.extend(forecasts);
        }
    }
    Ok(all)
}
