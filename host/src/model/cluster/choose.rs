//! How many components.

use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use super::component::log_completed;
use super::em::{Data, Fit};
use super::start::{Metric, start};
use super::{Candidate, ClusterConfig, ClusterError};

/// Fewer unlabelled demonstrations are not held out.
const LEAST_HELD_OUT: usize = 4;

pub(super) struct Chosen {
    pub(super) fit: Fit,
    pub(super) table: Vec<Candidate>,
}

/// A candidate, what it makes of all points, and of each held-out one.
struct Tried {
    candidate: Candidate,
    fit: Fit,
    held_out: Vec<f64>,
}

/// Tries every number of components, with tied and with own covariances.
pub(super) fn choose(data: Data<'_>, config: &ClusterConfig) -> Result<Chosen, ClusterError> {
    let folds = folds(data.labels, config);
    let least = config.least_components.max(data.classes);
    let most = config.most_components.max(least);
    let mut tried = Vec::new();
    for components in least..=most {
        // Unlabelled components need two points each.
        let free = data.labels.iter().filter(|label| label.is_none()).count();
        if components > least && free < 2 * (components - data.classes) {
            break;
        }
        tried.extend(try_count(data, components, &folds, config)?);
    }
    let table: Vec<Candidate> = tried.iter().map(|one| one.candidate).collect();
    let chosen = fewest(&tried, config.standard_errors);
    let nothing = ClusterError::Numerical("choice of the number of components");
    let fit = tried.into_iter().nth(chosen).ok_or(nothing)?.fit;
    Ok(Chosen { fit, table })
}

/// The unlabelled points of each fold.
fn folds(labels: &[Option<usize>], config: &ClusterConfig) -> Vec<Vec<usize>> {
    let mut free: Vec<usize> = (0..labels.len()).filter(|&i| labels[i].is_none()).collect();
    if free.len() < LEAST_HELD_OUT {
        return Vec::new();
    }
    free.shuffle(&mut ChaCha8Rng::seed_from_u64(config.seed));
    let count = config.folds.min(free.len());
    let mut folds = vec![Vec::new(); count];
    for (turn, i) in free.into_iter().enumerate() {
        folds[turn % count].push(i);
    }
    folds
}

fn try_count(
    data: Data<'_>,
    components: usize,
    folds: &[Vec<usize>],
    config: &ClusterConfig,
) -> Result<[Tried; 2], ClusterError> {
    let mut rng = ChaCha8Rng::seed_from_u64(config.seed);
    rng.set_stream(components as u64);
    let mut held_out = [Vec::new(), Vec::new()];
    for fold in folds {
        let rest: Vec<usize> = (0..data.labels.len())
            .filter(|i| !fold.contains(i))
            .collect();
        let space = data.space.select(&rest);
        let labels: Vec<_> = rest.iter().map(|&i| data.labels[i]).collect();
        let classes = data.classes;
        let training = Data {
            space: &space,
            labels: &labels,
            classes,
            tails: data.tails,
        };
        let unseen = data.space.points.select_columns(fold);
        let fits = restarts(training, components, config.restarts, &mut rng)?;
        for (fit, held_out) in fits.iter().zip(&mut held_out) {
            held_out.extend(log_completed(&fit.mixture, &unseen)?);
        }
    }
    let fits = restarts(data, components, config.restarts, &mut rng)?;
    let mut held_out = held_out.into_iter();
    Ok(fits.map(|fit| {
        let held_out = held_out.next().unwrap_or_default();
        Tried {
            candidate: Candidate {
                components,
                left: fit.mixture.len(),
                covariances: fit.covariances,
                held_out: (!held_out.is_empty()).then(|| mean(&held_out)),
                bic: fit.bayesian_information(),
            },
            fit,
            held_out,
        }
    }))
}

/// The best of several starts, with tied and with own covariances.
fn restarts(
    data: Data<'_>,
    components: usize,
    count: usize,
    rng: &mut ChaCha8Rng,
) -> Result<[Fit; 2], ClusterError> {
    let mut best: Option<[Fit; 2]> = None;
    // One component has one start.
    let count = if components == 1 { 1 } else { count };
    for turn in 0..count {
        let metric = if turn % 2 == 0 {
            Metric::Movement
        } else {
            Metric::Whitened
        };
        let points = &data.space.points;
        let counts = (data.classes, components);
        let start = start(points, data.labels, counts, metric, rng);
        let tied = Fit::tied(data, &start, components)?;
        let own = tied.own(data)?;
        best = Some(match best {
            None => [tied, own],
            Some([best_tied, best_own]) => [better(best_tied, tied), better(best_own, own)],
        });
    }
    best.ok_or(ClusterError::Numerical("choice of a start"))
}

fn better(best: Fit, next: Fit) -> Fit {
    if next.score() > best.score() {
        next
    } else {
        best
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Index of the fewest components (then of greater held-out likelihood) that are within `standard_errors` of the best;
/// by the Bayesian information criterion where nothing was held out.
///
/// Source: the one-standard-error rule of Breiman, Friedman, Olshen and Stone, Classification and Regression Trees
/// (1984), on paired differences.
fn fewest(tried: &[Tried], standard_errors: f64) -> usize {
    let held_out = |index: &usize| {
        tried[*index]
            .candidate
            .held_out
            .unwrap_or(f64::NEG_INFINITY)
    };
    let all = 0..tried.len();
    if tried.iter().all(|one| one.held_out.is_empty()) {
        let bic = |index: &usize| tried[*index].candidate.bic;
        return all
            .min_by(|one, other| bic(one).total_cmp(&bic(other)))
            .unwrap_or(0);
    }
    let best = all
        .clone()
        .max_by(|one, other| held_out(one).total_cmp(&held_out(other)));
    let best = best.unwrap_or(0);
    let near = |index: &usize| {
        let pairs = tried[best].held_out.iter().zip(&tried[*index].held_out);
        let lost: Vec<f64> = pairs.map(|(best, mine)| best - mine).collect();
        let average = mean(&lost);
        let squares = lost.iter().map(|lost| (lost - average) * (lost - average));
        let n = lost.len() as f64;
        let error = libm::sqrt(squares.sum::<f64>() / (n * (n - 1.0).max(1.0)));
        average <= standard_errors * error
    };
    let enough: Vec<usize> = all.filter(|index| *index == best || near(index)).collect();
    let least = enough
        .iter()
        .map(|&index| tried[index].candidate.components)
        .min();
    let of_least = enough
        .into_iter()
        .filter(|&index| Some(tried[index].candidate.components) == least);
    of_least
        .max_by(|one, other| held_out(one).total_cmp(&held_out(other)))
        .unwrap_or(best)
}
