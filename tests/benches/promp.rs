//! Learning and inference on the reference demonstrations: `cargo bench -p tonus-tests`.
//!
//! The same work beside other packages, and peak memory: `tests/compare/run`.
#![allow(
    missing_docs,
    clippy::unwrap_used,
    reason = "the macros write undocumented functions; a bench may stop"
)]

use criterion::{Criterion, criterion_group, criterion_main};
use tonus_tests::work::Work;

fn learning(criterion: &mut Criterion) {
    let work = Work::read().unwrap();
    criterion.bench_function("learn: weights, mean, covariance", |bench| {
        bench.iter(|| work.learn(&work.alike).unwrap());
    });
    let mut slow = criterion.benchmark_group("slow");
    slow.sample_size(10);
    slow.bench_function("learn by EM over trajectories", |bench| {
        bench.iter(|| work.learn_em(&work.alike).unwrap());
    });
}

fn inference(criterion: &mut Criterion) {
    let work = Work::read().unwrap();
    let model = work.without_residual(&work.alike).unwrap();
    let view = model.view().unwrap();
    let mut mixture = view.mixture().unwrap();
    criterion.bench_function("condition on one 3-DoF observation", |bench| {
        bench.iter(|| work.condition(&mut mixture).unwrap());
    });
    let mut curves = work.curves(&view);
    let trajectory = mixture.trajectory(0).unwrap();
    criterion.bench_function("mean and std, 200 x 12", |bench| {
        bench.iter(|| work.moments(&trajectory, &mut curves).map(drop).unwrap());
    });
}

fn recognition(criterion: &mut Criterion) {
    let work = Work::read().unwrap();
    let model = work.without_residual(&work.labelled).unwrap();
    let view = model.view().unwrap();
    let mut mixture = view.mixture().unwrap();
    let mut log_posterior = vec![0.0; view.skills.len()];
    criterion.bench_function("recognise three skills, 10 x 3 DoF", |bench| {
        bench.iter(|| work.recognise(&mut mixture, &mut log_posterior).unwrap());
    });
}

criterion_group!(benches, learning, inference, recognition);
criterion_main!(benches);
