//! What came of the movements that were tested.

use super::{Method, Row};
use crate::baseline::{Answer, Path, Roles};
use crate::demonstration::Demonstration;
use crate::statistics::{mean, median, root_mean_square};

/// Every so many samples of a recording are compared: neighbours say the same.
const STRIDE: usize = 4;

/// Every [`STRIDE`]th of the values at the samples of `movement`, the last among them.
pub(super) fn compared(values: impl Iterator<Item = f64>, movement: &Demonstration) -> Vec<f64> {
    let first = (movement.t_s().len() - 1) % STRIDE;
    values.skip(first).step_by(STRIDE).collect()
}

/// Range of each robot stiffness in the demonstrations.
pub(super) fn ranges(train: &[Demonstration], roles: &Roles) -> [f64; 3] {
    roles.robot_stiffness.map(|dof| {
        let values = train.iter().flat_map(|one| &one.values()[dof]);
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &v| {
            (low.min(v), high.max(v))
        });
        high - low
    })
}

/// What came of all movements.
#[derive(Debug, Clone, Default)]
pub(super) struct Score {
    right: Vec<bool>,
    log_probability: Vec<f64>,
    end_point_m: Vec<f64>,
    path_m: Vec<f64>,
    stiffness: Vec<f64>,
    inside: usize,
    outside: usize,
}

impl Score {
    pub(super) fn recognised(&mut self, answer: &Answer, label: Option<usize>) {
        if let Some(recognised) = answer.recognised {
            self.right.push(Some(recognised) == label);
        }
        if let Some(log_posterior) = &answer.log_posterior {
            let own = label.and_then(|label| log_posterior.get(label));
            self.log_probability
                .push(own.copied().unwrap_or(f64::NEG_INFINITY));
        }
    }

    pub(super) fn predicted(
        &mut self,
        paths: &[Option<Path>],
        movement: &Demonstration,
        (roles, ranges): (&Roles, &[f64; 3]),
    ) {
        let truth = |dof: usize| compared(movement.values()[dof].iter().copied(), movement);
        let off = |dof: usize| -> Option<Vec<f64>> {
            let path = paths.get(dof)?.as_ref()?;
            Some(
                path.mean
                    .iter()
                    .zip(truth(dof))
                    .map(|(m, t)| m - t)
                    .collect(),
            )
        };
        if let [Some(x), Some(y), Some(z)] = roles.robot.map(off) {
            let distance = |i: usize| libm::sqrt(x[i] * x[i] + y[i] * y[i] + z[i] * z[i]);
            let distances: Vec<f64> = (0..x.len()).map(distance).collect();
            self.end_point_m.extend(distances.last());
            self.path_m.push(root_mean_square(&distances));
        }
        if let [Some(x), Some(y), Some(z)] = roles.robot_stiffness.map(off) {
            let shares = [x, y, z]
                .iter()
                .zip(ranges)
                .map(|(k, range)| root_mean_square(k) / range)
                .sum::<f64>();
            self.stiffness.push(shares / 3.0);
        }
        for (dof, path) in paths.iter().enumerate() {
            let Some(interval) = path.as_ref().and_then(|path| path.interval_95.as_ref()) else {
                continue;
            };
            for ((low, high), value) in interval.iter().zip(truth(dof)) {
                if (*low..=*high).contains(&value) {
                    self.inside += 1;
                } else {
                    self.outside += 1;
                }
            }
        }
    }

    pub(super) fn row(&self, method: Method, several: bool) -> Row {
        let (method, source) = method.name();
        let right: Vec<f64> = self.right.iter().map(|r| f64::from(u8::from(*r))).collect();
        let loss: Vec<f64> = self.log_probability.iter().map(|l| 0.0 - l).collect();
        let judged = self.inside + self.outside;
        Row {
            method,
            source,
            // With one label there is nothing to recognise.
            accuracy: known(mean, &right).filter(|_| several),
            log_loss: known(mean, &loss).filter(|_| several),
            end_point_error_m: known(median, &self.end_point_m),
            path_rmse_m: known(median, &self.path_m),
            stiffness_nrmse: known(mean, &self.stiffness),
            coverage_95: (judged > 0).then(|| self.inside as f64 / judged as f64),
        }
    }
}

/// Nothing of no values.
fn known(figure: fn(&[f64]) -> f64, values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| figure(values))
}
