//! Other methods on the same demonstrations, for comparison: each as its authors would have it, each with its source.
//!
//! | method | recognises | predicts | with uncertainty | source |
//! |---|---|---|---|---|
//! | [`without_semg`] | yes | yes | yes | Paraschos 2013; Maeda 2017: what sEMG is held against |
//! | [`single_gaussian`] | no | yes | yes | the paper's grey band |
//! | [`marginals`] | yes | yes | yes | equation 19 read instant by instant |
//! | [`mixture_regression`] | yes | yes | yes | Calinon 2007 |
//! | [`hidden_markov`] | yes | yes | yes | Zeestraten 2016; Zeng 2020 |
//! | [`nearest`] | yes | yes | no | Sakoe and Chiba 1978 |
//! | [`dmp`] | no | yes | no | Ijspeert 2013; Yang 2018 |
//!
//! All are given the same: demonstrations by phase (start and duration known), the same DoFs with stiffness as its
//! logarithm where the model has it so, the same observations, the same statement of their noise. What only one of
//! them needs (a skill that is told, a goal set by hand) is said where it is defined.

mod aligned;
mod compare;
pub mod dmp;
mod error;
mod gaussian;
pub mod hidden_markov;
pub mod marginals;
pub mod mixture_regression;
pub mod nearest;
mod primitives;
pub mod single_gaussian;
pub mod without_semg;

pub use compare::{Row, compare, cross_validate};
pub use error::BaselineError;
pub use gaussian::{Gaussian, Seen};
pub use primitives::Primitives;

use crate::demonstration::Demonstration;
use crate::model::{Dof, Valid};

/// What is observed of one movement.
#[derive(Debug, Clone, PartialEq)]
pub struct Observed {
    /// Which DoFs.
    pub dofs: Vec<usize>,
    /// When, as phases in increasing order.
    pub phases: Vec<f64>,
    /// `values[i][j]`: DoF `dofs[i]` at `phases[j]`, in its unit.
    pub values: Vec<Vec<f64>>,
    /// Standard deviations of their noise, likewise.
    pub std: Vec<Vec<f64>>,
}

impl Observed {
    /// The same without the DoFs that `keep` refuses.
    #[must_use]
    pub fn only(&self, keep: impl Fn(usize) -> bool) -> Self {
        let kept: Vec<usize> = (0..self.dofs.len())
            .filter(|&i| keep(self.dofs[i]))
            .collect();
        Self {
            dofs: kept.iter().map(|&i| self.dofs[i]).collect(),
            phases: self.phases.clone(),
            values: kept.iter().map(|&i| self.values[i].clone()).collect(),
            std: kept.iter().map(|&i| self.std[i].clone()).collect(),
        }
    }

    /// Every number by itself, in time order: DoF, phase, value, standard deviation.
    pub fn each(&self) -> impl Iterator<Item = (usize, f64, f64, f64)> {
        self.phases.iter().enumerate().flat_map(move |(j, &phase)| {
            let of_dof = move |i: usize| (self.dofs[i], phase, self.values[i][j], self.std[i][j]);
            (0..self.dofs.len()).map(of_dof)
        })
    }
}

/// What a method makes of a DoF, at the phases asked for and in the DoF's unit.
#[derive(Debug, Clone, PartialEq)]
pub struct Path {
    /// Expected values.
    pub mean: Vec<f64>,
    /// Pointwise 95 % intervals of a recorded value, for methods that have them.
    pub interval_95: Option<Vec<(f64, f64)>>,
}

/// What a method says about one movement.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Answer {
    /// Log posterior probability of each label, for methods that have it.
    pub log_posterior: Option<Vec<f64>>,
    /// Index of the label it decides for, for methods that recognise.
    pub recognised: Option<usize>,
    /// One per DoF; none for a DoF that the method says nothing about.
    pub paths: Vec<Option<Path>>,
}

/// Where the robot is among the DoFs, for methods and scores that need to know.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Roles {
    /// The hand's position.
    pub hand: [usize; 3],
    /// The robot's position.
    pub robot: [usize; 3],
    /// The robot's stiffness.
    pub robot_stiffness: [usize; 3],
    /// Sign of the robot's axis when the hand moves along its own: -1, -1, 1 for a robot that faces the person.
    pub facing: [f64; 3],
}

/// What all methods are given.
#[derive(Debug, Clone)]
pub struct Protocol {
    /// DoFs, basis and shrinkage of the methods that learn movement primitives.
    pub valid: Valid,
    /// DoFs observed.
    pub observed: Vec<usize>,
    /// When they are, as phases in increasing order.
    pub phases: Vec<f64>,
    /// Standard deviation of a position's noise that the methods are told, metres, above 0.
    pub sigma_m: f64,
    /// The same for every other DoF, as a share of the value, above 0.
    pub sigma_share: f64,
    /// Standard deviation of white noise added to observed positions, metres; the methods are told.
    pub noise_m: f64,
    /// Seed of the noise.
    pub seed: u64,
    /// None where there is no robot: then only recognition is compared.
    pub roles: Option<Roles>,
}

impl Protocol {
    fn dofs(&self) -> &[Dof] {
        &self.valid.get().dofs
    }
}

/// Log probabilities from unnormalised ones.
fn normalised(log_joint: &[f64]) -> Vec<f64> {
    let total = log_sum(log_joint);
    log_joint.iter().map(|joint| joint - total).collect()
}

/// Logarithm of a sum, from the logarithms of its terms; minus infinity of none.
fn log_sum(terms: &[f64]) -> f64 {
    let largest = terms.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if largest == f64::NEG_INFINITY {
        return largest;
    }
    let sum: f64 = terms.iter().map(|term| libm::exp(term - largest)).sum();
    largest + libm::log(sum)
}

/// Index of the largest, the first of equals.
fn largest(values: &[f64]) -> Option<usize> {
    let indices = 0..values.len();
    indices.reduce(|best, next| {
        if values[next] > values[best] {
            next
        } else {
            best
        }
    })
}

/// Labels that occur, sorted, and the one of each demonstration.
fn labels_of(demonstrations: &[Demonstration]) -> (Vec<String>, Vec<usize>) {
    let mut labels: Vec<String> = demonstrations
        .iter()
        .map(|d| d.label().to_owned())
        .collect();
    labels.sort_unstable();
    labels.dedup();
    let place = |d: &Demonstration| labels.partition_point(|l| l.as_str() < d.label());
    let of_each = demonstrations.iter().map(place).collect();
    (labels, of_each)
}
