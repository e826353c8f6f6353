//! Many settings, each watching in one of four ways, as one recogniser: decided on the training part alone.

use rayon::prelude::*;
use serde::Serialize;

use super::super::data::Set;
use super::super::look::floored;
use super::super::parts::{Fold, Part};
use super::super::setting::{Phase, Setting, Ways};
use super::followed::{Follower, Late, Watch};
use super::moments::{Moment, demonstration, moments};
use super::{Onset, Said};
use crate::experiment::ExperimentError;
use crate::model::stacking::{LAPLACE, mixed, shares};
use crate::model::{Model, learn};

/// What may be watched together.
const WATCHES: [&[Watch]; 6] = {
    use Phase::{Path, Time};
    [
        &[Watch::hand(Time)],
        &[Watch::hand(Path)],
        &[Watch::hand(Time), Watch::hand(Path)],
        &[Watch::hand(Time), Watch::hand(Path), Watch::arm(Path)],
        &[
            Watch::hand(Time),
            Watch::hand(Path),
            Watch::arm(Path),
            Watch::arm(Time),
        ],
        &[Watch::hand(Path), Watch::arm(Path)],
    ]
};
const FUNCTIONS: [usize; 3] = [8, 12, 20];
const PLACEMENTS_M: [f64; 3] = [0.1, 0.2, 0.3];
const SIGMAS_M: [f64; 4] = [0.01, 0.02, 0.05, 0.1];
const RIDGE: f64 = 1e-1;

/// What was decided on one training part.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct InRuns {
    /// Which part.
    pub part: String,
    /// What may be watched, and how it does on what is left out in turn.
    pub tried: Vec<Tried>,
    /// Which of these is taken: the least log-loss.
    pub watched: usize,
    /// What answers together, the heaviest first.
    pub mixture: Vec<Candidate>,
}

/// One choice of what is watched.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Tried {
    /// In words.
    pub name: String,
    /// It.
    pub watches: Vec<Watch>,
    /// Mean of minus the log probability of the true action after 30, 50, 100 %, nats, models and weights both without what is
    /// left out.
    pub log_loss: f64,
}

/// One setting of a mixture.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Candidate {
    /// What is watched.
    #[serde(flatten)]
    pub watch: Watch,
    /// Basis functions of each DoF.
    pub functions: usize,
    /// Where somebody may stand, metres.
    pub placement_m: f64,
    /// Noise that the recogniser assumes, metres.
    pub sigma_m: f64,
    /// Stacking weight.
    pub weight: f64,
}

impl Candidate {
    /// All with what is watched in any way, weights zero; those that need the same model stand together.
    fn all() -> Vec<Self> {
        let widest = WATCHES.iter().max_by_key(|watches| watches.len());
        let watches = widest.into_iter().flat_map(|watches| watches.iter());
        let mut all = Vec::new();
        for &watch in watches {
            for functions in FUNCTIONS {
                for placement_m in PLACEMENTS_M {
                    all.extend(SIGMAS_M.map(|sigma_m| Self {
                        watch,
                        functions,
                        placement_m,
                        sigma_m,
                        weight: 0.0,
                    }));
                }
            }
        }
        all
    }

    fn learn(&self, set: &Set, learned: &[usize]) -> Result<Model, ExperimentError> {
        let setting = Setting {
            ways: Ways::One,
            phase: self.watch.phase,
            functions: self.functions,
            ridge: RIDGE,
            placement_m: self.placement_m,
            shares: None,
            freedom: None,
        };
        let demonstrations = learned.iter().map(|&i| demonstration(set, i, self.watch));
        let demonstrations = demonstrations.collect::<Result<Vec<_>, _>>()?;
        Ok(learn(&demonstrations, &setting.valid(self.watch.dofs())?)?)
    }

    fn same_model(&self, other: &Self) -> bool {
        let of = |one: &Self| (one.watch, one.functions, one.placement_m);
        of(self) == of(other)
    }
}

/// What a candidate says of a movement after each of the fractions.
type Posteriors = [Vec<f64>; 3];

/// A movement to be recognised.
struct Shown {
    moments: Vec<Moment>,
    span_s: (f64, f64),
}

impl Shown {
    /// The leads of these movements are by their place among them.
    fn all(set: &Set, movements: &[usize]) -> Vec<Self> {
        let seeded = movements.iter().zip(1..);
        let shown = |(&movement, seed): (&usize, u64)| {
            let shape = &set.demonstrations()[movement];
            Self {
                moments: moments(set, movement, seed),
                span_s: (shape.t_s()[0], shape.duration_s()),
            }
        };
        seeded.map(shown).collect()
    }
}

/// A mixture of candidates.
#[derive(Debug)]
pub(in super::super) struct Stack {
    late: Late,
    pub(super) chosen: InRuns,
}

impl Stack {
    /// What is watched, and the weights, by what is left out of the training part in turn.
    pub(super) fn of(set: &Set, part: &Part) -> Result<Self, ExperimentError> {
        let late = Late::of(set, &part.training)?;
        let all = Candidate::all();
        let left_out = LeftOut::of(set, part, late, &all)?;
        let mut tried = Vec::with_capacity(WATCHES.len());
        for watches in WATCHES {
            let some = left_out.some(&all, watches);
            let names: Vec<String> = watches.iter().map(Watch::to_string).collect();
            tried.push(Tried {
                name: names.join(", "),
                watches: watches.to_vec(),
                log_loss: some.log_loss()?,
            });
        }
        let losses = tried.iter().map(|one| one.log_loss).enumerate();
        let watched = losses.min_by(|one, other| one.1.total_cmp(&other.1));
        let watched = watched.map_or(0, |(watched, _)| watched);
        let watches = WATCHES[watched];
        let weights = shares(&left_out.some(&all, watches).logs, LAPLACE)?;
        let mixture = all.into_iter().filter(|one| watches.contains(&one.watch));
        let mixture = mixture.zip(weights);
        let mixture = mixture.map(|(one, weight)| Candidate { weight, ..one });
        let mut mixture: Vec<_> = mixture.filter(|one| one.weight > 0.0).collect();
        mixture.sort_by(|one, other| other.weight.total_cmp(&one.weight));
        let chosen = InRuns {
            part: part.name.clone(),
            tried,
            watched,
            mixture,
        };
        Ok(Self { late, chosen })
    }

    /// What is said of a fold's movements by models of its others.
    pub(super) fn said(&self, set: &Set, fold: &Fold) -> Result<Said, ExperimentError> {
        let mixture = &self.chosen.mixture;
        let shown = Shown::all(set, &fold.tested);
        let follow = |one: &Candidate| -> Result<_, ExperimentError> {
            let model = one.learn(set, &fold.learned)?;
            let of_movements = posteriors(&model, self.late, one, &shown)?;
            Ok((model.labels().to_vec(), of_movements))
        };
        let each: Result<Vec<_>, ExperimentError> = mixture.par_iter().map(follow).collect();
        let each = each?;
        let weights: Vec<f64> = mixture.iter().map(|one| one.weight).collect();
        let labels = each.first().map(|(labels, _)| labels.as_slice());
        let mut said = Said::none(Onset::Detected);
        for (place, &movement) in fold.tested.iter().enumerate() {
            let mut together = [const { Vec::new() }; 3];
            for (part, together) in together.iter_mut().enumerate() {
                let posteriors = each.iter().map(|(_, all)| all[place][part].clone());
                *together = mixed(&weights, &posteriors.collect::<Vec<_>>())?;
            }
            let class = set.demonstrations()[movement].class();
            said.take(labels.unwrap_or_default(), together, class);
        }
        Ok(said)
    }
}

fn posteriors<'s>(
    model: &Model,
    late: Late,
    one: &Candidate,
    shown: impl IntoIterator<Item = &'s Shown>,
) -> Result<Vec<Posteriors>, ExperimentError> {
    let view = model.view()?;
    let mut follower = Follower::new(model, &view, late, one.watch, one.sigma_m)?;
    let mut of_movements = Vec::new();
    for shown in shown {
        let mut said = follower.follow(&shown.moments, shown.span_s)?;
        // Rounding makes what is certain a little more than that.
        for log in said.iter_mut().flatten() {
            *log = log.min(0.0);
        }
        of_movements.push(said);
    }
    Ok(of_movements)
}

/// Log probability that each candidate gives to what is left out.
struct LeftOut {
    /// `logs[candidate][forecast]`, fold after fold.
    logs: Vec<Vec<f64>>,
    /// Forecasts of each fold.
    counts: Vec<usize>,
}

impl LeftOut {
    fn of(set: &Set, part: &Part, late: Late, all: &[Candidate]) -> Result<Self, ExperimentError> {
        let shown = Shown::all(set, &part.training);
        let models: Vec<&[Candidate]> = all.chunk_by(Candidate::same_model).collect();
        let jobs: Vec<_> = models
            .iter()
            .flat_map(|candidates| part.folds.iter().map(move |fold| (*candidates, fold)))
            .collect();
        let one = |&(candidates, fold): &(&[Candidate], &Fold)| {
            let model = candidates[0].learn(set, &fold.learned)?;
            let places = fold.tested.iter();
            let places = places.filter_map(|i| part.training.iter().position(|own| own == i));
            let places: Vec<usize> = places.collect();
            let truth = |place: usize| {
                let class = set.demonstrations()[part.training[place]].class();
                model.skill(class)
            };
            let mut logs = Vec::with_capacity(candidates.len());
            for candidate in candidates {
                let shown = places.iter().map(|&place| &shown[place]);
                let said = posteriors(&model, late, candidate, shown)?;
                let own = places.iter().zip(said).flat_map(|(&place, said)| {
                    let own = truth(place);
                    said.map(|posterior| {
                        let log = own.and_then(|skill| posterior.get(skill).copied());
                        floored(log.unwrap_or(f64::NEG_INFINITY)).min(0.0)
                    })
                });
                logs.push(own.collect::<Vec<f64>>());
            }
            Ok(logs)
        };
        let done: Result<Vec<Vec<Vec<f64>>>, ExperimentError> = jobs.par_iter().map(one).collect();
        let mut logs = vec![Vec::new(); all.len()];
        let done = done?;
        let mut first = 0;
        for (candidates, folds) in models.iter().zip(done.chunks(part.folds.len())) {
            for fold in folds {
                for (logs, own) in logs[first..].iter_mut().zip(fold) {
                    logs.extend(own);
                }
            }
            first += candidates.len();
        }
        let counts = part.folds.iter().map(|fold| 3 * fold.tested.len());
        Ok(Self {
            logs,
            counts: counts.collect(),
        })
    }

    /// Of those that watch so.
    fn some(&self, all: &[Candidate], watches: &[Watch]) -> Self {
        let own = all.iter().zip(&self.logs);
        let own = own.filter(|(one, _)| watches.contains(&one.watch));
        Self {
            logs: own.map(|(_, logs)| logs.clone()).collect(),
            counts: self.counts.clone(),
        }
    }

    /// Mean of the mixture's, each fold's with weights found without it.
    fn log_loss(&self) -> Result<f64, ExperimentError> {
        let mut sum = 0.0;
        let mut first = 0;
        for count in &self.counts {
            let fold = first..first + count;
            first = fold.end;
            let mut others = self.logs.clone();
            let own = others
                .iter_mut()
                .map(|logs| logs.drain(fold.clone()).collect());
            let own: Vec<Vec<f64>> = own.collect();
            let weights = shares(&others, LAPLACE)?;
            sum -= mixed(&weights, &own)?.iter().sum::<f64>();
        }
        Ok(sum / first as f64)
    }
}
