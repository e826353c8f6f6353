//! What each method can and cannot do, on movements whose answer is known.

use crate::{dofs, movement, movements, seen, valid};
use tonus::baseline::dmp::{fit, rollout};
use tonus::baseline::hidden_markov::HiddenMarkov;
use tonus::baseline::mixture_regression::MixtureRegression;
use tonus::baseline::nearest::Nearest;
use tonus::baseline::{Answer, Primitives, marginals, single_gaussian, without_semg};
use tonus::demonstration::Demonstration;

const HALF: [f64; 5] = [0.1, 0.2, 0.3, 0.4, 0.5];

/// Two skills of opposite direction, the second much firmer.
fn opposite() -> Vec<Demonstration> {
    let mut all = movements("left", -0.3, 1.0);
    all.extend(movements("right", 0.3, 3.0));
    all
}

fn x(answer: &Answer) -> f64 {
    answer.paths[0].as_ref().unwrap().mean[0]
}

#[test]
fn every_recogniser_tells_what_is_plain_to_see() {
    let train = opposite();
    let primitives = Primitives::learn(&train, &valid(12)).unwrap();
    let mixture = MixtureRegression::learn(&train, &dofs()).unwrap();
    let markov = HiddenMarkov::learn(&train, &dofs()).unwrap();
    let nearest = Nearest::learn(&train, &dofs()).unwrap();
    for (label, reach, firm) in [(0, -0.31, 1.01), (1, 0.29, 2.98)] {
        let new = movement("new", reach, 0.01, firm);
        let observed = seen(&new, &[0, 1], &HALF, 0.05);
        let end = [1.0];
        let answers = [
            primitives.answer(&observed, &end).unwrap(),
            without_semg::answer(&primitives, &observed, &end).unwrap(),
            marginals::answer(&primitives, &observed, &end).unwrap(),
            mixture.answer(&observed, &end).unwrap(),
            markov.answer(&observed, &end).unwrap(),
            nearest.answer(&observed, &end).unwrap(),
        ];
        for (method, answer) in answers.iter().enumerate() {
            assert_eq!(answer.recognised, Some(label), "method {method}");
            // Demonstrations of a skill end within 3 cm of their mean.
            let off = x(answer) - reach;
            assert!(off.abs() < 0.05, "method {method} ends {off} m off");
            let stiffness = answer.paths[1].as_ref().unwrap().mean[0];
            assert!((stiffness / (500.0 * firm) - 1.0).abs() < 0.08);
            if let Some(log_posterior) = &answer.log_posterior {
                let sum: f64 = log_posterior.iter().map(|l| l.exp()).sum();
                assert!((sum - 1.0).abs() < 1e-9);
            }
        }
    }
}

#[test]
fn one_gaussian_over_two_skills_expects_neither() {
    let train = opposite();
    let single = single_gaussian::learn(&train, &valid(12)).unwrap();
    let nothing = seen(&train[0], &[], &[], 0.05);
    let answer = single_gaussian::answer(&single, &nothing, &[1.0]).unwrap();
    assert_eq!(answer.recognised, None);
    assert_eq!(answer.log_posterior, None);
    // Demonstrations end around -0.3 and 0.3 m and nowhere between; the one Gaussian's mean is between.
    assert!(x(&answer).abs() < 0.01, "{}", x(&answer));
    let (low, high) = answer.paths[0]
        .as_ref()
        .unwrap()
        .interval_95
        .as_ref()
        .unwrap()[0];
    assert!(
        low < -0.5 && high > 0.5,
        "a band over everything: {low} {high}"
    );
}

#[test]
fn marginals_count_the_same_evidence_again_and_again() {
    let train = opposite();
    let primitives = Primitives::learn(&train, &valid(12)).unwrap();
    let one = seen(&movement("new", 0.1, 0.0, 1.7), &[0], &[0.5], 0.5);
    let mut twenty = one.clone();
    twenty.phases = vec![0.5; 20];
    twenty.values = vec![vec![one.values[0][0]; 20]];
    twenty.std = vec![vec![one.std[0][0]; 20]];
    let odds = |answer: Answer| {
        let log_posterior = answer.log_posterior.unwrap();
        log_posterior[1] - log_posterior[0]
    };
    // Priors are equal: the marginals' log odds are exactly twenty times as large.
    let once = odds(marginals::answer(&primitives, &one, &[]).unwrap());
    let often = odds(marginals::answer(&primitives, &twenty, &[]).unwrap());
    assert!(once > 0.0 && (often / once - 20.0).abs() < 1e-9);
    // One observation by itself is the same thing in both readings.
    let joint_once = odds(primitives.answer(&one, &[]).unwrap());
    assert!((joint_once - once).abs() < 1e-9);
    let joint_often = odds(primitives.answer(&twenty, &[]).unwrap());
    assert!(joint_often < 0.8 * often, "{joint_often} {often}");
}

#[test]
fn without_semg_no_stiffness_changes_the_answer() {
    let train = opposite();
    let primitives = Primitives::learn(&train, &valid(12)).unwrap();
    let observed = seen(&train[3], &[0, 1], &HALF, 0.05);
    let mut firmer = observed.clone();
    for value in &mut firmer.values[1] {
        *value *= 2.5;
    }
    let ask = |observed| without_semg::answer(&primitives, observed, &[0.7, 1.0]).unwrap();
    assert_eq!(ask(&observed), ask(&firmer));
    let with = |observed| primitives.answer(observed, &[0.7, 1.0]).unwrap();
    assert_ne!(with(&observed), with(&firmer));
    assert_eq!(ask(&observed), with(&observed.only(|dof| dof == 0)));
}

#[test]
fn a_demonstration_is_its_own_neighbour() {
    let train = opposite();
    let nearest = Nearest::learn(&train, &dofs()).unwrap();
    for (index, own) in train.iter().enumerate() {
        let observed = seen(own, &[0, 1], &HALF, 0.05);
        let answer = nearest.answer(&observed, &[0.25, 1.0]).unwrap();
        assert_eq!(answer.recognised, Some(usize::from(index >= 9)));
        for (dof, path) in answer.paths.iter().enumerate() {
            let path = path.as_ref().unwrap();
            assert_eq!(path.mean[0], own.value_at(dof, 0.25).unwrap());
            assert_eq!(path.mean[1], own.value_at(dof, 1.0).unwrap());
            assert_eq!(path.interval_95, None);
        }
    }
}

#[test]
fn a_dmp_tracks_what_it_was_fitted_to_and_moves_with_its_goal() {
    let demonstration = movement("one", 0.3, 0.05, 1.0);
    let path: Vec<f64> = (0..50)
        .map(|k| demonstration.value_at(0, f64::from(k) / 49.0).unwrap())
        .collect();
    let weights = fit(&path).unwrap();
    let steps = 490;
    let rolled = rollout(&weights, path[0], path[49], steps);
    for (sample, value) in path.iter().enumerate() {
        // One percent of the reach: the movement starts with a speed that the DMP has not.
        assert!((rolled[sample * 10] - value).abs() < 3e-3, "{sample}");
    }
    // The equation is linear: the goal's shift adds that shift times the answer to a goal of 1.
    let moved = rollout(&weights, path[0], path[49] + 0.1, steps);
    let unit = rollout(&vec![0.0; weights.len()], 0.0, 1.0, steps);
    for ((moved, rolled), unit) in moved.iter().zip(&rolled).zip(&unit) {
        assert!((moved - rolled - 0.1 * unit).abs() < 1e-12);
    }
    assert!(unit[steps] > 0.9 && unit[steps] < 1.0);
}

#[test]
fn instants_are_all_that_a_bag_of_instants_learns_from() {
    // A movement seen at its end, 5 cm beyond the mean: a ProMP displaces the whole movement, mixture regression the end.
    let train = movements("only", 0.3, 1.0);
    let primitives = Primitives::learn(&train, &valid(12)).unwrap();
    let mixture = MixtureRegression::learn(&train, &dofs()).unwrap();
    let new = movement("new", 0.33, 0.0, 1.03);
    let observed = seen(&new, &[0], &[1.0], 0.005);
    let usual = movement("usual", 0.3, 0.0, 1.0);
    let middle = |answer: &Answer| answer.paths[0].as_ref().unwrap().mean[0];
    let expected = new.value_at(0, 0.6).unwrap();
    let mean = usual.value_at(0, 0.6).unwrap();
    let by_promp = middle(&primitives.answer(&observed, &[0.6]).unwrap());
    let by_mixture = middle(&mixture.answer(&observed, &[0.6]).unwrap());
    assert!(
        (by_promp - expected).abs() < 0.25 * (expected - mean),
        "{by_promp} {expected} {mean}"
    );
    assert!(
        (by_mixture - mean).abs() < 0.5 * (expected - mean),
        "{by_mixture} {expected} {mean}"
    );
    let end = mixture.answer(&observed, &[1.0]).unwrap();
    assert!((middle(&end) - 0.33).abs() < 0.01, "{}", middle(&end));
}
