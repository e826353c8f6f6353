//! What is chosen on a training part alone.

use std::collections::BTreeMap;

use rayon::prelude::*;
use serde::Serialize;

use super::FRACTIONS;
use super::data::Set;
use super::look::Look;
use super::parts::{Fold, Part};
use super::setting::{Choice, Setting};
use crate::experiment::ExperimentError;
use crate::model::calibration::{Forecast, Temperature, log_loss};
use crate::model::recognise::Recogniser;

/// Rounds over all decisions.
const ROUNDS: usize = 2;

/// What was decided on one training part.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Chosen {
    /// Which part.
    pub part: String,
    /// What was decided before learning.
    #[serde(flatten)]
    pub setting: Setting,
    /// Noise that the recogniser assumes of positions, metres.
    pub sigma_m: f64,
    /// Temperature of the posterior after the first 20, 30, 50, 100 % of the movement.
    pub temperatures: Vec<f64>,
    /// The same.
    #[serde(skip)]
    pub(super) softening: [Temperature; 4],
}

impl Chosen {
    /// The temperature for a part of the movement: that of the next larger part it was fitted for.
    pub(super) fn temperature(&self, fraction: f64) -> Temperature {
        let place = FRACTIONS.iter().position(|f| *f >= fraction - 1e-9);
        self.softening[place.unwrap_or(FRACTIONS.len() - 1)]
    }
}

/// For each part.
pub(super) fn each(set: &Set, parts: &[Part]) -> Result<Vec<Chosen>, ExperimentError> {
    parts.par_iter().map(|part| choose(set, part)).collect()
}

/// The setting of least log-loss of what is left out in turn, one decision after the other, each at its best given the
/// rest. Temperatures come after: a setting that is only good once it is mended is a worse guess elsewhere.
fn choose(set: &Set, part: &Part) -> Result<Chosen, ExperimentError> {
    let grid = &set.plan.grid;
    let sizes = grid.sizes();
    let mut known: BTreeMap<Choice, (f64, f64)> = BTreeMap::new();
    let mut best = Choice::default();
    for _ in 0..ROUNDS {
        let before = best;
        for (decision, &values) in sizes.iter().enumerate() {
            let mut found: Option<(f64, Choice)> = None;
            for value in 0..values {
                let mut choice = best;
                choice[decision] = value;
                let loss = match known.get(&choice) {
                    Some((loss, _)) => *loss,
                    None => {
                        let tried = tried(set, &grid.setting(&choice), &part.folds)?;
                        known.insert(choice, tried);
                        tried.0
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
    let setting = grid.setting(&best);
    let sigma_m = known
        .get(&best)
        .map_or(grid.sigmas_m[0], |(_, sigma_m)| *sigma_m);
    let softening = temperatures(set, &setting, sigma_m, &part.folds)?;
    Ok(Chosen {
        part: part.name.clone(),
        setting,
        sigma_m,
        temperatures: softening.iter().map(|t| t.get()).collect(),
        softening,
    })
}

/// Least loss of a setting over the noises that may be assumed, and that noise.
fn tried(set: &Set, setting: &Setting, folds: &[Fold]) -> Result<(f64, f64), ExperimentError> {
    let grid = &set.plan.grid;
    let pairs = grid.sigmas_m.iter();
    let pairs: Vec<(f64, f64)> = pairs
        .flat_map(|&sigma_m| {
            grid.fractions
                .iter()
                .map(move |&fraction| (sigma_m, fraction))
        })
        .collect();
    let forecasts = left_out(set, setting, folds, &pairs)?;
    let mut best = (f64::INFINITY, grid.sigmas_m[0]);
    for (&sigma_m, of_sigma) in grid
        .sigmas_m
        .iter()
        .zip(forecasts.chunks(grid.fractions.len()))
    {
        let mut loss = 0.0;
        for forecasts in of_sigma {
            loss += log_loss(forecasts)?;
        }
        if loss < best.0 {
            best = (loss, sigma_m);
        }
    }
    Ok(best)
}

fn temperatures(
    set: &Set,
    setting: &Setting,
    sigma_m: f64,
    folds: &[Fold],
) -> Result<[Temperature; 4], ExperimentError> {
    let pairs = FRACTIONS.map(|fraction| (sigma_m, fraction));
    let forecasts = left_out(set, setting, folds, &pairs)?;
    let mut temperatures = [Temperature::ONE; 4];
    for (temperature, forecasts) in temperatures.iter_mut().zip(&forecasts) {
        *temperature = Temperature::fit(forecasts)?;
    }
    Ok(temperatures)
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
                sigma_m,
                noise_m: 0.0,
                seed: 0,
            };
            let movements = fold.tested.iter().map(|&i| &set.at(setting.phase)[i]);
            movements
                .map(|movement| look.forecast(&mut recogniser, movement))
                .collect()
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
