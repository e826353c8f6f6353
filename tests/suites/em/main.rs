//! Learning by EM: against dense maximum likelihood in numpy, dense algebra, known truth and held-out likelihood.
#![allow(
    missing_docs,
    clippy::unwrap_used,
    clippy::expect_used,
    reason = "test suite"
)]

mod dense;
mod truth;

use dense::{Dense, log_likelihood};
use proptest::prelude::*;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde_json::Value;
use tonus::demonstration::Demonstration;
use tonus::model::{
    Dof, EmConfig, Hyperparameters, LearnError, Learner, Predictive, Shrinkage, Valid, extend,
    learn, learn_em, run_em,
};
use tonus::store::{from_bytes, to_bytes};
use tonus_shared::promp::Basis;
use truth::Truth;

/// What maximises the likelihood and nothing else.
fn plain(dofs: usize, basis: Basis) -> Valid {
    let names = (0..dofs).map(|dof| Dof::position(format!("x{dof}")));
    let given = Hyperparameters {
        shrinkage: Shrinkage::Fixed {
            pooled: 0.0,
            diagonal: 0.0,
        },
        predictive: Predictive::PlugIn,
        ..Hyperparameters::new(names.collect(), basis)
    };
    given.check().unwrap()
}

fn numbers(value: &Value) -> Vec<f64> {
    let list = value.as_array().unwrap().iter();
    list.map(|v| v.as_f64().unwrap()).collect()
}

#[test]
fn the_optimum_is_that_of_dense_weights() {
    let golden: Value = serde_json::from_str(include_str!("../../golden/em.json")).unwrap();
    let demonstrations = golden["demonstrations"].as_array().unwrap().iter();
    let demonstrations: Vec<_> = demonstrations
        .map(|one| {
            let series = one["values"].as_array().unwrap().iter();
            let series: Vec<Vec<Option<f64>>> = series
                .map(|series| {
                    series
                        .as_array()
                        .unwrap()
                        .iter()
                        .map(Value::as_f64)
                        .collect()
                })
                .collect();
            Demonstration::with_gaps("a", "1", "em.json", numbers(&one["t_s"]), &series).unwrap()
        })
        .collect();
    let config = EmConfig {
        tolerance: 1e-13,
        steps: 40_000,
        ..EmConfig::default()
    };
    let given = plain(2, Basis::bernstein(4).unwrap());
    let em = run_em(&demonstrations, &given, &config).unwrap();
    let reached = em.log_likelihoods.last().unwrap();
    let best = golden["log_likelihood"].as_f64().unwrap();
    assert!(
        reached > &(best - 1e-6) && (reached - best).abs() < 1e-3,
        "{reached} for {best}"
    );
    let dense = Dense::of(&em.model, 0);
    // Along a flat ridge of the likelihood both stop a little short, at different places.
    for (got, want) in dense.mean.iter().zip(numbers(&golden["mean"])) {
        assert!((got - want).abs() < 1e-3, "{got} for {want}");
    }
    for (got, want) in dense.noise.iter().zip(numbers(&golden["noise"])) {
        assert!((got / want - 1.0).abs() < 1e-3, "{got} for {want}");
    }
    for (row, line) in golden["covariance"].as_array().unwrap().iter().enumerate() {
        for (column, want) in numbers(line).into_iter().enumerate() {
            let got = dense.covariance[(row, column)];
            assert!(
                (got - want).abs() < 3e-3,
                "{row} {column}: {got} for {want}"
            );
        }
    }
}

#[test]
fn the_log_likelihood_is_that_of_the_model_learnt() {
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let first = Truth::new(2, 7, &mut random);
    let second = Truth::new(2, 7, &mut random);
    let gappy = |truth: &Truth, label, random: &mut ChaCha8Rng| {
        (0..9)
            .map(|_| truth.perform(label, 0.3, random))
            .collect::<Vec<_>>()
    };
    let a = gappy(&first, "a", &mut random);
    let b = gappy(&second, "b", &mut random);
    let em = run_em(
        &[a.as_slice(), b.as_slice()].concat(),
        &plain(2, truth::basis(7)),
        &EmConfig::default(),
    );
    let em = em.unwrap();
    let dense = [0, 1].map(|skill| Dense::of(&em.model, skill));
    let expected = log_likelihood(&dense[0], &a) + log_likelihood(&dense[1], &b);
    let got = *em.log_likelihoods.last().unwrap();
    assert!((got / expected - 1.0).abs() < 1e-9, "{got} for {expected}");
}

proptest! {
    #![proptest_config(tonus_tests::seeded(24))]

    #[test]
    fn the_likelihood_never_falls(
        seed in any::<u64>(), dofs in 1_usize..4, functions in 4_usize..12, missing in 0.0..0.6_f64,
        skills in 1_usize..3,
    ) {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut demonstrations = Vec::new();
        for label in &["a", "b"][..skills] {
            let truth = Truth::new(dofs, functions, &mut random);
            for _ in 0..6 {
                demonstrations.push(truth.perform(label, missing, &mut random));
            }
        }
        let config = EmConfig { tolerance: 0.0, steps: 150, ..EmConfig::default() };
        match run_em(&demonstrations, &plain(dofs, truth::basis(functions)), &config) {
            Ok(em) => for pair in em.log_likelihoods.windows(2) {
                prop_assert!(pair[1] - pair[0] >= -1e-9 * pair[0].abs(), "{pair:?}");
            },
            // By chance a DoF may be missing everywhere.
            Err(error) => prop_assert!(matches!(error, LearnError::NeverSeen { .. }), "{error}"),
        }
    }
}

/// Two thirds of the time in long gaps: ridge weights are then as much penalty as data.
#[test]
fn the_truth_is_recovered_better_than_by_least_squares() {
    let mut worse = 0;
    let mut totals = [0.0; 2];
    for seed in 1..=10 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let truth = Truth::new(1, 8, &mut random);
        let gappy: Vec<_> = (0..40)
            .map(|_| truth.perform("a", 0.4, &mut random))
            .collect();
        // The same samples: of one DoF, a gap is a sample less.
        let dropped: Vec<_> = gappy.iter().map(truth::without_gaps).collect();
        let given = plain(1, truth::basis(8));
        let em = learn_em(&gappy, &given, &EmConfig::default()).unwrap();
        let ridge = learn(&dropped, &given).unwrap();
        let off = [&em, &ridge].map(|model| truth.distance(&Dense::of(model, 0)));
        worse += usize::from(off[0] >= off[1]);
        totals = [totals[0] + off[0], totals[1] + off[1]];
        let noise = em.parts().residual_variance[0] / truth.noise[0];
        assert!(
            (noise - 1.0).abs() < 0.15,
            "seed {seed}: noise {noise} of the true"
        );
    }
    println!(
        "distance from the truth, mean of 10 seeds: EM {:.4}, least squares {:.4}",
        totals[0] / 10.0,
        totals[1] / 10.0
    );
    assert!(totals[0] < 0.7 * totals[1], "{totals:?}");
    assert!(worse <= 1, "worse in {worse} of 10");
}

/// Held-out log-likelihood with one of two DoFs missing in a third of the demonstrations.
#[test]
fn a_dof_missing_in_a_third_costs_little() {
    let (mut complete, mut missing, mut fewer, mut samples) = (0.0, 0.0, 0.0, 0);
    for seed in 11..=18 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let truth = Truth::new(2, 5, &mut random);
        let all: Vec<_> = (0..60)
            .map(|_| truth.perform("a", 0.0, &mut random))
            .collect();
        let fresh: Vec<_> = (0..30)
            .map(|_| truth.perform("a", 0.0, &mut random))
            .collect();
        let without: Vec<_> = all
            .iter()
            .enumerate()
            .map(|(n, one)| {
                if n % 3 == 0 {
                    truth::without_dof(one, 1)
                } else {
                    one.clone()
                }
            })
            .collect();
        let whole: Vec<_> = without
            .iter()
            .filter(|one| one.is_complete())
            .cloned()
            .collect();
        let held_out = |demonstrations: &[Demonstration]| {
            let given = plain(2, truth::basis(5));
            let model = learn_em(demonstrations, &given, &EmConfig::default()).unwrap();
            log_likelihood(&Dense::of(&model, 0), &fresh)
        };
        complete += held_out(&all);
        missing += held_out(&without);
        fewer += held_out(&whole);
        samples += fresh.len();
    }
    let per = |sum: f64| sum / f64::from(u32::try_from(samples).unwrap());
    println!(
        "held-out log-likelihood of a movement: all {:.2}, a DoF missing in a third {:.2}, two thirds alone {:.2} nats",
        per(complete),
        per(missing),
        per(fewer)
    );
    // Of the 65 parameters, the 45 that tell the second DoF given the first rest on two thirds whatever one does.
    assert!(
        per(complete - missing) < 0.85 * per(complete - fewer),
        "as if they had been left out"
    );
    assert!(
        per(complete - missing) < 1.0,
        "{} nats lost",
        per(complete - missing)
    );
}

#[test]
fn a_model_learnt_by_em_says_so_and_is_not_extended() {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let truth = Truth::new(2, 6, &mut random);
    let demonstrations: Vec<_> = (0..8)
        .map(|_| truth.perform("a", 0.2, &mut random))
        .collect();
    let given = Hyperparameters::new(
        vec![Dof::position("x"), Dof::position("y")],
        truth::basis(6),
    );
    let model = learn_em(
        &demonstrations,
        &given.check().unwrap(),
        &EmConfig::default(),
    )
    .unwrap();
    let stored = from_bytes(&to_bytes(&model, None).unwrap()).unwrap().0;
    assert_eq!(stored, model);
    assert_eq!(stored.parts().learner, Learner::Em);
    let refused = extend(&stored, &demonstrations).unwrap_err().to_string();
    assert_eq!(
        refused,
        "the model was learnt by EM and must be refitted: train it again from all recordings"
    );
}

#[test]
fn what_cannot_be_learnt_from_is_named() {
    let demo = |label: &str, y: Option<f64>| {
        let x = vec![Some(0.0), Some(1.0), Some(0.5 * label.len() as f64)];
        Demonstration::with_gaps(
            label,
            "1",
            "a.csv",
            vec![0.0, 1.0, 2.0],
            &[x, vec![y, None, Some(2.0).and(y)]],
        )
        .unwrap()
    };
    let given = plain(2, Basis::bernstein(3).unwrap());
    let never = [
        demo("a", Some(1.0)),
        demo("a", Some(2.0)),
        demo("bb", None),
        demo("bb", None),
    ];
    let refused = learn_em(&never, &given, &EmConfig::default()).unwrap_err();
    assert_eq!(
        refused.to_string(),
        "no demonstration of `bb` has a value of `x1`: leave out one or the other"
    );
    let refused = learn(&never, &given).unwrap_err();
    assert_eq!(
        refused.to_string(),
        "a.csv: a demonstration of `a` has values missing: learn by EM"
    );
    assert!(matches!(
        learn_em(&[], &given, &EmConfig::default()),
        Err(LearnError::None)
    ));
}
