//! A learnt gate on movements drawn from known distributions, and what it refuses.

use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use tonus::demonstration::Demonstration;
use tonus::model::novelty::{Gate, GateConfig, GateError, GateParts, GateSettings, StreamError};

use super::valid;

const INSTANTS: usize = 5;

/// A movement of one DoF with a correlated Gaussian deviation from the mean of its class, sampled 21 times.
pub(super) fn movement(class: usize, trial: usize, random: &mut ChaCha8Rng) -> Demonstration {
    let mut normal = || -> f64 { StandardNormal.sample(&mut *random) };
    let (level, slope, bend) = (0.05 * normal(), 0.05 * normal(), 0.05 * normal());
    let t_s: Vec<f64> = (0..21).map(|i| f64::from(i) * 0.05).collect();
    let x = t_s.iter().map(|&t| {
        let mean = (t * (class as f64 + 1.0) * 2.0).sin() + class as f64;
        mean + level + slope * t + bend * (3.0 * t).sin() + 0.01 * normal()
    });
    let x = x.collect();
    Demonstration::new(
        format!("c{class}"),
        trial.to_string(),
        "drawn",
        t_s,
        vec![x],
    )
    .unwrap()
}

pub(super) fn library(random: &mut ChaCha8Rng) -> Vec<Demonstration> {
    let pairs = (0..5).flat_map(|class| (0..10).map(move |trial| (class, 10 * class + trial)));
    pairs
        .map(|(class, trial)| movement(class, trial, random))
        .collect()
}

pub(super) fn config() -> GateConfig {
    GateConfig {
        observations: INSTANTS,
        ..GateConfig::of(1)
    }
}

/// Squared Mahalanobis distance from the mean of ten demonstrations in their own covariance.
fn plug_in(demonstrations: &[Demonstration], movement: &Demonstration) -> f64 {
    let seen = |d: &Demonstration| {
        DVector::from_fn(INSTANTS, |i, _| {
            d.value_at(0, i as f64 / (INSTANTS - 1) as f64).unwrap()
        })
    };
    let n = demonstrations.len() as f64;
    let mean = demonstrations.iter().map(seen).sum::<DVector<f64>>() / n;
    let mut covariance = DMatrix::zeros(INSTANTS, INSTANTS);
    for demonstration in demonstrations {
        let deviation = seen(demonstration) - &mean;
        covariance += &deviation * deviation.transpose() / (n - 1.0);
    }
    let apart = seen(movement) - mean;
    apart.dot(&covariance.lu().solve(&apart).unwrap())
}

/// 98 % quantiles by SciPy 1.16: `chi2.ppf(0.98, 5)`, and Hotelling's `5 (10^2 - 1) / (10 (10 - 5)) f.ppf(0.98, 5, 5)`.
const CHI_SQUARE: f64 = 13.388_222_599;
const HOTELLING: f64 = 78.734_022_726;

#[test]
fn chi_square_is_wrong_for_ten_demonstrations_and_the_gate_is_not() {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let (mut by_chi, mut by_hotelling, mut by_gate, mut total) = (0, 0, 0, 0);
    for _ in 0..30 {
        let known = library(&mut random);
        let gate = Gate::with_settings(&known, &valid(&["x"]), &GateSettings::default(), &config())
            .unwrap();
        for class in 0..5 {
            let own: Vec<_> = known
                .iter()
                .filter(|d| d.label() == format!("c{class}"))
                .cloned()
                .collect();
            for trial in 0..20 {
                let new = movement(class, trial, &mut random);
                let squared = plug_in(&own, &new);
                by_chi += usize::from(squared > CHI_SQUARE);
                by_hotelling += usize::from(squared > HOTELLING);
                by_gate += usize::from(gate.judge(&new, 1.0).unwrap().unwrap().unknown());
                total += 1;
            }
        }
    }
    let share = |count: usize| count as f64 / f64::from(total);
    println!(
        "false alarms asked for 0.02: chi-square {:.3}, Hotelling {:.3}, gate {:.3}",
        share(by_chi),
        share(by_hotelling),
        share(by_gate)
    );
    // Of 3000: the standard error of 0.02 is 0.0026 for independent ones; the 30 libraries add about as much.
    assert!(share(by_chi) > 0.2);
    assert!((0.01..0.035).contains(&share(by_hotelling)));
    assert!((0.008..0.035).contains(&share(by_gate)));
}

#[test]
fn what_is_far_from_all_is_unknown_and_the_nearest_is_named() {
    let mut random = ChaCha8Rng::seed_from_u64(4);
    let known = library(&mut random);
    let gate = Gate::learn(&known, &valid(&["x"]), &config()).unwrap();
    let far = movement(9, 0, &mut random);
    let novelty = gate.judge(&far, 1.0).unwrap().unwrap();
    assert!(novelty.unknown());
    // Class 9 starts at 9: class 4, at 4, is the nearest level.
    assert_eq!(gate.classes()[novelty.nearest], "c4");
    assert!(novelty.distance > 3.0);
    let near = gate.judge(&known[3], 1.0).unwrap().unwrap();
    assert!(!near.unknown());
    assert!((near.score, near.distance) < (1e-9, 1e-6), "{near:?}");
}

#[test]
fn streamed_samples_are_judged_like_the_recording() {
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let known = library(&mut random);
    let gate =
        Gate::with_settings(&known, &valid(&["x"]), &GateSettings::default(), &config()).unwrap();
    let new = movement(2, 0, &mut random);
    let mut stream = gate.stream().unwrap();
    for _ in 0..2 {
        assert!(stream.novelty().is_none());
        for (sample, phase) in new.phases().enumerate() {
            stream.observe(0, phase, new.values()[0][sample]).unwrap();
        }
        let streamed = stream.novelty().unwrap();
        let whole = gate.judge(&new, 1.0).unwrap().unwrap();
        assert_eq!(streamed.nearest, whole.nearest);
        assert!((streamed.score - whole.score).abs() < 1e-9);
        assert!((streamed.distance - whole.distance).abs() < 1e-9);
        assert!(matches!(
            stream.observe(0, 1.0, 0.0),
            Err(StreamError::Phase { .. })
        ));
        assert!(matches!(
            stream.observe(1, 1.1, 0.0),
            Err(StreamError::Dof { dof: 1 })
        ));
        stream.reset();
    }
}

#[test]
fn what_comes_later_is_not_looked_at() {
    let mut random = ChaCha8Rng::seed_from_u64(6);
    let known = library(&mut random);
    let gate =
        Gate::with_settings(&known, &valid(&["x"]), &GateSettings::default(), &config()).unwrap();
    let new = movement(1, 0, &mut random);
    let mut values = new.values()[0].clone();
    for value in &mut values[11..] {
        *value = 1e6;
    }
    let changed = Demonstration::new("c1", "0", "drawn", new.t_s().to_vec(), vec![values]).unwrap();
    // Sample 10 is at half the time, the third instant.
    let (one, other) = (
        gate.judge(&new, 0.5).unwrap(),
        gate.judge(&changed, 0.5).unwrap(),
    );
    assert_eq!(one, other);
    assert_eq!(one.unwrap().threshold, gate.parts().thresholds[2]);
}

#[test]
fn few_demonstrations_promise_no_more_than_they_show() {
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let known = library(&mut random);
    let given = GateConfig {
        false_alarm_rate: 1e-3,
        ..config()
    };
    let gate =
        Gate::with_settings(&known, &valid(&["x"]), &GateSettings::default(), &given).unwrap();
    assert!((gate.parts().false_alarm_rate - 1.0 / 51.0).abs() < 1e-12);
}

#[test]
fn a_gate_is_its_parts_and_wrong_ones_are_refused() {
    let mut random = ChaCha8Rng::seed_from_u64(8);
    let known = library(&mut random);
    let settings = GateSettings::default();
    let gate = Gate::with_settings(&known, &valid(&["x"]), &settings, &config()).unwrap();
    let parts = gate.parts().clone();
    assert_eq!(Gate::assemble(parts.clone()).unwrap(), gate);
    let refused = |parts| Gate::assemble(parts).unwrap_err();
    let cut = GateParts {
        thresholds: vec![1.0; 4],
        ..parts.clone()
    };
    assert!(matches!(refused(cut), GateError::Parts(_)));
    let named = GateParts {
        classes: vec!["c0".to_owned()],
        ..parts.clone()
    };
    assert!(matches!(refused(named), GateError::Parts(_)));
    let turned = GateParts {
        phases: parts.phases.iter().rev().copied().collect(),
        ..parts
    };
    assert!(matches!(refused(turned), GateError::Config { .. }));

    let few = Gate::with_settings(&known[..12], &valid(&["x"]), &settings, &config()).unwrap_err();
    assert!(matches!(
        few,
        GateError::TooFew {
            found: 2,
            needed: 3,
            ..
        }
    ));
    let rate = GateConfig {
        false_alarm_rate: 0.0,
        ..config()
    };
    let wrong = Gate::with_settings(&known, &valid(&["x"]), &settings, &rate).unwrap_err();
    assert!(matches!(wrong, GateError::Config { .. }));
    let flat = GateSettings {
        bandwidth: 0.0,
        ..settings
    };
    let wrong = Gate::with_settings(&known, &valid(&["x"]), &flat, &config()).unwrap_err();
    assert!(matches!(wrong, GateError::Config { .. }));
}
