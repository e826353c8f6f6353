//! What is believed of other people than the one who demonstrated: how they may differ, how long they take.

use std::path::Path;

use tonus::demonstration::Demonstration;
use tonus::model::recognise::Recogniser;
use tonus::model::tempo::{TempoConfig, TempoRecogniser};
use tonus::model::{Dof, Hyperparameters, Model, PartsError, learn};
use tonus_shared::promp::Basis;

/// Durations of two skills, s.
const DURATIONS_S: [[f64; 4]; 2] = [[1.0, 1.1, 0.9, 1.05], [2.0, 3.0, 1.5, 2.6]];

/// One DoF; each demonstration of its own height and duration.
fn model() -> Model {
    let one = |skill: usize, number: usize| {
        let duration_s = DURATIONS_S[skill][number];
        let times = (0..=30).map(|i| duration_s * f64::from(i) / 30.0);
        let height = 1.0 + skill as f64 + 0.2 * number as f64 * number as f64;
        let value = |i: i32| height * f64::from(i) / 30.0 + 0.1 * number as f64;
        let values = vec![(0..=30).map(value).collect()];
        let label = ["fast", "slow"][skill];
        let trial = format!("{number}");
        Demonstration::new(label, &trial, Path::new("drawn"), times.collect(), values)
            .expect("a demonstration")
    };
    let all: Vec<_> = (0..2)
        .flat_map(|skill| (0..4).map(move |number| one(skill, number)))
        .collect();
    let dofs = vec![Dof::position("x")];
    let given = Hyperparameters {
        placement_m: 0.1,
        ..Hyperparameters::new(dofs, Basis::gaussian(6).expect("a basis"))
    };
    learn(&all, &given.check().expect("in range")).expect("a model")
}

#[test]
fn others_are_expected_alike_and_less_surely() {
    let own = model();
    let others = own.for_others(3.0).expect("in range");
    let (own_view, others_view) = (own.view().expect("a view"), others.view().expect("a view"));
    let mut own = Recogniser::new(&own, &own_view).expect("a recogniser");
    let mut others = Recogniser::new(&others, &others_view).expect("a recogniser");
    for skill in 0..2 {
        for phase in [0.0, 0.4, 1.0] {
            let before = own.predict(skill, 0, phase).expect("a prediction");
            let wider = others.predict(skill, 0, phase).expect("a prediction");
            assert!((wider.mean - before.mean).abs() < 1e-12);
            // Four times the variance.
            let ratio = wider.std / before.std;
            assert!((ratio - 2.0).abs() < 1e-9, "{ratio} at {phase}");
        }
    }
}

#[test]
fn nobody_else_is_oneself_and_no_share_is_negative() {
    let own = model();
    assert_eq!(own.for_others(0.0).expect("in range"), own);
    for share in [-0.1, f64::NAN, f64::INFINITY] {
        let refused = own.for_others(share);
        assert!(matches!(refused, Err(PartsError::Range { .. })), "{share}");
    }
}

#[test]
fn durations_of_all_skills_spread_alike() {
    let model = model();
    let view = model.view().expect("a view");
    let config = TempoConfig {
        onsets: 1,
        ..TempoConfig::default()
    };
    let mut recogniser = TempoRecogniser::new(&model, &view, config).expect("a recogniser");
    recogniser.begin(0.0).expect("a movement");
    // Moments of the samples; log-variances of log-normals that have them; three degrees of freedom each.
    let moments = DURATIONS_S.map(|of| {
        let mean = of.iter().sum::<f64>() / 4.0;
        let square = of.iter().map(|s| (s - mean) * (s - mean)).sum::<f64>() / 3.0;
        (mean, (square / (mean * mean)).ln_1p())
    });
    let pooled = 0.5 * (moments[0].1 + moments[1].1);
    let log_std = (pooled * 1.25 + 0.2 * 0.2_f64).sqrt();
    for (skill, (mean, own)) in moments.into_iter().enumerate() {
        let of_skill = recogniser.bank().hypotheses().iter();
        let logs = of_skill
            .filter(|h| h.skill == skill)
            .map(|h| h.duration_s.ln());
        let (low, high) = logs.fold((f64::MAX, f64::MIN), |(low, high), log| {
            (low.min(log), high.max(log))
        });
        // 2.5 standard deviations to both sides of the skill's own median.
        assert!((high - low - 5.0 * log_std).abs() < 1e-9, "{skill}");
        assert!((0.5 * (low + high) - (mean.ln() - 0.5 * own)).abs() < 1e-9);
    }
}
