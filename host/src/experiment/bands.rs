//! What a model expects a movement to be recorded as, held against the recording.

use super::ExperimentError;
use super::figures::{Band, Inference};
use super::look::{ROBOT, ROBOT_STIFFNESS};
use super::widths::Widths;
use crate::demonstration::Demonstration;
use crate::model::recognise::Recogniser;
use crate::model::{Dof, Model, Transform};
use crate::session::DOFS;
use crate::statistics::{mean, root_mean_square};

/// Every so many samples of a recording are compared: neighbours say the same.
const STRIDE: usize = 4;
/// Quantile of the pointwise 95 % interval.
const NORMAL_975: f64 = 1.959_963_984_540_054;

/// What `skill`, given what `recogniser` has observed, expects at the recorded instants of `movement`.
///
/// `widths` scales each DoF's intervals. The interval is that of a *recorded* value: the movement's own uncertainty, and the variance that sensors and basis
/// leave of a single sample, which the model learnt as its residual.
pub(super) fn infer(
    recogniser: &mut Recogniser<'_>,
    (skill, widths): (usize, &Widths),
    movement: &Demonstration,
) -> Result<Vec<Band>, ExperimentError> {
    let phases = compared(movement.phases(), movement);
    let model = recogniser.model();
    let of_dof = |dof: usize| {
        let mut band = Band {
            mean: Vec::with_capacity(phases.len()),
            low: Vec::with_capacity(phases.len()),
            high: Vec::with_capacity(phases.len()),
            truth: compared(movement.values()[dof].iter().copied(), movement),
        };
        for &phase in &phases {
            let predicted = recogniser.predict(skill, dof, phase)?;
            let moments = (predicted.mean, predicted.std);
            let (low, high) = interval(model, dof, moments, widths[dof]);
            band.mean.push(predicted.mean);
            band.low.push(low);
            band.high.push(high);
        }
        Ok(band)
    };
    (0..DOFS.len()).map(of_dof).collect()
}

/// Every [`STRIDE`]th of the values at the samples of `movement`, the last among them.
fn compared(values: impl Iterator<Item = f64>, movement: &Demonstration) -> Vec<f64> {
    let first = (movement.t_s().len() - 1) % STRIDE;
    values.skip(first).step_by(STRIDE).collect()
}

/// Pointwise 95 % interval of a recorded value whose movement has this mean and standard deviation, DoF's unit; its
/// half-width, where the DoF is a Gaussian, times `width`.
fn interval(model: &Model, dof: usize, (mean, std): (f64, f64), width: f64) -> (f64, f64) {
    let residual = model.parts().residual_variance[dof];
    match model.dofs()[dof].transform {
        Transform::Identity => {
            let half = width * NORMAL_975 * libm::sqrt(std * std + residual);
            (mean - half, mean + half)
        }
        Transform::Log => {
            // Back from the log-normal's moments to the logarithm's.
            let variance = libm::log1p((std / mean) * (std / mean));
            let middle = libm::log(mean) - 0.5 * variance;
            let half = width * NORMAL_975 * libm::sqrt(variance + residual);
            (libm::exp(middle - half), libm::exp(middle + half))
        }
    }
}

/// Middle and half-width of an interval where the DoF is a Gaussian.
pub(super) fn centre_and_half(dof: &Dof, (low, high): (f64, f64)) -> (f64, f64) {
    let [low, high] = match dof.transform {
        Transform::Identity => [low, high],
        Transform::Log => [low, high].map(libm::log),
    };
    (0.5 * (low + high), 0.5 * (high - low))
}

/// Range of each robot stiffness in the demonstrations, N/m.
pub(super) fn robot_stiffness_ranges(demonstrations: &[Demonstration]) -> [f64; 3] {
    ROBOT_STIFFNESS.map(|dof| {
        let values = demonstrations.iter().flat_map(|d| &d.values()[dof]);
        let ends = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &v| {
            (low.min(v), high.max(v))
        });
        ends.1 - ends.0
    })
}

/// How far bands are from what was recorded.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Errors {
    /// Distance between inferred and recorded end of the robot's path, metres.
    pub(super) end_point_m: f64,
    /// Root mean square distance along the robot's path, metres.
    pub(super) path_m: f64,
    /// Root mean square error of the robot's stiffness over its range, mean of three axes.
    pub(super) stiffness: f64,
    /// Share of recorded values inside the interval, per DoF.
    pub(super) covered: [f64; DOFS.len()],
}

impl Errors {
    pub(super) fn of(bands: &[Band], ranges: &[f64; 3]) -> Self {
        let off = |dof: usize| -> Vec<f64> {
            bands.get(dof).map_or_else(Vec::new, |band| {
                band.mean
                    .iter()
                    .zip(&band.truth)
                    .map(|(m, t)| m - t)
                    .collect()
            })
        };
        let [x, y, z] = ROBOT.map(off);
        let distance = |((x, y), z): ((&f64, &f64), &f64)| libm::sqrt(x * x + y * y + z * z);
        let distances: Vec<f64> = x.iter().zip(&y).zip(&z).map(distance).collect();
        let stiffness = ROBOT_STIFFNESS.map(|dof| root_mean_square(&off(dof)));
        let shares: Vec<f64> = stiffness
            .iter()
            .zip(ranges)
            .map(|(k, range)| k / range)
            .collect();
        Self {
            end_point_m: distances.last().copied().unwrap_or(f64::NAN),
            path_m: root_mean_square(&distances),
            stiffness: mean(&shares),
            covered: std::array::from_fn(|dof| bands.get(dof).map_or(f64::NAN, covered)),
        }
    }

    /// Mean over DoFs.
    pub(super) fn coverage(&self) -> f64 {
        mean(&self.covered)
    }
}

fn covered(band: &Band) -> f64 {
    let ends = band.low.iter().zip(&band.high).zip(&band.truth);
    let inside = ends
        .filter(|((low, high), truth)| (*low..=*high).contains(truth))
        .count();
    inside as f64 / band.truth.len() as f64
}

/// Bands as a figure shows them.
pub(super) fn figure(
    name: String,
    recognised: &str,
    movement: &Demonstration,
    (look, bands): (&[super::figures::Observed], Vec<Band>),
) -> Inference {
    Inference {
        name,
        performed: movement.label().to_owned(),
        recognised: recognised.to_owned(),
        observed: look.to_vec(),
        phases: compared(movement.phases(), movement),
        bands,
    }
}
