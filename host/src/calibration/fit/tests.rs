use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

use super::*;
use crate::calibration::plan::{Hold, Task, plan};

const PERSON: [f64; PARAMETERS] = [2.4, 1.1, 15.0, 11.0, 10.0, 14.0];

fn segments() -> Segments<f64> {
    Segments::new(75.0, 1.75).unwrap()
}

fn holds(segments: &Segments<f64>) -> Vec<Hold> {
    let tasks = plan(segments).unwrap();
    let holds = tasks.into_iter().filter_map(|task| match task {
        Task::Hold(hold) => Some(hold),
        _ => None,
    });
    holds.collect()
}

/// The loads of the plan on a person of known parameters, hands measured with `noise_m`.
fn loads(person: &[f64; PARAMETERS], noise_m: f64, rng: &mut ChaCha8Rng) -> Vec<Load> {
    let segments = segments();
    let noise = Normal::new(0.0, noise_m).unwrap();
    let mut error = || Vector3::from_fn(|_, _| noise.sample(rng));
    let mut unloaded = Vector3::zeros();
    let mut found = Vec::new();
    for hold in holds(&segments) {
        if !hold.loaded() {
            unloaded = error();
            continue;
        }
        let there = Vector3::from(hold.hand_m);
        let posture = ArmPosture::from_hand_and_swivel(&segments, &there, 0.0).unwrap();
        let activation = 4.0 * hold.effort;
        let rest = Vector4::new(person[2], person[3], person[4], person[5]);
        // Eq. 8 as printed, not by the code that the fit uses.
        let decay = (-person[1] * activation).exp();
        let joints = rest * (1.0 + person[0] * (1.0 - decay) / (1.0 + decay));
        let moved = deflection(&segments, &posture, &joints, &hold.force_n.into()).unwrap();
        let seen = there + unloaded;
        found.push(Load {
            posture: ArmPosture::from_hand_and_swivel(&segments, &seen, 0.0).unwrap(),
            group: hold.group,
            force_n: hold.force_n.into(),
            activation,
            moved_m: moved + error() - unloaded,
        });
    }
    found
}

#[test]
fn noiseless_loads_give_the_person_back() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    for person in [
        PERSON,
        [0.7, 1.5, 13.0, 13.0, 12.0, 12.0],
        [4.0, 1.0, 9.0, 20.0, 16.0, 8.0],
    ] {
        let fit = fit(&segments(), &loads(&person, 0.0, &mut rng)).unwrap();
        for (at, (found, truth)) in fit.estimates().iter().zip(person).enumerate() {
            assert!(
                (found.value / truth - 1.0).abs() < 1e-6,
                "{at}: {found:?}, {truth}"
            );
            assert!(fit.told(at));
        }
        assert!(fit.residual_m < 1e-6 && fit.left_out.is_empty());
    }
}

#[test]
fn a_hand_that_moved_for_another_reason_is_left_out_and_named() {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    for place in [0, 5, 11] {
        let mut loads = loads(&PERSON, 0.001, &mut rng);
        loads[place].moved_m += Vector3::new(0.03, -0.04, 0.02);
        let fit = fit(&segments(), &loads).unwrap();
        assert_eq!(fit.left_out, [place]);
        for (at, truth) in PERSON.iter().enumerate() {
            let [low, high] = fit.interval(at, 0.999);
            assert!((low..=high).contains(truth), "{at}: {low} {high}");
        }
    }
}

#[test]
fn what_the_loads_do_not_tell_is_said() {
    // No load sideways: nothing turns the shoulder sideways nor the upper arm about its length.
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let all = loads(&PERSON, 0.0005, &mut rng);
    let hanging: Vec<Load> = all
        .iter()
        .copied()
        .filter(|load| load.force_n.y == 0.0)
        .collect();
    let fit = fit(&segments(), &hanging).unwrap();
    let told: Vec<bool> = (0..PARAMETERS).map(|at| fit.told(at)).collect();
    assert_eq!(told[2..], [true, false, false, true]);
    // What is not told stays the prior's: its median, its standard deviation.
    let prior = ILLUSTRATIVE.rest_stiffness_nm_per_rad[1];
    let [low, high] = fit.interval(3, 0.5);
    assert!(low < prior && prior < high && (high / low).ln() > LN_2);
    let few = super::fit(&segments(), &all[..3]);
    assert_eq!(few, Err(FitError::TooFew { got: 3, least: 4 }));
}
