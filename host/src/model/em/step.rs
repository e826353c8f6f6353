//! One step of EM.

use nalgebra::{Cholesky, DMatrix, DVector, SVD};

use super::complete::Completed;
use crate::model::LearnError;
use crate::model::subspace::{Deviations, extended};

/// Least noise variance, in units of each DoF's variance: data that the basis fits exactly must not make the
/// likelihood infinite.
const NOISE_FLOOR: f64 = 1e-8;
/// Directions in which demonstrations deviate by less than this share of the largest are rounding.
const RANK_TOLERANCE: f64 = 1e-9;
/// Variance that a skill starts with in every direction, as a share of the mean pooled variance.
const START_VARIANCE: f64 = 1e-2;
/// Far more than the QR iteration needs.
const SVD_ITERATIONS: usize = 100_000;

/// What EM needs to know of the samples.
pub(super) struct Statistics {
    /// `B`, `D K x r`.
    pub(super) directions: DMatrix<f64>,
    /// Of each design.
    designs: Vec<OfDesign>,
    /// Of each demonstration.
    movements: Vec<Movement>,
    skills: usize,
    dofs: usize,
}

struct OfDesign {
    /// `Phi_d^T Phi_d`, `r x r`; `None` of a DoF without values.
    normals: Vec<Option<DMatrix<f64>>>,
    /// Values of each DoF.
    counts: Vec<f64>,
}

struct Movement {
    skill: usize,
    design: usize,
    /// Its completed weights along the directions, about which the rest is taken: differences of large numbers
    /// would lose the noise.
    centre: DVector<f64>,
    /// `Phi_d^T (y_d - Phi_d centre)`, a column per DoF.
    pull: DMatrix<f64>,
    /// `|y_d - Phi_d centre|^2`.
    left: Vec<f64>,
}

impl Statistics {
    pub(super) fn of(completed: &Completed, most: usize) -> Result<Self, LearnError> {
        let (dofs, skills) = (completed.scale.len(), completed.groups.labels.len());
        let directions = directions(completed, most)?;
        let functions = directions.nrows() / dofs;
        let of_dof = |dof: usize| directions.rows(dof * functions, functions);
        let designs = completed.designs.iter().map(|design| {
            let normals = (0..dofs).map(|dof| {
                let seen = design.counts[dof] > 0;
                let b = of_dof(dof);
                seen.then(|| b.transpose() * (design.normal(dof) * b))
            });
            OfDesign {
                normals: normals.collect(),
                counts: design.counts.iter().map(|&count| count as f64).collect(),
            }
        });
        let movements = completed.series.iter().zip(&completed.weights).enumerate();
        let movements = movements.map(|(n, (values, weights))| {
            let design = &completed.designs[completed.design[n]];
            let centre = directions.tr_mul(weights);
            let near = &directions * &centre;
            let near = DMatrix::from_column_slice(functions, dofs, near.as_slice());
            let left = design.left(values, &near);
            let back = design.basis.transpose() * &left;
            let mut pull = DMatrix::zeros(directions.ncols(), dofs);
            for (dof, mut column) in pull.column_iter_mut().enumerate() {
                column.copy_from(&of_dof(dof).tr_mul(&back.column(dof)));
            }
            let squares = left.column_iter().map(|column| column.norm_squared());
            Movement {
                skill: completed.groups.skill[n],
                design: completed.design[n],
                centre,
                pull,
                left: squares.collect(),
            }
        });
        Ok(Self {
            designs: designs.collect(),
            movements: movements.collect(),
            skills,
            dofs,
            directions,
        })
    }

    /// How many numbers were recorded of each DoF.
    pub(super) fn counts(&self) -> Vec<f64> {
        let of_dof = |dof: usize| {
            let all = self.movements.iter();
            all.map(|one| self.designs[one.design].counts[dof]).sum()
        };
        (0..self.dofs).map(of_dof).collect()
    }

    /// How many numbers were recorded.
    pub(super) fn numbers(&self) -> f64 {
        self.counts().iter().sum()
    }
}

impl Completed {
    /// What the log-likelihood of scaled values has to be given for those in the DoFs' own units.
    pub(super) fn log_units(&self, statistics: &Statistics) -> f64 {
        let counts = statistics.counts();
        let logs = self.scale.iter().zip(counts);
        -logs
            .map(|(scale, count)| count * libm::log(*scale))
            .sum::<f64>()
    }
}

/// Means of the skills and the largest deviations from them, orthonormal.
fn directions(completed: &Completed, most: usize) -> Result<DMatrix<f64>, LearnError> {
    let groups = &completed.groups;
    let (skill, counts) = (groups.skill.clone(), groups.counts.clone());
    let deviations = Deviations::new(&completed.weights, skill, counts);
    let rows = deviations.rows;
    let svd = SVD::try_new(rows, false, true, f64::EPSILON, SVD_ITERATIONS);
    let failed = LearnError::Numerical("factorisation of the deviations");
    let Some((values, Some(v_t))) = svd.map(|svd| (svd.singular_values, svd.v_t)) else {
        return Err(failed);
    };
    let largest = values.max();
    if !(largest.is_finite() && largest > 0.0) {
        return Err(LearnError::Identical);
    }
    let above = values.iter().filter(|v| **v > RANK_TOLERANCE * largest);
    let count = above.count().min(most.max(1));
    Ok(extended(&v_t.rows(0, count).transpose(), &deviations.means))
}

/// What EM improves.
pub(super) struct State {
    /// `m_q`.
    pub(super) means: Vec<DVector<f64>>,
    /// `L_q`, lower triangular.
    pub(super) roots: Vec<DMatrix<f64>>,
    /// `sigma_d^2`.
    pub(super) noise: Vec<f64>,
}

/// What the samples say of every movement under a [`State`].
pub(super) struct Posterior {
    /// Of all samples, scaled.
    pub(super) log_likelihood: f64,
    /// Mean of `c` of each movement.
    pub(super) means: Vec<DVector<f64>>,
    /// Mean of `u` of each movement.
    standard: Vec<DVector<f64>>,
    /// Covariance `P` of `u` of each skill and design; `None` where no movement is of both.
    covariances: Vec<Option<DMatrix<f64>>>,
}

impl State {
    pub(super) fn start(
        completed: &Completed,
        statistics: &Statistics,
    ) -> Result<Self, LearnError> {
        let rank = statistics.directions.ncols();
        let counts = &completed.groups.counts;
        let mut means = vec![DVector::zeros(rank); statistics.skills];
        for one in &statistics.movements {
            means[one.skill] += &one.centre / counts[one.skill] as f64;
        }
        let mut own = vec![DMatrix::zeros(rank, rank); statistics.skills];
        for one in &statistics.movements {
            let off = &one.centre - &means[one.skill];
            own[one.skill].ger(1.0 / counts[one.skill] as f64, &off, &off, 1.0);
        }
        let total: f64 = own
            .iter()
            .zip(counts)
            .map(|(c, &n)| c.trace() * n as f64)
            .sum();
        let mean = total / (statistics.movements.len() * rank) as f64;
        let roots = own.into_iter().map(|mut covariance| {
            for k in 0..rank {
                covariance[(k, k)] += START_VARIANCE * mean;
            }
            lower(covariance)
        });
        let left = (0..statistics.dofs).map(|dof| {
            let left: f64 = statistics.movements.iter().map(|one| one.left[dof]).sum();
            left
        });
        let noise = left.zip(statistics.counts());
        Ok(Self {
            means,
            roots: roots.collect::<Result<Vec<_>, _>>()?,
            noise: noise
                .map(|(left, count)| (left / count).max(NOISE_FLOOR))
                .collect(),
        })
    }

    /// The E step.
    pub(super) fn expect(&self, statistics: &Statistics) -> Result<Posterior, LearnError> {
        let rank = statistics.directions.ncols();
        let informations: Vec<_> = statistics
            .designs
            .iter()
            .map(|design| {
                let mut sum = DMatrix::zeros(rank, rank);
                let parts = design.normals.iter().zip(&self.noise);
                for (normal, variance) in parts {
                    if let Some(normal) = normal {
                        sum.zip_apply(normal, |sum, value| *sum += value / variance);
                    }
                }
                sum
            })
            .collect();
        let precision = DVector::from_iterator(statistics.dofs, self.noise.iter().map(|v| 1.0 / v));
        let count = statistics.designs.len();
        let mut factors: Vec<Option<Cholesky<f64, _>>> = vec![None; statistics.skills * count];
        let mut out = Posterior {
            log_likelihood: 0.0,
            means: Vec::with_capacity(statistics.movements.len()),
            standard: Vec::with_capacity(statistics.movements.len()),
            covariances: vec![None; statistics.skills * count],
        };
        for one in &statistics.movements {
            let (mean, root) = (&self.means[one.skill], &self.roots[one.skill]);
            let information = &informations[one.design];
            let at = one.skill * count + one.design;
            if factors[at].is_none() {
                let mut inner = root.transpose() * (information * root);
                for k in 0..rank {
                    inner[(k, k)] += 1.0;
                }
                let factor = Cholesky::new(inner).ok_or(FAILED)?;
                // P = (R^-1)^T R^-1 of R R^T = I + L^T A L.
                let mut half = DMatrix::identity(rank, rank);
                factor.l_dirty().solve_lower_triangular_mut(&mut half);
                out.covariances[at] = Some(half.transpose() * half);
                factors[at] = Some(factor);
            }
            let Some(factor) = &factors[at] else {
                return Err(FAILED);
            };
            let pull = &one.pull * &precision;
            let mut u = root.tr_mul(&(&pull + information * (&one.centre - mean)));
            factor.solve_mut(&mut u);
            let c = mean + root * &u;
            let off = &c - &one.centre;
            let left: f64 = one
                .left
                .iter()
                .zip(precision.iter())
                .map(|(s, p)| s * p)
                .sum();
            let left = left - 2.0 * off.dot(&pull) + off.dot(&(information * &off));
            let logs = statistics.designs[one.design]
                .counts
                .iter()
                .zip(&self.noise);
            let logs: f64 = logs
                .map(|(count, v)| count * libm::log(core::f64::consts::TAU * v))
                .sum();
            let lower = factor.l_dirty();
            let determinant: f64 = (0..rank).map(|k| 2.0 * libm::log(lower[(k, k)])).sum();
            out.log_likelihood -= 0.5 * (logs + determinant + left + u.norm_squared());
            out.means.push(c);
            out.standard.push(u);
        }
        Ok(out)
    }

    /// The M step.
    pub(super) fn maximise(
        &self,
        statistics: &Statistics,
        posterior: &Posterior,
    ) -> Result<Self, LearnError> {
        let rank = statistics.directions.ncols();
        let count = statistics.designs.len();
        let mut members = vec![vec![0.0_f64; count]; statistics.skills];
        let mut sums = vec![DVector::zeros(rank); statistics.skills];
        let mut squares = vec![DMatrix::zeros(rank, rank); statistics.skills];
        // Second moments of c about the centre, of each design.
        let mut moments = vec![DMatrix::zeros(rank, rank); count];
        let mut left = vec![0.0; statistics.dofs];
        for (n, one) in statistics.movements.iter().enumerate() {
            let u = &posterior.standard[n];
            members[one.skill][one.design] += 1.0;
            sums[one.skill] += u;
            squares[one.skill].ger(1.0, u, u, 1.0);
            let off = &posterior.means[n] - &one.centre;
            moments[one.design].ger(1.0, &off, &off, 1.0);
            for (dof, sum) in left.iter_mut().enumerate() {
                *sum += one.left[dof] - 2.0 * off.dot(&one.pull.column(dof));
            }
        }
        let mut next = Self {
            means: Vec::with_capacity(statistics.skills),
            roots: Vec::with_capacity(statistics.skills),
            noise: Vec::with_capacity(statistics.dofs),
        };
        for (skill, mut square) in squares.into_iter().enumerate() {
            let root = &self.roots[skill];
            for (design, &n) in members[skill].iter().enumerate() {
                if let Some(covariance) = &posterior.covariances[skill * count + design] {
                    square += covariance * n;
                    moments[design] += root * covariance * root.transpose() * n;
                }
            }
            let n: f64 = members[skill].iter().sum();
            let mean = &sums[skill] / n;
            square /= n;
            square.ger(-1.0, &mean, &mean, 1.0);
            next.means.push(&self.means[skill] + root * mean);
            next.roots.push(root * lower(square)?);
        }
        for (dof, (sum, total)) in left.into_iter().zip(statistics.counts()).enumerate() {
            let designs = statistics.designs.iter().zip(&moments);
            let spread = designs.filter_map(|(design, moments)| {
                let normal = design.normals[dof].as_ref()?;
                Some(normal.dot(moments))
            });
            let variance = (sum + spread.sum::<f64>()) / total;
            next.noise.push(variance.max(NOISE_FLOOR));
        }
        Ok(next)
    }
}

const FAILED: LearnError = LearnError::Numerical("factorisation of a covariance");

/// The lower Cholesky factor.
fn lower(covariance: DMatrix<f64>) -> Result<DMatrix<f64>, LearnError> {
    let factor = Cholesky::new(covariance).ok_or(FAILED)?;
    Ok(factor.unpack())
}
