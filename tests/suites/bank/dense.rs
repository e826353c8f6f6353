//! Each hypothesis written out in weight space (full covariance, batch formula, density by Cholesky), and the
//! mixture over them summed by hand.

use nalgebra::{DMatrix, DVector};
use tonus_shared::promp::{Hypothesis, Observed, Quantity, trajectory_scratch_len};

use super::{Model, hypotheses, models, near, observations};

/// Row of the observation matrix over all weights; written from the definition, not by the bank's own code.
fn weights_row(
    model: &Model,
    hypothesis: &Hypothesis<f64>,
    (dof, quantity): (usize, Quantity),
    time_s: f64,
) -> DVector<f64> {
    let functions = model.basis.count();
    let mut psi = vec![0.0; functions];
    let (start, end) = (
        hypothesis.onset_s,
        hypothesis.onset_s + hypothesis.duration_s,
    );
    let phase = (time_s.clamp(start, end) - start) / hypothesis.duration_s;
    match quantity {
        Quantity::Position => model.basis.values(phase, &mut psi).unwrap(),
        Quantity::Velocity if time_s < start || time_s > end => {}
        Quantity::Velocity => {
            model.basis.derivatives(phase, &mut psi).unwrap();
            psi.iter_mut().for_each(|p| *p /= hypothesis.duration_s);
        }
    }
    let mut row = DVector::zeros(model.dofs * functions);
    row.rows_mut(dof * functions, functions)
        .copy_from_slice(&psi);
    row
}

/// Posterior over weights and log joint of one hypothesis.
struct Posterior {
    mean: DVector<f64>,
    covariance: DMatrix<f64>,
    log_joint: f64,
}

fn posterior(model: &Model, hypothesis: &Hypothesis<f64>, seen: &[Observed<f64>]) -> Posterior {
    let weights = model.dofs * model.basis.count();
    let loading = DMatrix::from_row_slice(weights, model.rank, &model.loading);
    let skill = hypothesis.skill;
    let root = loading * DMatrix::from_row_slice(model.rank, model.rank, &model.roots[skill]);
    let covariance = &root * root.transpose();
    let mean = DVector::from_column_slice(&model.means[skill]);
    let mut h = DMatrix::zeros(seen.len(), weights);
    let mut noise = DMatrix::zeros(seen.len(), seen.len());
    for (i, one) in seen.iter().enumerate() {
        let row = weights_row(model, hypothesis, (one.dof, one.quantity), one.time_s);
        h.set_row(i, &row.transpose());
        noise[(i, i)] = one.variance
            + match one.quantity {
                Quantity::Position => model.residual[one.dof],
                Quantity::Velocity => 0.0,
            };
    }
    let y = DVector::from_iterator(seen.len(), seen.iter().map(|one| one.value));
    let s = &h * &covariance * h.transpose() + noise;
    let cholesky = s.cholesky().unwrap();
    let innovation = y - &h * &mean;
    let gain = cholesky.solve(&(&h * &covariance)).transpose();
    let log_density = -0.5 * innovation.dot(&cholesky.solve(&innovation))
        - cholesky.l().diagonal().map(f64::ln).sum()
        - 0.5 * seen.len() as f64 * std::f64::consts::TAU.ln();
    Posterior {
        mean: &mean + &gain * &innovation,
        covariance: &covariance - &gain * &h * &covariance,
        log_joint: model.log_priors[skill] + hypothesis.log_prior + log_density,
    }
}

/// Probabilities out of log joints.
fn normalised(log_joints: &[f64]) -> Vec<f64> {
    let largest = log_joints.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let weights: Vec<f64> = log_joints.iter().map(|j| (j - largest).exp()).collect();
    let total: f64 = weights.iter().sum();
    weights.iter().map(|w| w / total).collect()
}

#[test]
fn the_posterior_is_bayes_rule_over_dense_gaussians() {
    for (model, mut rng) in models() {
        let of_model = hypotheses(&model, 4, &mut rng);
        let seen = observations(14, &mut rng);
        let mut bank = model.bank(of_model.len(), None);
        for hypothesis in &of_model {
            assert!(bank.add(*hypothesis, &[]).unwrap());
        }
        for one in &seen {
            bank.observe(one).unwrap();
        }
        let dense: Vec<_> = of_model
            .iter()
            .map(|hypothesis| posterior(&model, hypothesis, &seen))
            .collect();
        let joints: Vec<f64> = dense.iter().map(|one| one.log_joint).collect();
        for (index, joint) in joints.iter().enumerate() {
            near(bank.log_joint(index).unwrap(), *joint, 1e-9);
        }
        let weights = normalised(&joints);
        for (index, weight) in weights.iter().enumerate() {
            near(bank.probability(index).unwrap(), *weight, 1e-9);
        }
        let mut skills = [0.0; 3];
        bank.log_posterior(&mut skills).unwrap();
        for (skill, got) in skills.iter().enumerate() {
            let of_skill = of_model.iter().zip(&weights);
            let of_skill = of_skill.filter(|(h, _)| h.skill == skill);
            near(got.exp(), of_skill.map(|(_, w)| w).sum(), 1e-9);
        }
        numbers(&model, &bank, &weights);
        predictions(&model, &bank, &dense, &weights);
    }
}

fn average(weights: &[f64], of: impl Fn(usize) -> f64) -> f64 {
    weights.iter().enumerate().map(|(i, w)| w * of(i)).sum()
}

/// Duration, onset, phase and whether it is over, over all skills.
fn numbers(_: &Model, bank: &super::Banks<'_, f64>, weights: &[f64]) {
    let h = bank.hypotheses();
    let time_s = 0.9;
    let phase = |i: usize| ((time_s - h[i].onset_s) / h[i].duration_s).clamp(0.0, 1.0);
    for (got, of) in [
        (
            bank.duration(None),
            &(|i: usize| h[i].duration_s) as &dyn Fn(usize) -> f64,
        ),
        (bank.onset(None), &|i| h[i].onset_s),
        (bank.phase(None, time_s), &phase),
    ] {
        let got = got.unwrap();
        let mean = average(weights, of);
        near(got.mean, mean, 1e-9);
        near(
            got.variance,
            average(weights, |i| of(i).powi(2)) - mean * mean,
            1e-9,
        );
    }
    let ended = |i: usize| f64::from(u8::from(h[i].onset_s + h[i].duration_s <= time_s));
    near(bank.over(time_s).unwrap(), average(weights, ended), 1e-9);
}

/// Mean and variance of the mixture over hypotheses, all skills and one skill.
fn predictions(model: &Model, bank: &super::Banks<'_, f64>, dense: &[Posterior], weights: &[f64]) {
    let mut scratch = vec![0.0; trajectory_scratch_len(model.basis.count(), model.rank)];
    for skill in [None, Some(0), Some(2)] {
        let chosen: Vec<f64> = bank
            .hypotheses()
            .iter()
            .zip(weights)
            .map(|(h, w)| {
                if skill.is_none_or(|s| s == h.skill) {
                    *w
                } else {
                    0.0
                }
            })
            .collect();
        let total: f64 = chosen.iter().sum();
        let chosen: Vec<f64> = chosen.iter().map(|w| w / total).collect();
        for quantity in [Quantity::Position, Quantity::Velocity] {
            for (dof, time_s) in [(0, -0.7), (1, 0.4), (0, 1.1), (1, 3.9)] {
                let row =
                    |i: usize| weights_row(model, &bank.hypotheses()[i], (dof, quantity), time_s);
                let mean = |i: usize| row(i).dot(&dense[i].mean);
                let variance = |i: usize| row(i).dot(&(&dense[i].covariance * row(i)));
                let expected = average(&chosen, mean);
                let spread = average(&chosen, |i| variance(i) + mean(i).powi(2));
                let got = bank.moments(skill, (dof, quantity), time_s, &mut scratch);
                let got = got.unwrap();
                near(got.mean, expected, 1e-7);
                near(got.variance, spread - expected * expected, 1e-7);
            }
        }
    }
}
