//! Movements of known parameters, irregular and with gaps.

use nalgebra::{Cholesky, DMatrix, DVector};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use tonus::demonstration::Demonstration;
use tonus_shared::promp::Basis;

use super::dense::Dense;

pub(crate) fn basis(functions: usize) -> Basis {
    Basis::gaussian(functions).unwrap()
}

fn normal(random: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(random)
}

/// Parameters of one skill.
pub(crate) struct Truth {
    functions: usize,
    mean: DVector<f64>,
    /// Square root of the covariance of the weights.
    root: DMatrix<f64>,
    /// Noise variance of each DoF.
    pub(crate) noise: Vec<f64>,
}

impl Truth {
    /// Weights that are correlated along the movement and between the DoFs.
    pub(crate) fn new(dofs: usize, functions: usize, random: &mut ChaCha8Rng) -> Self {
        let width = dofs * functions;
        let covariance = DMatrix::from_fn(width, width, |i, j| {
            let apart = ((i % functions) as f64 - (j % functions) as f64) / 2.0;
            let same = if i / functions == j / functions {
                1.0
            } else {
                0.8
            };
            0.3 * same * (-0.5 * apart * apart).exp() + if i == j { 0.01 } else { 0.0 }
        });
        Self {
            functions,
            mean: DVector::from_fn(width, |_, _| normal(random)),
            root: Cholesky::new(covariance).unwrap().unpack(),
            noise: (0..dofs).map(|dof| 0.01 * (1 + dof) as f64).collect(),
        }
    }

    /// One performance, about `missing` of it in gaps, half of them of several samples.
    pub(crate) fn perform(
        &self,
        label: &str,
        missing: f64,
        random: &mut ChaCha8Rng,
    ) -> Demonstration {
        let weights =
            &self.mean + &self.root * DVector::from_fn(self.mean.len(), |_, _| normal(random));
        let samples = random.random_range(25..40);
        let mut time_s = random.random_range(0.0..10.0);
        let mut t_s = Vec::new();
        for _ in 0..samples {
            t_s.push(time_s);
            time_s += random.random_range(0.01..0.1);
        }
        let duration_s = t_s[samples - 1] - t_s[0];
        let mut psi = vec![0.0; self.functions];
        let mut values = Vec::new();
        for (dof, noise) in self.noise.iter().enumerate() {
            let start = random.random_range(0..samples);
            let gap = start..start + (missing * samples as f64 / 2.0) as usize;
            let mut series = Vec::new();
            for (sample, time_s) in t_s.iter().enumerate() {
                basis(self.functions)
                    .values((time_s - t_s[0]) / duration_s, &mut psi)
                    .unwrap();
                let own = weights.rows(dof * self.functions, self.functions);
                let value = own.iter().zip(&psi).map(|(w, p)| w * p).sum::<f64>()
                    + noise.sqrt() * normal(random);
                let lost = gap.contains(&sample) || random.random_bool(missing / 2.0);
                series.push((!lost).then_some(value));
            }
            values.push(series);
        }
        Demonstration::with_gaps(label, "1", "made.csv", t_s, &values).unwrap()
    }

    /// Kullback-Leibler divergence of a learnt skill's noisy positions at ten phases of each DoF from the true ones.
    pub(crate) fn distance(&self, learnt: &Dense) -> f64 {
        let dofs = self.noise.len();
        let mut psi = vec![0.0; self.functions];
        let mut rows = DMatrix::zeros(10 * dofs, self.mean.len());
        let mut noises = [DVector::zeros(10 * dofs), DVector::zeros(10 * dofs)];
        for row in 0..10 * dofs {
            let (dof, step) = (row / 10, row % 10);
            basis(self.functions)
                .values(step as f64 / 9.0, &mut psi)
                .unwrap();
            for (k, value) in psi.iter().enumerate() {
                rows[(row, dof * self.functions + k)] = *value;
            }
            noises[0][row] = self.noise[dof];
            noises[1][row] = learnt.noise[dof];
        }
        let seen = |covariance: &DMatrix<f64>, noise: &DVector<f64>| {
            &rows * covariance * rows.transpose() + DMatrix::from_diagonal(noise)
        };
        let truth = seen(&(&self.root * self.root.transpose()), &noises[0]);
        let factor = Cholesky::new(seen(&learnt.covariance, &noises[1])).unwrap();
        let off = &rows * (&self.mean - &learnt.mean);
        let logs = factor.ln_determinant() - Cholesky::new(truth.clone()).unwrap().ln_determinant();
        let size = truth.nrows() as f64;
        0.5 * (factor.solve(&truth).trace() + off.dot(&factor.solve(&off)) - size + logs)
    }
}

/// The demonstration of one DoF with the samples that were recorded.
pub(crate) fn without_gaps(one: &Demonstration) -> Demonstration {
    let kept = |sample: usize| one.present(0).is_none_or(|present| present[sample]);
    let mut t_s = one.t_s().to_vec();
    let mut series = one.values()[0].clone();
    let mut sample = 0;
    t_s.retain(|_| {
        sample += 1;
        kept(sample - 1)
    });
    sample = 0;
    series.retain(|_| {
        sample += 1;
        kept(sample - 1)
    });
    Demonstration::new(one.label(), one.trial(), one.file(), t_s, vec![series]).unwrap()
}

/// The demonstration without any value of a DoF.
pub(crate) fn without_dof(one: &Demonstration, missing: usize) -> Demonstration {
    let values = one.values().iter().enumerate();
    let values: Vec<Vec<Option<f64>>> = values
        .map(|(dof, series)| {
            series
                .iter()
                .map(|&v| (dof != missing).then_some(v))
                .collect()
        })
        .collect();
    Demonstration::with_gaps(
        one.label(),
        one.trial(),
        one.file(),
        one.t_s().to_vec(),
        &values,
    )
    .unwrap()
}
