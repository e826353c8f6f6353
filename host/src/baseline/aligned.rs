//! Demonstrations as methods without a basis want them: sampled at the same phases, every DoF scaled alike.

use nalgebra::DMatrix;

use super::gaussian::Seen;
use super::{BaselineError, Observed, Path, labels_of};
use crate::demonstration::Demonstration;
use crate::model::{Dof, Transform};

/// Phases that demonstrations are sampled at.
pub(super) const SAMPLES: usize = 50;
/// Quantile of the pointwise 95 % interval.
const NORMAL_975: f64 = 1.959_963_984_540_054;

/// All demonstrations, standardised.
#[derive(Debug, Clone)]
pub(super) struct Aligned {
    /// Sorted.
    pub(super) labels: Vec<String>,
    /// Of each demonstration.
    pub(super) label: Vec<usize>,
    /// Of each demonstration, `SAMPLES x D`, in units of each DoF's scale from its mean.
    pub(super) series: Vec<DMatrix<f64>>,
    dofs: Vec<Dof>,
    mean: Vec<f64>,
    scale: Vec<f64>,
}

impl Aligned {
    pub(super) fn new(train: &[Demonstration], dofs: &[Dof]) -> Result<Self, BaselineError> {
        if train.is_empty() {
            return Err(BaselineError::None("learn from"));
        }
        let mut series = Vec::with_capacity(train.len());
        for demonstration in train {
            series.push(sampled(demonstration, dofs)?);
        }
        let count = (train.len() * SAMPLES) as f64;
        let mut mean = vec![0.0; dofs.len()];
        let mut scale = vec![0.0; dofs.len()];
        for dof in 0..dofs.len() {
            mean[dof] = series.iter().map(|s| s.column(dof).sum()).sum::<f64>() / count;
            let square =
                |s: &DMatrix<f64>| -> f64 { s.column(dof).map(|v| (v - mean[dof]).powi(2)).sum() };
            scale[dof] = libm::sqrt(series.iter().map(square).sum::<f64>() / count);
            if !(scale[dof] > 0.0 && scale[dof].is_finite()) {
                return Err(BaselineError::Numerical("scaling of a DoF"));
            }
            for one in &mut series {
                for value in one.column_mut(dof).iter_mut() {
                    *value = (*value - mean[dof]) / scale[dof];
                }
            }
        }
        let (labels, label) = labels_of(train);
        Ok(Self {
            labels,
            label,
            series,
            dofs: dofs.to_vec(),
            mean,
            scale,
        })
    }

    pub(super) fn dofs(&self) -> &[Dof] {
        &self.dofs
    }

    /// Standard deviation of a DoF in all demonstrations, as it enters the methods.
    pub(super) fn scale(&self, dof: usize) -> f64 {
        self.scale[dof]
    }

    /// Demonstrations of a label.
    pub(super) fn of_label(&self, label: usize) -> impl Iterator<Item = &DMatrix<f64>> {
        let pairs = self.series.iter().zip(&self.label);
        pairs.filter(move |(_, l)| **l == label).map(|(s, _)| s)
    }

    /// Log share of a label.
    pub(super) fn log_prior(&self, label: usize) -> f64 {
        libm::log(self.of_label(label).count() as f64 / self.series.len() as f64)
    }

    /// What is observed, one [`Seen`] for each phase; indices are DoFs.
    pub(super) fn standardised(&self, observed: &Observed) -> Result<Vec<Seen>, BaselineError> {
        let mut all = Vec::with_capacity(observed.phases.len());
        for j in 0..observed.phases.len() {
            let mut seen = Seen::default();
            for (i, &dof) in observed.dofs.iter().enumerate() {
                let signal = self.dofs.get(dof).ok_or(BaselineError::Protocol {
                    what: "an observed DoF that there is not",
                    wanted: "indices of the protocol's DoFs",
                })?;
                let (value, std) = (observed.values[i][j], observed.std[i][j]);
                seen.which.push(dof);
                seen.values
                    .push((signal.encode(value)? - self.mean[dof]) / self.scale[dof]);
                let variance = signal.encode_variance(value, std)?;
                seen.noise.push(variance / self.scale[dof].powi(2));
            }
            all.push(seen);
        }
        Ok(all)
    }

    /// A DoF's path in its unit from standardised means, and variances for methods that have them.
    pub(super) fn path(&self, dof: usize, mean: &[f64], variance: Option<&[f64]>) -> Path {
        let signal = &self.dofs[dof];
        let (centre, scale) = (self.mean[dof], self.scale[dof]);
        let one = |i: usize| {
            let middle = centre + scale * mean[i];
            let spread = variance.map_or(0.0, |v| scale * scale * v[i].max(0.0));
            let half = NORMAL_975 * libm::sqrt(spread);
            let (low, high) = match signal.transform {
                Transform::Identity => (middle - half, middle + half),
                Transform::Log => (libm::exp(middle - half), libm::exp(middle + half)),
            };
            (signal.decode(middle, spread).0, (low, high))
        };
        let (mean, interval): (Vec<f64>, Vec<(f64, f64)>) = (0..mean.len()).map(one).unzip();
        Path {
            mean,
            interval_95: variance.map(|_| interval),
        }
    }
}

/// Encoded values at [`SAMPLES`] phases, `SAMPLES x D`.
fn sampled(demonstration: &Demonstration, dofs: &[Dof]) -> Result<DMatrix<f64>, BaselineError> {
    let (expected, got) = (dofs.len(), demonstration.values().len());
    if expected != got {
        return Err(BaselineError::Dofs {
            label: demonstration.label().to_owned(),
            expected,
            got,
        });
    }
    let mut out = DMatrix::zeros(SAMPLES, dofs.len());
    for (index, dof) in dofs.iter().enumerate() {
        for sample in 0..SAMPLES {
            let value = demonstration.value_at(index, phase_of(sample));
            out[(sample, index)] = dof.encode(value.unwrap_or(f64::NAN))?;
        }
    }
    Ok(out)
}

/// Phase of a sample.
pub(super) fn phase_of(sample: usize) -> f64 {
    sample as f64 / (SAMPLES - 1) as f64
}

/// What was observed at `phase`, linearly between the observations around it; nothing before the first and after the
/// last of them, but within half a sample.
pub(super) fn seen_at(phases: &[f64], seen: &[Seen], phase: f64) -> Seen {
    let near = 0.5 / (SAMPLES - 1) as f64;
    let next = phases.partition_point(|&p| p < phase);
    for index in [Some(next), next.checked_sub(1)].into_iter().flatten() {
        if phases.get(index).is_some_and(|p| (p - phase).abs() <= near) {
            return seen[index].clone();
        }
    }
    let Some(before) = next.checked_sub(1).filter(|_| next < phases.len()) else {
        return Seen::default();
    };
    let way = (phase - phases[before]) / (phases[next] - phases[before]);
    let between = |a: &[f64], b: &[f64]| -> Vec<f64> {
        a.iter().zip(b).map(|(a, b)| a + way * (b - a)).collect()
    };
    Seen {
        which: seen[before].which.clone(),
        values: between(&seen[before].values, &seen[next].values),
        noise: between(&seen[before].noise, &seen[next].noise),
    }
}
