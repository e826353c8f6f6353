//! Demonstrations without labels, or with some: which belong together, and how many kinds there are.
//!
//! Each demonstration is a point: the movement its weights draw, every DoF scaled to unit variance, along the leading
//! principal directions of all demonstrations ([`space`]). A mixture of Student-t components is fitted to the points by EM
//! from k-means++ starts ([`em`], [`start`]), and the number of its components is the fewest whose held-out likelihood is
//! within a stated number of standard errors of the best ([`choose`]). What comes out are labels: the model is then
//! learnt from the relabelled demonstrations like any other, by [`learn`](super::learn()).

mod agreement;
mod choose;
mod component;
mod directions;
mod em;
mod naming;
mod space;
mod start;
mod variants;

#[cfg(test)]
mod tests;

pub use agreement::adjusted_rand_index;
pub use directions::both_ways;
pub use naming::{Labelled, label};
pub use variants::{ClassVariants, Variants, variants};

use nalgebra::DMatrix;

use super::{LearnError, Valid};
use crate::demonstration::Demonstration;
use choose::Chosen;
use em::Data;
use space::Space;

/// How demonstrations are clustered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClusterConfig {
    /// Fewest components tried, at least 1; fewer than the labelled classes counts as those.
    pub least_components: usize,
    /// Most components tried. Equal to the fewest if the number is known.
    pub most_components: usize,
    /// EM runs from different starts for each number of components, at least 1; the best penalised likelihood wins.
    pub restarts: usize,
    /// Folds of the held-out likelihood, at least 2.
    pub folds: usize,
    /// The number of components is the fewest whose held-out log-likelihood is at most this many standard errors
    /// (of the difference, over demonstrations) below the best; 0 takes the best. From 0.
    pub standard_errors: f64,
    /// Share of the variance that the principal directions must hold, above 0, below 1; what is left counts as noise of
    /// equal variance along each of them. Many directions say little of which kind a movement is, and a component follows
    /// each of its few points in them.
    pub variance_kept: f64,
    /// Degrees of freedom of each component's Student-t, above 2; infinite for Gaussians.
    pub freedom: f64,
    /// Seed of starts and folds.
    pub seed: u64,
}

impl Default for ClusterConfig {
    /// One to six components, 6 restarts, 5 folds, one standard error, 90 % of the variance, 8 degrees of freedom.
    fn default() -> Self {
        Self {
            least_components: 1,
            most_components: 6,
            restarts: 6,
            folds: 5,
            standard_errors: 1.0,
            variance_kept: 0.9,
            freedom: 8.0,
            seed: 0,
        }
    }
}

/// Whether components have a covariance of their own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Covariances {
    /// One, that all share.
    Tied,
    /// Each its own, drawn towards the shared one as if `p + 2` more demonstrations with that covariance had been
    /// seen, `p` the number of dimensions.
    Own,
}

/// One number of components, tried.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    /// How many components EM started with.
    pub components: usize,
    /// How many are left: duplicates are merged and empty ones dropped.
    pub left: usize,
    /// Their covariances.
    pub covariances: Covariances,
    /// Mean log density of an unlabelled demonstration and the component it most likely belongs to, under the mixture fitted
    /// without its fold, nats (with the tails that the uncertainty of means and covariances gives it). `None` where nothing can be held out: fewer than 4 unlabelled demonstrations.
    pub held_out: Option<f64>,
    /// Bayesian information criterion of the fit to all, `-2 log L + parameters log N`: less is better.
    pub bic: f64,
}

/// Which demonstrations belong together.
#[derive(Clone, Debug, PartialEq)]
pub struct Clusters {
    /// Component of each demonstration. Labelled classes come first, in their order, then the others in the order of
    /// their first demonstration.
    pub assignment: Vec<usize>,
    /// `[demonstration][component]`: natural logarithm of the membership's probability.
    pub log_membership: Vec<Vec<f64>>,
    /// How many components there are, each of at least two demonstrations or a label.
    pub components: usize,
    /// What the chosen fit says of its covariances.
    pub covariances: Covariances,
    /// Every number of components that was tried.
    pub table: Vec<Candidate>,
    /// Penalised log-likelihood after each iteration of the chosen run. It does not fall, save where a component was
    /// started anew, dropped or merged, and where the covariances become the components' own.
    pub objective: Vec<f64>,
    /// Empty components that were started anew in the chosen run.
    pub restarted: usize,
    /// Components dropped in the chosen run: empty again after that, or of a single demonstration in the end.
    pub dropped: usize,
    /// Components merged in the chosen run because they were the same.
    pub merged: usize,
}

/// Why demonstrations cannot be clustered.
#[derive(Debug, thiserror::Error)]
pub enum ClusterError {
    /// A number of the configuration outside its range.
    #[error("{what} is {value}: give {range}")]
    Config {
        /// Which number.
        what: &'static str,
        /// The number.
        value: f64,
        /// What it may be.
        range: &'static str,
    },
    /// Fewer demonstrations than it takes.
    #[error(
        "{found} demonstrations and {components} components: each component needs 2 unlabelled demonstrations or a label, and 3 \
         demonstrations are the least"
    )]
    TooFew {
        /// Demonstrations.
        found: usize,
        /// Components.
        components: usize,
    },
    /// Labels that do not fit the demonstrations.
    #[error(
        "{labels} labels for {demonstrations} demonstrations: give one each, or none for an unlabelled one"
    )]
    Labels {
        /// Labels.
        labels: usize,
        /// Demonstrations.
        demonstrations: usize,
    },
    /// A class that no demonstration is labelled with.
    #[error(
        "class {class} has no labelled demonstration, a later one has: number the classes from 0 without gaps"
    )]
    NoneOfClass {
        /// The class.
        class: usize,
    },
    /// All demonstrations draw the same movement.
    #[error("the demonstrations are identical: there is nothing to tell apart")]
    Identical,
    /// A factorisation failed.
    #[error("the {0} failed: check the demonstrations for values of very different size")]
    Numerical(&'static str),
    /// The demonstrations have no weights.
    #[error(transparent)]
    Learn(#[from] LearnError),
}

/// Clusters demonstrations; `labels[i]` is the class of the demonstration `i` where it is known (numbered from 0
/// without gaps), and its own `label()` is not looked at. Labelled demonstrations keep their class, the others join
/// a class or form components of their own. The same seed gives the same clusters.
///
/// # Errors
/// [`ClusterError`].
pub fn cluster(
    demonstrations: &[Demonstration],
    valid: &Valid,
    labels: &[Option<usize>],
    config: &ClusterConfig,
) -> Result<Clusters, ClusterError> {
    let classes = check(demonstrations.len(), labels, config)?;
    let space = Space::of(demonstrations, valid, config.variance_kept)?;
    in_space(&space, labels, classes, config)
}

fn in_space(
    space: &Space,
    labels: &[Option<usize>],
    classes: usize,
    config: &ClusterConfig,
) -> Result<Clusters, ClusterError> {
    let data = Data {
        space,
        labels,
        classes,
        tails: config.freedom,
    };
    let Chosen { fit, table } = choose::choose(data, config)?;
    let settled = fit.without_singles(data)?;
    let order = order(&settled.memberships, classes);
    let sorted = |row: Vec<f64>| order.iter().map(|&q| row[q]).collect::<Vec<_>>();
    let rows = settled.memberships.row_iter();
    let log_membership: Vec<Vec<f64>> = rows
        .map(|row| sorted(row.iter().copied().collect()))
        .collect();
    Ok(Clusters {
        assignment: log_membership.iter().map(|row| greatest(row)).collect(),
        components: order.len(),
        log_membership,
        covariances: settled.covariances,
        table,
        objective: settled.objective,
        restarted: settled.restarted,
        dropped: settled.dropped,
        merged: settled.merged,
    })
}

/// Checks everything but the demonstrations' values; the number of labelled classes.
fn check(
    demonstrations: usize,
    labels: &[Option<usize>],
    config: &ClusterConfig,
) -> Result<usize, ClusterError> {
    check_numbers(config)?;
    if labels.len() != demonstrations {
        return Err(ClusterError::Labels {
            labels: labels.len(),
            demonstrations,
        });
    }
    let classes = labels
        .iter()
        .flatten()
        .max()
        .map_or(0, |last| last.saturating_add(1));
    if let Some(class) = (0..classes).find(|&class| !labels.contains(&Some(class))) {
        return Err(ClusterError::NoneOfClass { class });
    }
    let components = config.least_components.max(classes);
    let free = labels.iter().filter(|label| label.is_none()).count();
    if demonstrations < 3 || free < (components - classes).saturating_mul(2) {
        return Err(ClusterError::TooFew {
            found: demonstrations,
            components,
        });
    }
    Ok(classes)
}

/// Checks the configuration by itself.
fn check_numbers(config: &ClusterConfig) -> Result<(), ClusterError> {
    let at_least = |what, value: usize, least: usize, range| {
        if value >= least {
            Ok(())
        } else {
            let value = value as f64;
            Err(ClusterError::Config { what, value, range })
        }
    };
    at_least(
        "the least number of components",
        config.least_components,
        1,
        "at least 1",
    )?;
    at_least(
        "the greatest number of components",
        config.most_components,
        config.least_components,
        "at least the least number",
    )?;
    at_least("the number of restarts", config.restarts, 1, "at least 1")?;
    at_least("the number of folds", config.folds, 2, "at least 2")?;
    let (errors, kept) = (config.standard_errors, config.variance_kept);
    let real = [
        (
            "the number of standard errors",
            errors,
            errors >= 0.0 && errors.is_finite(),
            "a finite number from 0",
        ),
        (
            "the share of variance",
            kept,
            kept > 0.0 && kept < 1.0,
            "above 0 and below 1",
        ),
        (
            "the number of degrees of freedom",
            config.freedom,
            config.freedom > 2.0,
            "above 2, infinite for Gaussians",
        ),
    ];
    for (what, value, within, range) in real {
        if !within {
            return Err(ClusterError::Config { what, value, range });
        }
    }
    Ok(())
}

/// Labelled classes first, the others by their first demonstration.
fn order(memberships: &DMatrix<f64>, classes: usize) -> Vec<usize> {
    let rows = memberships.row_iter();
    let of: Vec<usize> = rows
        .map(|row| greatest(&row.iter().copied().collect::<Vec<_>>()))
        .collect();
    let mut order: Vec<usize> = (0..memberships.ncols()).collect();
    let first = |q: usize| of.iter().position(|&mine| mine == q).unwrap_or(usize::MAX);
    order[classes..].sort_by_key(|&q| first(q));
    order
}

/// Index of the greatest, the first of equals.
fn greatest(values: &[f64]) -> usize {
    let better = |best: usize, next: usize| {
        if values[next] > values[best] {
            next
        } else {
            best
        }
    };
    (0..values.len()).fold(0, better)
}
