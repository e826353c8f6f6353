//! Dynamic movement primitives for the robot's motion and stiffness, their goals set by hand.
//!
//! Ijspeert et al. (2013, *Dynamical movement primitives*, Neural Computation 25), the goal's change blended in as by
//! Pastor et al. (2009), so that a goal near the start does no harm; stiffness as one more DoF, as Yang et al. (2018)
//! do:
//!
//! ```text
//! y'' = a (b (g - y) - y' - b (g - y0) z) + z sum_k psi_k(z) w_k / sum_k psi_k(z),   z = exp(-c s)
//! ```
//!
//! with time in units of the movement's duration. The weights are those of least squares on the mean demonstration.
//! A DMP infers no goal. Motion: the demonstrations' mean end, displaced as the observed hand is from its mean, by a
//! mapping between the axes of person and robot that is set by hand. Stiffness: the mean end of the demonstrations,
//! whatever the person does, which is what the paper holds against Yang 2018. It recognises nothing (the skill must be
//! told), it has no interval, and it says nothing about the person.

use nalgebra::{Cholesky, DMatrix, DVector};

use super::aligned::{Aligned, SAMPLES};
use super::{Answer, BaselineError, Observed, Path, Roles};
use crate::demonstration::Demonstration;
use crate::model::Dof;

/// Spring of the transformation system, and its damping to be critical.
const SPRING: f64 = 25.0;
const SHARE: f64 = SPRING / 4.0;
/// The canonical system's `z` at the end.
const LAST_Z: f64 = 0.01;
/// Value of each function at its neighbour's centre.
const OVERLAP: f64 = 0.8;
/// Functions of the forcing term.
const FUNCTIONS: usize = 20;
/// Steps of the integration between two samples.
const STEPS: usize = 10;
/// Ridge of the least squares, as a share of the mean diagonal.
const RIDGE: f64 = 1e-9;

/// One DMP for each of the robot's DoFs and each skill.
#[derive(Debug, Clone)]
pub struct Dmp {
    aligned: Aligned,
    roles: Roles,
    /// `[label]`: `SAMPLES x D`.
    mean: Vec<DMatrix<f64>>,
    /// `[label][robot DoF]`.
    weights: Vec<Vec<Vec<f64>>>,
}

impl Dmp {
    /// Fits the mean demonstration of every skill.
    ///
    /// # Errors
    /// No demonstrations, or some of other DoFs.
    pub fn learn(
        train: &[Demonstration],
        dofs: &[Dof],
        roles: Roles,
    ) -> Result<Self, BaselineError> {
        let aligned = Aligned::new(train, dofs)?;
        let (mut mean, mut weights) = (Vec::new(), Vec::new());
        for label in 0..aligned.labels.len() {
            let mut sum = DMatrix::zeros(SAMPLES, dofs.len());
            for series in aligned.of_label(label) {
                sum += series;
            }
            let of_label = sum / aligned.of_label(label).count() as f64;
            let fitted = robot_dofs(&roles).map(|dof| fit(of_label.column(dof).as_slice()));
            weights.push(fitted.collect::<Result<Vec<_>, _>>()?);
            mean.push(of_label);
        }
        Ok(Self {
            aligned,
            roles,
            mean,
            weights,
        })
    }

    /// The robot's movement of the skill that `label` tells.
    ///
    /// # Errors
    /// A label that was not learnt, an observation without a logarithm.
    pub fn answer(
        &self,
        observed: &Observed,
        phases: &[f64],
        label: &str,
    ) -> Result<Answer, BaselineError> {
        let told = self.aligned.labels.iter().position(|l| l == label);
        let told = told.ok_or(BaselineError::Protocol {
            what: "a movement of a skill that no demonstration shows",
            wanted: "tests of the skills learnt",
        })?;
        let mean = &self.mean[told];
        let shift = self.shift(observed, mean)?;
        let mut paths = vec![None; self.aligned.dofs().len()];
        for (index, dof) in robot_dofs(&self.roles).enumerate() {
            let goal = mean[(SAMPLES - 1, dof)] + shift.get(index).copied().unwrap_or(0.0);
            let weights = &self.weights[told][index];
            let rolled = rollout(weights, mean[(0, dof)], goal, (SAMPLES - 1) * STEPS);
            let at: Vec<f64> = phases.iter().map(|p| between(&rolled, *p)).collect();
            paths[dof] = Some(self.aligned.path(dof, &at, None));
        }
        Ok(Answer {
            log_posterior: None,
            recognised: None,
            paths: paths.into_iter().collect::<Vec<Option<Path>>>(),
        })
    }

    /// How far the robot's goal moves on each axis, standardised: as the hand did from its mean when last seen.
    fn shift(&self, observed: &Observed, mean: &DMatrix<f64>) -> Result<[f64; 3], BaselineError> {
        let seen = self.aligned.standardised(observed)?;
        let (Some(last), Some(&phase)) = (seen.last(), observed.phases.last()) else {
            return Ok([0.0; 3]);
        };
        Ok(std::array::from_fn(|axis| {
            let hand = self.roles.hand[axis];
            let Some(place) = last.which.iter().position(|&dof| dof == hand) else {
                return 0.0;
            };
            let expected = between(mean.column(hand).as_slice(), phase);
            let metres = (last.values[place] - expected) * self.aligned.scale(hand);
            self.roles.facing[axis] * metres / self.aligned.scale(self.roles.robot[axis])
        }))
    }
}

fn robot_dofs(roles: &Roles) -> impl Iterator<Item = usize> {
    roles.robot.into_iter().chain(roles.robot_stiffness)
}

/// Linear interpolation of equally spaced values over phases 0 to 1.
fn between(values: &[f64], phase: f64) -> f64 {
    let last = values.len() - 1;
    let at = phase.clamp(0.0, 1.0) * last as f64;
    let before = (libm::floor(at) as usize).min(last.saturating_sub(1));
    let after = (before + 1).min(last);
    values[before] + (at - before as f64) * (values[after] - values[before])
}

/// The forcing term's functions times `z` at a phase.
fn forcing(phase: f64, functions: usize) -> Vec<f64> {
    let decay = -libm::log(LAST_Z);
    let z = libm::exp(-decay * phase);
    let centre = |k: usize| libm::exp(-decay * k as f64 / (functions - 1) as f64);
    let width = |k: usize| {
        let k = k.min(functions - 2);
        -libm::log(OVERLAP) / (centre(k + 1) - centre(k)).powi(2)
    };
    let values: Vec<f64> = (0..functions)
        .map(|k| libm::exp(-width(k) * (z - centre(k)).powi(2)))
        .collect();
    let sum: f64 = values.iter().sum();
    values.iter().map(|value| z * value / sum).collect()
}

/// Integrates the DMP from rest at `start` to `goal` by fourth-order Runge-Kutta: `steps + 1` values, equally spaced
/// from phase 0 to 1.
#[must_use]
pub fn rollout(weights: &[f64], start: f64, goal: f64, steps: usize) -> Vec<f64> {
    let decay = -libm::log(LAST_Z);
    let acceleration = |phase: f64, y: f64, v: f64| {
        let functions = forcing(phase, weights.len());
        let force: f64 = functions.iter().zip(weights).map(|(f, w)| f * w).sum();
        let z = libm::exp(-decay * phase);
        SPRING * (SHARE * (goal - y) - v - SHARE * (goal - start) * z) + force
    };
    let h = 1.0 / steps as f64;
    let (mut y, mut v) = (start, 0.0);
    let mut out = vec![start];
    for step in 0..steps {
        let phase = step as f64 * h;
        let a1 = acceleration(phase, y, v);
        let (v2, y2) = (v + 0.5 * h * a1, y + 0.5 * h * v);
        let a2 = acceleration(phase + 0.5 * h, y2, v2);
        let (v3, y3) = (v + 0.5 * h * a2, y + 0.5 * h * v2);
        let a3 = acceleration(phase + 0.5 * h, y3, v3);
        let (v4, y4) = (v + h * a3, y + h * v3);
        let a4 = acceleration(phase + h, y4, v4);
        y += h / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4);
        v += h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
        out.push(y);
    }
    out
}

/// Weights with which the rollout comes nearest to `path` (equally spaced samples). The system is linear: the rollout
/// is that without forcing and the weighted responses to each function, so no derivative of the samples is needed.
///
/// # Errors
/// A factorisation that fails.
pub fn fit(path: &[f64]) -> Result<Vec<f64>, BaselineError> {
    let samples = path.len();
    let steps = (samples - 1) * STEPS;
    let sampled = |values: Vec<f64>| values.into_iter().step_by(STEPS);
    let mut responses = DMatrix::zeros(samples, FUNCTIONS);
    for k in 0..FUNCTIONS {
        let mut one = vec![0.0; FUNCTIONS];
        one[k] = 1.0;
        let response: Vec<f64> = sampled(rollout(&one, 0.0, 0.0, steps)).collect();
        responses.column_mut(k).copy_from_slice(&response);
    }
    let free = sampled(rollout(
        &[0.0; FUNCTIONS],
        path[0],
        path[samples - 1],
        steps,
    ));
    let left = DVector::from_iterator(samples, path.iter().zip(free).map(|(y, f)| y - f));
    let mut normal = responses.tr_mul(&responses);
    let ridge = RIDGE * normal.trace() / FUNCTIONS as f64;
    for k in 0..FUNCTIONS {
        normal[(k, k)] += ridge;
    }
    let factor = Cholesky::new(normal).ok_or(BaselineError::Numerical("fit of a DMP"))?;
    Ok(factor.solve(&responses.tr_mul(&left)).as_slice().to_vec())
}
