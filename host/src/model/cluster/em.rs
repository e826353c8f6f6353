//! A mixture fitted by EM, with covariances drawn towards a prior one, from given starts.
//!
//! Components are Student-t, so that a movement that is unlike all others neither draws a component to itself nor makes
//! one of its own (Peel and McLachlan, Robust mixture modelling using the t distribution, 2000); infinite degrees of
//! freedom make them Gaussian. `C_q` is then the scale.
//!
//! Maximised is `sum_i log p(x_i) - nu sum_q KL(N(0, P) | N(0, C_q))`: every covariance `C_q` as if `nu` more points with
//! covariance `P` had been seen. First all components share one covariance, and `P` is the noise; then each may have its
//! own, and `P` is the shared one. Of a labelled point the joint density with its class counts. Each step raises the sum,
//! save where a component is started anew, dropped or merged.

use nalgebra::{DMatrix, DVector};

use super::component::{Component, distance, factor, log_density, log_determinant, log_joint};
use super::space::Space;
use super::{ClusterError, Covariances, greatest};
use crate::model::fitted::log_sum_exp;

/// Iterations of one phase, at most.
const ITERATIONS: usize = 200;
/// Rise of the objective per point that ends a phase, nats.
const TOLERANCE: f64 = 1e-6;
/// A component of fewer expected points is empty.
const LEAST_POINTS: f64 = 1.0;
/// Components closer than this are the same, nats of Bhattacharyya distance.
const DUPLICATE: f64 = 0.01;
/// Weight of the noise in the shared covariance, in points.
const NOISE_POINTS: f64 = 1.0;

/// What a mixture is fitted to.
#[derive(Clone, Copy)]
pub(super) struct Data<'a> {
    pub(super) space: &'a Space,
    /// Of each point.
    pub(super) labels: &'a [Option<usize>],
    /// The first components, which are not dropped.
    pub(super) classes: usize,
    /// Degrees of freedom of the components, infinite for Gaussians.
    pub(super) tails: f64,
}

/// What the covariances are drawn towards.
#[derive(Clone, Debug)]
struct Prior {
    covariance: DMatrix<f64>,
    log_determinant: f64,
    points: f64,
}

impl Prior {
    fn new(covariance: DMatrix<f64>, points: f64) -> Result<Self, ClusterError> {
        Ok(Self {
            log_determinant: log_determinant(&factor(&covariance)?),
            covariance,
            points,
        })
    }

    /// `nu KL(N(0, P) | N(0, C))`.
    fn penalty(&self, covariance: &DMatrix<f64>) -> Result<f64, ClusterError> {
        let factor = factor(covariance)?;
        let trace = factor.solve(&self.covariance).trace();
        let logs = log_determinant(&factor) - self.log_determinant;
        Ok(0.5 * self.points * (logs + trace - covariance.nrows() as f64))
    }
}

/// A mixture and how it came about.
#[derive(Clone, Debug)]
pub(super) struct Fit {
    pub(super) mixture: Vec<Component>,
    /// `N x Q`, logarithms.
    pub(super) memberships: DMatrix<f64>,
    pub(super) covariances: Covariances,
    /// Unpenalised.
    pub(super) log_likelihood: f64,
    /// After each iteration.
    pub(super) objective: Vec<f64>,
    pub(super) restarted: usize,
    pub(super) dropped: usize,
    pub(super) merged: usize,
    prior: Prior,
}

impl Fit {
    /// With one covariance for all, from a component for each point.
    pub(super) fn tied(
        data: Data<'_>,
        start: &[usize],
        components: usize,
    ) -> Result<Self, ClusterError> {
        let (p, n) = data.space.points.shape();
        let noise = DMatrix::from_diagonal_element(p, p, data.space.noise);
        let member = |i: usize, q| {
            if start[i] == q {
                0.0
            } else {
                f64::NEG_INFINITY
            }
        };
        let mut fit = Self {
            mixture: Vec::new(),
            memberships: DMatrix::from_fn(n, components, member),
            covariances: Covariances::Tied,
            log_likelihood: f64::NEG_INFINITY,
            objective: Vec::new(),
            restarted: 0,
            dropped: 0,
            merged: 0,
            prior: Prior::new(noise, NOISE_POINTS)?,
        };
        fit.converge(data)?;
        Ok(fit)
    }

    /// Goes on with a covariance for each, drawn towards the one that they share.
    pub(super) fn own(&self, data: Data<'_>) -> Result<Self, ClusterError> {
        let mut fit = self.clone();
        let Some(first) = fit.mixture.first() else {
            return Ok(fit);
        };
        let points = data.space.points.nrows() + 2;
        fit.prior = Prior::new(first.covariance.clone(), points as f64)?;
        fit.covariances = Covariances::Own;
        fit.converge(data)?;
        Ok(fit)
    }

    /// Without the components, labelled ones apart, that in the end have fewer than two points.
    pub(super) fn without_singles(mut self, data: Data<'_>) -> Result<Self, ClusterError> {
        loop {
            let rows = self.memberships.row_iter();
            let of: Vec<usize> = rows
                .map(|row| greatest(&row.iter().copied().collect::<Vec<_>>()))
                .collect();
            let points = |q: usize| of.iter().filter(|&&mine| mine == q).count();
            let mut unlabelled = data.classes..self.memberships.ncols();
            let Some(single) = unlabelled.find(|&q| points(q) < 2) else {
                return Ok(self);
            };
            if self.memberships.ncols() == 1 {
                return Ok(self);
            }
            self.drop(single, data)?;
            self.converge(data)?;
        }
    }

    /// Value to compare restarts by.
    pub(super) fn score(&self) -> f64 {
        self.objective.last().copied().unwrap_or(f64::NEG_INFINITY)
    }

    /// `-2 log L + parameters log N`.
    pub(super) fn bayesian_information(&self) -> f64 {
        let (n, q) = (self.memberships.nrows() as f64, self.mixture.len() as f64);
        let p = self.mixture.first().map_or(0, |one| one.mean.len()) as f64;
        let covariances = match self.covariances {
            Covariances::Tied => 1.0,
            Covariances::Own => q,
        };
        let parameters = q - 1.0 + q * p + covariances * p * (p + 1.0) / 2.0;
        -2.0 * self.log_likelihood + parameters * libm::log(n)
    }

    fn converge(&mut self, data: Data<'_>) -> Result<(), ClusterError> {
        loop {
            let mut last = f64::NEG_INFINITY;
            for _ in 0..ITERATIONS {
                if self.mend_empty(data)? {
                    last = f64::NEG_INFINITY;
                }
                self.maximise(data)?;
                let now = self.expect(data)?;
                if now - last <= TOLERANCE * data.space.count() as f64 {
                    break;
                }
                last = now;
            }
            if !self.merge_duplicate(data)? {
                return Ok(());
            }
        }
    }

    /// Expected points of a component.
    fn points_of(&self, q: usize) -> f64 {
        self.memberships
            .column(q)
            .iter()
            .map(|v| libm::exp(*v))
            .sum()
    }

    /// Starts an empty component anew at the point that the others explain least; where that was done as often as
    /// there are components, drops it. Whether it did anything.
    fn mend_empty(&mut self, data: Data<'_>) -> Result<bool, ClusterError> {
        let mut mended = false;
        loop {
            let unlabelled = data.classes..self.memberships.ncols();
            let sizes = unlabelled.map(|q| (q, self.points_of(q)));
            let emptiest = sizes.min_by(|one, other| one.1.total_cmp(&other.1));
            let Some((q, _)) = emptiest.filter(|(_, points)| *points < LEAST_POINTS) else {
                return Ok(mended);
            };
            if self.memberships.ncols() == 1 {
                return Ok(mended);
            }
            mended = true;
            let without = self.memberships.clone().remove_column(q);
            if self.restarted >= self.memberships.ncols() {
                self.drop(q, data)?;
                continue;
            }
            self.restarted += 1;
            let others = self.mixture_of(&normalised(without), data)?;
            let density = log_density(&log_joint(&others, &data.space.points)?);
            let free = (0..density.len()).filter(|&i| data.labels[i].is_none());
            let Some(worst) = free.min_by(|&i, &j| density[i].total_cmp(&density[j])) else {
                self.drop(q, data)?;
                continue;
            };
            self.memberships.row_mut(worst).fill(f64::NEG_INFINITY);
            self.memberships[(worst, q)] = 0.0;
        }
    }

    fn drop(&mut self, q: usize, data: Data<'_>) -> Result<(), ClusterError> {
        self.dropped += 1;
        self.memberships = normalised(self.memberships.clone().remove_column(q));
        // Memberships alone say little of points that were the dropped one's: let the others explain them.
        self.maximise(data)?;
        self.expect(data)?;
        Ok(())
    }

    /// Merges the closest two components if they are the same; two classes never are.
    fn merge_duplicate(&mut self, data: Data<'_>) -> Result<bool, ClusterError> {
        for q in data.classes.max(1)..self.mixture.len() {
            for earlier in 0..q {
                if distance(&self.mixture[earlier], &self.mixture[q])? < DUPLICATE {
                    for mut row in self.memberships.row_iter_mut() {
                        let both = [row[earlier], row[q]];
                        row[earlier] = log_sum_exp(&both);
                    }
                    self.memberships = self.memberships.clone().remove_column(q);
                    self.merged += 1;
                    return Ok(true);
                }
            }
        }
        Ok(false)
    }

    fn maximise(&mut self, data: Data<'_>) -> Result<(), ClusterError> {
        self.mixture = self.mixture_of(&self.memberships, data)?;
        Ok(())
    }

    /// The mixture that memberships make. None is empty.
    fn mixture_of(
        &self,
        memberships: &DMatrix<f64>,
        data: Data<'_>,
    ) -> Result<Vec<Component>, ClusterError> {
        let points = &data.space.points;
        let n = points.ncols() as f64;
        let mut mixture = Vec::with_capacity(memberships.ncols());
        let mut shared = &self.prior.covariance * self.prior.points;
        for (q, column) in memberships.column_iter().enumerate() {
            let mut share: DVector<f64> = column.map(libm::exp);
            let size = share.sum();
            if size <= 0.0 {
                continue;
            }
            // By the components before; those that are not the same any more tell nothing.
            if self.mixture.len() == memberships.ncols() {
                let trust = self.mixture[q].trust(points)?;
                share.component_mul_assign(&DVector::from_vec(trust));
            }
            let mean = points * &share / share.sum();
            let mut spread = points.clone();
            for (mut point, share) in spread.column_iter_mut().zip(share.iter()) {
                point -= &mean;
                point *= libm::sqrt(*share);
            }
            let scatter = &spread * spread.transpose();
            let covariance = match self.covariances {
                Covariances::Tied => {
                    shared += scatter;
                    DMatrix::zeros(0, 0)
                }
                Covariances::Own => {
                    let prior = &self.prior.covariance * self.prior.points;
                    (scatter + prior) / (size + self.prior.points)
                }
            };
            mixture.push(Component {
                log_weight: libm::log(size / n),
                mean,
                covariance,
                points: size,
                spread_over: size + self.prior.points,
                freedom: size + self.prior.points - 1.0,
                tails: data.tails,
            });
        }
        if self.covariances == Covariances::Tied {
            let spread_over = n + self.prior.points;
            shared /= spread_over;
            let means = mixture.len() as f64;
            for component in &mut mixture {
                component.covariance.clone_from(&shared);
                component.spread_over = spread_over;
                component.freedom = spread_over - means;
            }
        }
        Ok(mixture)
    }

    /// Memberships by the mixture; the objective.
    fn expect(&mut self, data: Data<'_>) -> Result<f64, ClusterError> {
        let mut joint = log_joint(&self.mixture, &data.space.points)?;
        let mut density = log_density(&joint);
        for (i, label) in data.labels.iter().enumerate() {
            if let Some(class) = *label {
                density[i] = joint[(i, class)];
                joint.row_mut(i).fill(f64::NEG_INFINITY);
                joint[(i, class)] = 0.0;
            } else {
                joint.row_mut(i).add_scalar_mut(-density[i]);
            }
        }
        self.memberships = joint;
        self.log_likelihood = density.iter().sum();
        let alike = match self.covariances {
            Covariances::Tied => 1,
            Covariances::Own => self.mixture.len(),
        };
        let mut penalty = 0.0;
        for component in &self.mixture[..alike] {
            penalty += self.prior.penalty(&component.covariance)?;
        }
        let objective = self.log_likelihood - penalty;
        if !objective.is_finite() {
            return Err(ClusterError::Numerical("likelihood of the mixture"));
        }
        self.objective.push(objective);
        Ok(objective)
    }
}

/// Rows that sum to one again; where nothing is left of a row, it belongs to all alike.
fn normalised(mut memberships: DMatrix<f64>) -> DMatrix<f64> {
    for mut row in memberships.row_iter_mut() {
        let total = log_sum_exp(&row.iter().copied().collect::<Vec<_>>());
        if total == f64::NEG_INFINITY {
            row.fill(-libm::log(row.len() as f64));
        } else {
            row.add_scalar_mut(-total);
        }
    }
    memberships
}
