//! The most probable parameters: damped Gauss-Newton inside, the noise's variance outside.

use nalgebra::{Cholesky, DMatrix, DVector, Vector3};
use tonus_shared::stiffness::Segments;

use super::{FitError, Load, Log, PARAMETERS, PRIOR_STD, Square, expected, prior};

/// Noise to begin with, m^2: a few millimetres.
const FIRST_VARIANCE_M2: f64 = 9e-6;
/// A tenth of a micrometre: no tracker is better, and nothing is divided by zero.
const LEAST_VARIANCE_M2: f64 = 1e-14;
/// The variance is found when it changes by less than this share.
const SETTLED: f64 = 1e-3;
const MOST_ROUNDS: usize = 30;
const MOST_STEPS: usize = 50;
/// Of the logarithms: far above rounding, far below any interval.
const CLOSE: f64 = 1e-8;
/// Half the step of a central difference: the error is its square.
const DIFFERENCE: f64 = 1e-5;

/// Where the descent ends.
pub(super) struct Found {
    pub(super) log: Log,
    pub(super) covariance: Square,
    /// Of one hold's place on one axis, m^2.
    pub(super) variance: f64,
    /// Sum of the squared whitened residuals, m^2.
    pub(super) squares: f64,
    /// Places of the loads that fit worst, worst first.
    pub(super) worst: Vec<usize>,
}

/// One end of a descent at a fixed variance.
pub(super) struct Descent {
    pub(super) log: Log,
    pub(super) squares: f64,
    /// `J^T J`, whitened, m^2.
    information: Square,
}

pub(super) fn most_probable(segments: &Segments<f64>, loads: &[Load]) -> Result<Found, FitError> {
    let mut variance = FIRST_VARIANCE_M2;
    let mut log = start(segments, loads).ok_or(FitError::NoFit)?;
    for _ in 0..MOST_ROUNDS {
        let descent = descend(segments, loads, log, variance).ok_or(FitError::NoFit)?;
        let covariance = covariance(&descent.information, variance).ok_or(FitError::NoFit)?;
        log = descent.log;
        // Parameters that the prior holds cost no degree of freedom.
        let spent = (descent.information / variance * covariance).trace();
        let freedom = (3 * loads.len()) as f64 - spent;
        let next = (descent.squares / freedom).max(LEAST_VARIANCE_M2);
        let settled = (next / variance - 1.0).abs() < SETTLED;
        variance = next;
        if settled || variance == LEAST_VARIANCE_M2 {
            break;
        }
    }
    let last = descend(segments, loads, log, variance).ok_or(FitError::NoFit)?;
    let worst = worst(segments, loads, &last.log).ok_or(FitError::NoFit)?;
    Ok(Found {
        worst,
        log: last.log,
        covariance: covariance(&last.information, variance).ok_or(FitError::NoFit)?,
        variance,
        squares: last.squares,
    })
}

fn worst(segments: &Segments<f64>, loads: &[Load], log: &Log) -> Option<Vec<usize>> {
    let residual = residuals(segments, loads, log)?;
    let square = |at: &usize| residual.fixed_rows::<3>(3 * at).norm_squared();
    let mut places: Vec<usize> = (0..loads.len()).collect();
    places.sort_by(|a, b| square(b).total_cmp(&square(a)));
    Some(places)
}

/// The prior's medians, or a stiffer arm where that one would fall under the loads.
fn start(segments: &Segments<f64>, loads: &[Load]) -> Option<Log> {
    [1.0_f64, 2.0, 4.0, 8.0].into_iter().find_map(|stiffer| {
        let mut log = prior();
        for at in 2..PARAMETERS {
            log[at] += stiffer.ln();
        }
        residuals(segments, loads, &log).map(|_| log)
    })
}

/// Damped Gauss-Newton from `log` on; none where the parameters explain nothing.
pub(super) fn descend(
    segments: &Segments<f64>,
    loads: &[Load],
    mut log: Log,
    variance: f64,
) -> Option<Descent> {
    let mut residual = residuals(segments, loads, &log)?;
    let mut damping = 1e-3;
    for _ in 0..MOST_STEPS {
        let slope = slope(segments, loads, &log)?;
        let (downhill, information) = normal(&slope, &residual, &log, variance);
        let cost = cost(&residual, &log, variance);
        let mut moved = None;
        while damping < 1e12 {
            let mut damped = information;
            for at in 0..PARAMETERS {
                damped[(at, at)] *= 1.0 + damping;
            }
            let step = Cholesky::new(damped)?.solve(&downhill);
            let there = log + step;
            let better = residuals(segments, loads, &there)
                .filter(|residual| self::cost(residual, &there, variance) <= cost);
            if let Some(better) = better {
                (log, residual) = (there, better);
                damping *= 0.1;
                moved = Some(step.amax());
                break;
            }
            damping *= 10.0;
        }
        if moved.is_none_or(|step| step < CLOSE) {
            break;
        }
    }
    let slope = slope(segments, loads, &log)?;
    let information = fixed(&(slope.tr_mul(&slope)));
    Some(Descent {
        log,
        squares: residual.norm_squared(),
        information,
    })
}

/// The slope downhill and the curvature of the cost, priors included.
fn normal(
    slope: &DMatrix<f64>,
    residual: &DVector<f64>,
    log: &Log,
    variance: f64,
) -> (Log, Square) {
    let mut information = fixed(&slope.tr_mul(slope)) / variance;
    let gradient = slope.tr_mul(residual) / variance;
    let mut downhill = Log::from_fn(|at, _| gradient[at]);
    let from_prior = prior() - log;
    for at in 0..PARAMETERS {
        let weight = PRIOR_STD[at].powi(-2);
        information[(at, at)] += weight;
        downhill[at] += weight * from_prior[at];
    }
    (downhill, information)
}

fn covariance(information: &Square, variance: f64) -> Option<Square> {
    let mut posterior = information / variance;
    for at in 0..PARAMETERS {
        posterior[(at, at)] += PRIOR_STD[at].powi(-2);
    }
    Cholesky::new(posterior).map(|root| root.inverse())
}

fn cost(residual: &DVector<f64>, log: &Log, variance: f64) -> f64 {
    let from_prior = (log - prior()).component_div(&Log::from(PRIOR_STD));
    residual.norm_squared() / variance + from_prior.norm_squared()
}

/// Whitened: measured less expected, three numbers for each load.
fn residuals(segments: &Segments<f64>, loads: &[Load], log: &Log) -> Option<DVector<f64>> {
    let apart: Option<Vec<Vector3<f64>>> = loads
        .iter()
        .map(|load| Some(load.moved_m - expected(segments, load, log)?))
        .collect();
    Some(whitened(loads, &apart?))
}

/// How the whitened expectations change with each parameter, by central differences.
fn slope(segments: &Segments<f64>, loads: &[Load], log: &Log) -> Option<DMatrix<f64>> {
    let mut slope = DMatrix::zeros(3 * loads.len(), PARAMETERS);
    for at in 0..PARAMETERS {
        let step = Log::ith(at, DIFFERENCE);
        let above = residuals(segments, loads, &(log + step))?;
        let below = residuals(segments, loads, &(log - step))?;
        slope.set_column(at, &((below - above) / (2.0 * DIFFERENCE)));
    }
    Some(slope)
}

/// Errors of m loads against one unloaded hold have the covariance `I + 1 1^T`; its inverse root is
/// `I - (1 - 1 / sqrt(1 + m)) 1 1^T / m`.
fn whitened(loads: &[Load], apart: &[Vector3<f64>]) -> DVector<f64> {
    let mut white = DVector::zeros(3 * loads.len());
    for (at, load) in loads.iter().enumerate() {
        let group = loads.iter().zip(apart);
        let (count, sum) = group
            .filter(|(other, _)| other.group == load.group)
            .fold((0.0, Vector3::zeros()), |(count, sum), (_, apart)| {
                (count + 1.0, sum + apart)
            });
        let shared = sum * ((1.0 - 1.0 / (1.0_f64 + count).sqrt()) / count);
        white
            .fixed_rows_mut::<3>(3 * at)
            .copy_from(&(apart[at] - shared));
    }
    white
}

fn fixed(square: &DMatrix<f64>) -> Square {
    Square::from_fn(|row, column| square[(row, column)])
}
