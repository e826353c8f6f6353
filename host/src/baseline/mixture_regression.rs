//! A Gaussian mixture over phase and all DoFs for each skill, and Gaussian mixture regression.
//!
//! Calinon et al. (2007, *On learning, representing and generalizing a task in a humanoid robot*), EM from equal slices
//! of phase, number of components by BIC on the demonstrations. A movement is a bag of independent instants here:
//! recognition multiplies `p(y | phase)` over instants, and an observation tells about its own instant (and, between
//! two observations, about the instants in between) but not about the rest of the movement.

use nalgebra::DMatrix;

use super::aligned::{Aligned, SAMPLES, phase_of, seen_at};
use super::gaussian::{Gaussian, Seen, matched};
use super::{Answer, BaselineError, Observed, largest, log_sum, normalised};
use crate::demonstration::Demonstration;
use crate::model::Dof;

/// Numbers of components tried.
const COUNTS: [usize; 4] = [3, 5, 8, 12];
/// Least variance of a component, as a share of a DoF's own.
const FLOOR: f64 = 1e-3;
const ITERATIONS: usize = 50;
/// EM stops when the log-likelihood of a point grows by less, nats.
const TOLERANCE: f64 = 1e-4;
/// Standard deviation of phases from 0 to 1.
const PHASE_SD: f64 = 0.288_675_134_594_812_9;

/// Weighted Gaussians. Which numbers they are over is the caller's matter.
#[derive(Debug, Clone, PartialEq)]
pub struct GaussianMixture {
    /// Logarithms of the weights, and the Gaussians.
    pub components: Vec<(f64, Gaussian)>,
}

impl GaussianMixture {
    /// Log density of what is seen.
    ///
    /// # Errors
    /// A covariance that is not positive definite.
    pub fn log_density(&self, seen: &Seen) -> Result<f64, BaselineError> {
        Ok(log_sum(&self.log_joint(seen)?))
    }

    /// Mean and covariance of all numbers given what is seen (the mixture's moments).
    ///
    /// # Errors
    /// As [`GaussianMixture::log_density`].
    pub fn given(&self, seen: &Seen) -> Result<Gaussian, BaselineError> {
        let joint = self.log_joint(seen)?;
        let parts = joint.into_iter().zip(&self.components);
        let parts: Vec<_> = parts
            .map(|(log, (_, gaussian))| Ok((log, gaussian.given(seen)?)))
            .collect::<Result<_, BaselineError>>()?;
        matched(&parts).ok_or(BaselineError::None("learn from"))
    }

    fn log_joint(&self, seen: &Seen) -> Result<Vec<f64>, BaselineError> {
        let one = |(log, gaussian): &(f64, Gaussian)| Ok(log + gaussian.log_density(seen)?);
        self.components.iter().map(one).collect()
    }

    /// EM on the rows of `points` (the first number orders the start's slices), and the log-likelihood.
    fn fitted(points: &DMatrix<f64>, count: usize) -> Result<(Self, f64), BaselineError> {
        let rows = points.nrows();
        let mut order: Vec<usize> = (0..rows).collect();
        order.sort_by(|&a, &b| points[(a, 0)].total_cmp(&points[(b, 0)]));
        let mut shares = DMatrix::zeros(rows, count);
        for (place, row) in order.into_iter().enumerate() {
            shares[(row, place * count / rows)] = 1.0;
        }
        let mut last = f64::NEG_INFINITY;
        let mut mixture = Self::maximised(points, &shares);
        for _ in 0..ITERATIONS {
            let mut total = 0.0;
            for row in 0..rows {
                let joint = mixture.log_joint(&Seen::all(points.row(row).iter().copied()))?;
                total += log_sum(&joint);
                for (k, log) in normalised(&joint).into_iter().enumerate() {
                    shares[(row, k)] = libm::exp(log);
                }
            }
            if total - last < TOLERANCE * rows as f64 {
                return Ok((mixture, total));
            }
            last = total;
            mixture = Self::maximised(points, &shares);
        }
        Ok((mixture, last))
    }

    fn maximised(points: &DMatrix<f64>, shares: &DMatrix<f64>) -> Self {
        let rows = points.nrows() as f64;
        let one = |k: usize| {
            let weights = shares.column(k);
            let gaussian = Gaussian::weighted(points, weights.as_slice(), FLOOR);
            let weight = weights.sum().max(f64::MIN_POSITIVE) / rows;
            (libm::log(weight), gaussian)
        };
        Self {
            components: (0..shares.ncols()).map(one).collect(),
        }
    }
}

/// A mixture for each skill.
#[derive(Debug, Clone)]
pub struct MixtureRegression {
    aligned: Aligned,
    /// `[label]`, over phase and the DoFs, standardised.
    mixtures: Vec<GaussianMixture>,
}

impl MixtureRegression {
    /// Learns one mixture for each label.
    ///
    /// # Errors
    /// No demonstrations, or some of other DoFs.
    pub fn learn(train: &[Demonstration], dofs: &[Dof]) -> Result<Self, BaselineError> {
        let aligned = Aligned::new(train, dofs)?;
        let mut mixtures = Vec::new();
        for label in 0..aligned.labels.len() {
            let series: Vec<_> = aligned.of_label(label).collect();
            let width = dofs.len() + 1;
            let points =
                DMatrix::from_fn(series.len() * SAMPLES, width, |row, column| {
                    match column.checked_sub(1) {
                        None => standardised(phase_of(row % SAMPLES)),
                        Some(dof) => series[row / SAMPLES][(row % SAMPLES, dof)],
                    }
                });
            let parameters = (width * (width + 3) / 2 + 1) as f64;
            let mut best: Option<(GaussianMixture, f64)> = None;
            for count in COUNTS {
                let (mixture, log_likelihood) = GaussianMixture::fitted(&points, count)?;
                let size = parameters * count as f64 - 1.0;
                let bic = size * libm::log(points.nrows() as f64) - 2.0 * log_likelihood;
                if best.as_ref().is_none_or(|(_, least)| bic < *least) {
                    best = Some((mixture, bic));
                }
            }
            mixtures.extend(best.map(|(mixture, _)| mixture));
        }
        Ok(Self { aligned, mixtures })
    }

    /// Recognises by `p(y | phase)` of every instant; regresses on phase and what is seen at it.
    ///
    /// # Errors
    /// An observation without a logarithm.
    pub fn answer(&self, observed: &Observed, phases: &[f64]) -> Result<Answer, BaselineError> {
        let instants = self.aligned.standardised(observed)?;
        let mut log_joint = Vec::new();
        for (label, mixture) in self.mixtures.iter().enumerate() {
            let mut sum = self.aligned.log_prior(label);
            for (seen, &phase) in instants.iter().zip(&observed.phases) {
                sum += mixture.log_density(&with_phase(seen, phase))?
                    - mixture.log_density(&with_phase(&Seen::default(), phase))?;
            }
            log_joint.push(sum);
        }
        let log_posterior = normalised(&log_joint);
        let recognised = largest(&log_posterior);
        let mut paths = Vec::new();
        if let Some(mixture) = recognised.and_then(|label| self.mixtures.get(label)) {
            let mut expected = Vec::with_capacity(phases.len());
            for &phase in phases {
                let seen = seen_at(&observed.phases, &instants, phase);
                expected.push(mixture.given(&with_phase(&seen, phase))?);
            }
            for dof in 0..self.aligned.dofs().len() {
                let mean: Vec<f64> = expected.iter().map(|g| g.mean[dof + 1]).collect();
                let variance: Vec<f64> = expected
                    .iter()
                    .map(|g| g.covariance[(dof + 1, dof + 1)])
                    .collect();
                paths.push(Some(self.aligned.path(dof, &mean, Some(&variance))));
            }
        }
        Ok(Answer {
            log_posterior: Some(log_posterior),
            recognised,
            paths,
        })
    }
}

fn standardised(phase: f64) -> f64 {
    (phase - 0.5) / PHASE_SD
}

/// What is seen of the DoFs, phase ahead of them.
fn with_phase(seen: &Seen, phase: f64) -> Seen {
    let ahead = |first: f64, rest: &[f64]| -> Vec<f64> {
        std::iter::once(first).chain(rest.iter().copied()).collect()
    };
    Seen {
        which: std::iter::once(0)
            .chain(seen.which.iter().map(|dof| dof + 1))
            .collect(),
        values: ahead(standardised(phase), &seen.values),
        noise: ahead(0.0, &seen.noise),
    }
}
