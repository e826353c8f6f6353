//! Closed forms of the learner against dense formulas that relearn from scratch.

use nalgebra::{Cholesky, DMatrix, DVector};
use tonus::demonstration::Demonstration;
use tonus::model::{Hyperparameters, learn};
use tonus_shared::promp::Basis;

use super::{plain, reference};

/// Weights scaled to unit variance, and what they leave, by QR of the stacked system.
fn dense_fit(demonstrations: &[Demonstration], given: &Hyperparameters) -> DenseFit {
    let dofs = given.dofs.len();
    let functions = given.basis.count();
    let scale: Vec<f64> = (0..dofs)
        .map(|d| {
            let all = demonstrations
                .iter()
                .flat_map(|one| one.values()[d].iter().copied());
            let all = DVector::from_vec(all.collect());
            (all.add_scalar(-all.mean()).norm_squared() / all.len() as f64).sqrt()
        })
        .collect();
    let mut weights = DMatrix::zeros(demonstrations.len(), dofs * functions);
    let mut left = vec![0.0; dofs];
    for (n, one) in demonstrations.iter().enumerate() {
        let samples = one.t_s().len();
        let psi = design(&given.basis, one.phases());
        // Rows for the samples, for straight lines between them at two phases a function, and for the weights themselves.
        let straight = 2 * functions;
        let root = given.ridge.sqrt();
        let mut stacked = DMatrix::zeros(samples + straight + functions, functions);
        stacked.rows_mut(0, samples).copy_from(&psi);
        stacked
            .rows_mut(samples, straight)
            .copy_from(&(design(&given.basis, even(straight)) * root));
        stacked
            .rows_mut(samples + straight, functions)
            .fill_diagonal(root * 1e-3);
        let qr = stacked.qr();
        for d in 0..dofs {
            let y = DVector::from_vec(one.values()[d].clone()) / scale[d];
            let mut right = DVector::zeros(samples + straight + functions);
            right.rows_mut(0, samples).copy_from(&y);
            for (row, phase) in even(straight).enumerate() {
                let drawn = one.value_at(d, phase).unwrap() / scale[d];
                right[samples + row] = root * drawn;
            }
            let w = qr
                .r()
                .solve_upper_triangular(&(qr.q().transpose() * right))
                .unwrap();
            left[d] +=
                (&y - &psi * &w).norm_squared() / samples as f64 / demonstrations.len() as f64;
            weights
                .view_mut((n, d * functions), (1, functions))
                .copy_from(&w.transpose());
        }
    }
    DenseFit {
        scale,
        weights,
        left,
    }
}

struct DenseFit {
    scale: Vec<f64>,
    weights: DMatrix<f64>,
    left: Vec<f64>,
}

fn design(basis: &Basis, phases: impl Iterator<Item = f64>) -> DMatrix<f64> {
    let mut psi = vec![0.0; basis.count()];
    let rows: Vec<f64> = phases
        .flat_map(|phase| {
            basis.values(phase, &mut psi).unwrap();
            psi.clone()
        })
        .collect();
    DMatrix::from_row_slice(rows.len() / basis.count(), basis.count(), &rows)
}

fn even(count: usize) -> impl Iterator<Item = f64> {
    (0..count).map(move |i| i as f64 / (count - 1) as f64)
}

fn mean_of(weights: &DMatrix<f64>, rows: &[usize]) -> DVector<f64> {
    weights.select_rows(rows).row_mean().transpose()
}

/// Deviations of `rows` from the mean of those of the same label, and how many labels there are.
fn deviations(weights: &DMatrix<f64>, labels: &[&str], rows: &[usize]) -> (DMatrix<f64>, usize) {
    let mut seen: Vec<_> = rows.iter().map(|&i| labels[i]).collect();
    let mut x = weights.select_rows(rows);
    for (at, &i) in rows.iter().enumerate() {
        let fellows: Vec<_> = rows
            .iter()
            .copied()
            .filter(|&j| labels[j] == labels[i])
            .collect();
        let mean = mean_of(weights, &fellows);
        let deviation = x.row(at) - mean.transpose();
        x.row_mut(at).copy_from(&deviation);
    }
    seen.sort_unstable();
    seen.dedup();
    (x, seen.len())
}

fn without(count: usize, left_out: usize) -> Vec<usize> {
    (0..count).filter(|&i| i != left_out).collect()
}

#[test]
fn residual_variance_is_what_relearning_without_each_one_leaves() {
    let dofs = ["hx", "hy", "Khx"];
    let demonstrations = reference(&dofs, false);
    let given = plain(&dofs, 12);
    let model = learn(&demonstrations, &given.clone().check().unwrap()).unwrap();
    let fit = dense_fit(&demonstrations, &given);
    let labels: Vec<_> = demonstrations.iter().map(Demonstration::label).collect();
    let psi = design(&given.basis, even(50));
    let mut expected = fit.left.clone();
    for i in 0..labels.len() {
        let others = without(labels.len(), i);
        let (x, _) = deviations(&fit.weights, &labels, &others);
        let fellows: Vec<_> = others
            .into_iter()
            .filter(|&j| labels[j] == labels[i])
            .collect();
        let from_mean = fit.weights.row(i).transpose() - mean_of(&fit.weights, &fellows);
        let span = x.transpose().svd(true, false);
        let rank = span.singular_values.iter().filter(|&&s| s > 1e-9).count();
        let directions = span.u.unwrap().columns(0, rank).into_owned();
        let outside = &from_mean - &directions * directions.tr_mul(&from_mean);
        for (d, sum) in expected.iter_mut().enumerate() {
            let drawn = &psi * outside.rows(d * 12, 12);
            *sum += drawn.norm_squared() / 50.0 / labels.len() as f64;
        }
    }
    for ((got, want), scale) in model
        .parts()
        .residual_variance
        .iter()
        .zip(expected)
        .zip(fit.scale)
    {
        let got = got / (scale * scale);
        assert!((got / want - 1.0).abs() < 1e-6, "{got} for {want}");
    }
}

#[test]
fn shares_are_those_of_greatest_likelihood_when_relearning_without_each_one() {
    let dofs = ["hx", "Khx"];
    let demonstrations = reference(&dofs, false);
    let given = plain(&dofs, 9);
    let model = learn(&demonstrations, &given.clone().check().unwrap()).unwrap();
    let fit = dense_fit(&demonstrations, &given);
    let labels: Vec<_> = demonstrations.iter().map(Demonstration::label).collect();
    let psi = design(&given.basis, even(10));
    let observe = DMatrix::<f64>::identity(2, 2).kronecker(&psi);
    // 18 weights, 27 deviations: the subspace is the whole space, and projecting on it changes nothing.
    let noise = DVector::from_fn(20, |row, _| fit.left[row / 10].max(1e-8));
    let shares = [0.0, 0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 0.9, 1.0];
    let mut best = (f64::NEG_INFINITY, (0.0, 0.0));
    for (a, b) in shares.into_iter().flat_map(|a| shares.map(|b| (a, b))) {
        if a + b > 1.0 {
            continue;
        }
        let total: f64 = (0..labels.len())
            .map(|i| {
                let others = without(labels.len(), i);
                let (x, skills) = deviations(&fit.weights, &labels, &others);
                let pooled = x.tr_mul(&x) / (others.len() - skills) as f64;
                let fellows: Vec<_> = others
                    .iter()
                    .copied()
                    .filter(|&j| labels[j] == labels[i])
                    .collect();
                let (own, _) = deviations(&fit.weights, &labels, &fellows);
                let own = own.tr_mul(&own) / (fellows.len() - 1) as f64;
                let size = own.trace() / pooled.trace();
                let diagonal = DMatrix::from_diagonal(&pooled.diagonal());
                let mixed = own * (1.0 - a - b) + &pooled * (a * size) + diagonal * b;
                let covariance =
                    &observe * mixed * observe.transpose() + DMatrix::from_diagonal(&noise);
                let error =
                    &observe * (fit.weights.row(i).transpose() - mean_of(&fit.weights, &fellows));
                let factor = Cholesky::new(covariance).unwrap();
                -0.5 * error.dot(&factor.solve(&error)) - 0.5 * factor.ln_determinant()
            })
            .sum();
        if total > best.0 {
            best = (total, (a, b));
        }
    }
    assert_eq!(
        (model.parts().pooled_share, model.parts().diagonal_share),
        best.1
    );
    assert!(
        best.1 != (0.0, 0.0),
        "nothing was shrunk: the test says little"
    );
}
