//! Products of Gaussians against dense inverses and closed forms.

use nalgebra::{DMatrix, DVector};
use tonus_shared::Real;
use tonus_shared::promp::{
    Active, Blend, ComposeError, Quantity, Signal, Trajectory, blend_len, trajectory_scratch_len,
};

use crate::random::{BASIS, DURATION_S, RANK, Space, near};

/// Positions of two DoFs and the velocity of a third and of one of them.
fn signals<T: Real>() -> [Signal<T>; 4] {
    let signal = |dof, quantity, tolerance| Signal {
        dof,
        quantity,
        tolerance: T::of(tolerance),
    };
    [
        signal(0, Quantity::Position, 0.0625),
        signal(2, Quantity::Position, 0.03125),
        signal(1, Quantity::Velocity, 0.125),
        signal(0, Quantity::Velocity, 0.25),
    ]
}

/// Skill, activation, phase, duration.
type Voice = (usize, f64, f64, f64);

fn actives<'a, T: Real>(space: &'a Space<T>, voices: &[Voice]) -> Vec<Active<'a, T>> {
    let one = |&(skill, activation, phase, duration_s): &Voice| Active {
        trajectory: Trajectory::prior(space.latent(), space.skill(skill)).unwrap(),
        activation: T::of(activation),
        phase: T::of(phase),
        duration_s: T::of(duration_s),
    };
    voices.iter().map(one).collect()
}

fn blended<T: Real>(space: &Space<T>, signals: &[Signal<T>], voices: &[Voice]) -> (Vec<T>, Vec<T>) {
    let storage = vec![T::of(f64::NAN); blend_len(signals.len(), BASIS, RANK)];
    let mut blend = Blend::new(signals, storage).unwrap();
    blend.at(&actives(space, voices)).unwrap();
    (blend.mean().to_vec(), blend.covariance().to_vec())
}

/// One skill's mean and covariance of the signals by dense algebra.
fn dense<T: Real>(
    space: &Space<T>,
    signals: &[Signal<T>],
    &(skill, _, phase, duration_s): &Voice,
) -> (DVector<f64>, DMatrix<f64>) {
    use tonus_shared::promp::Row;
    let (mean, covariance) = space.dense(skill);
    let mut h = DMatrix::zeros(signals.len(), mean.len());
    for (i, signal) in signals.iter().enumerate() {
        let (phase, duration_s) = (T::of(phase), T::of(duration_s));
        let row = match signal.quantity {
            Quantity::Position => Row::position(signal.dof, phase),
            Quantity::Velocity => Row::velocity(signal.dof, phase, duration_s),
        };
        h.set_row(i, &space.weights_row(&row).transpose());
    }
    let tolerance = signals.iter().map(|s| s.tolerance.widen());
    let tolerance = DVector::from_iterator(signals.len(), tolerance);
    let spread = &h * covariance * h.transpose() + DMatrix::from_diagonal(&tolerance);
    (h * mean, spread)
}

fn inverse_formula<T: Real>(tolerance: f64) {
    let cases: [&[Voice]; 4] = [
        &[(0, 0.25, 0.5, DURATION_S), (1, 0.75, 0.5, DURATION_S)],
        &[
            (0, 1.0, 0.25, DURATION_S),
            (1, 1.0, 0.75, 2.5),
            (2, 1.0, 0.0, 1.0),
        ],
        &[
            (2, 0.125, 1.0, DURATION_S),
            (0, 4.0, 0.375, 0.5),
            (1, 0.001, 0.5, 1.0),
        ],
        &[(1, 0.5, 0.625, DURATION_S), (1, 0.25, 0.125, DURATION_S)],
    ];
    let signals = signals::<T>();
    for seed in 1..=6 {
        let space = Space::<T>::random(seed, 3);
        for voices in cases {
            let mut precision = DMatrix::zeros(4, 4);
            let mut information = DVector::zeros(4);
            for voice in voices {
                let (mean, covariance) = dense(&space, &signals, voice);
                let part = covariance.try_inverse().unwrap() * T::of(voice.1).widen();
                information += &part * mean;
                precision += part;
            }
            let expected = precision.try_inverse().unwrap();
            let mean = &expected * information;
            let (got_mean, got) = blended(&space, &signals, voices);
            let scale = tolerance * expected.amax().max(1.0);
            for i in 0..4 {
                near(got_mean[i], mean[i], scale * mean.amax().max(1.0));
                for j in 0..4 {
                    near(got[i * 4 + j], expected[(i, j)], scale);
                    assert_eq!(got[i * 4 + j], got[j * 4 + i]);
                }
            }
        }
    }
}

#[test]
fn a_blend_is_the_product_of_gaussians() {
    inverse_formula::<f64>(1e-11);
    inverse_formula::<f32>(2e-4);
}

fn equal<T: Real>(tolerance: f64) {
    let signals = signals::<T>();
    let space = Space::<T>::random(3, 1);
    let voice = |activation| (0, activation, 0.5, DURATION_S);
    let (mean, covariance) = dense(&space, &signals, &voice(1.0));
    // Activations, and what the covariance is divided by.
    let cases: [(&[f64], f64); 4] = [
        (&[1.0], 1.0),
        (&[0.5, 0.5], 1.0),
        (&[0.25, 0.625, 0.125], 1.0),
        (&[1.0, 1.0], 2.0),
    ];
    for (activations, certainty) in cases {
        let voices: Vec<_> = activations.iter().map(|&a| voice(a)).collect();
        let (got_mean, got) = blended(&space, &signals, &voices);
        let scale = tolerance * covariance.amax();
        for i in 0..4 {
            near(got_mean[i], mean[i], scale);
            for j in 0..4 {
                near(got[i * 4 + j], covariance[(i, j)] / certainty, scale);
            }
        }
    }
}

#[test]
fn equal_skills_blend_to_themselves() {
    equal::<f64>(1e-13);
    equal::<f32>(1e-5);
}

#[test]
fn what_is_not_active_has_no_part() {
    let signals = signals::<f64>();
    let space = Space::<f64>::random(4, 2);
    let alone = blended(&space, &signals, &[(0, 1.0, 0.5, DURATION_S)]);
    let voices = [(1, 0.0, 0.5, DURATION_S), (0, 1.0, 0.5, DURATION_S)];
    assert_eq!(blended(&space, &signals, &voices), alone);
    // And hardly active, hardly any.
    let voices = [(0, 1.0, 0.5, DURATION_S), (1, 1e-12, 0.5, DURATION_S)];
    let (mean, covariance) = blended(&space, &signals, &voices);
    for (got, expected) in mean.iter().zip(&alone.0) {
        near(*got, *expected, 1e-8);
    }
    for (got, expected) in covariance.iter().zip(&alone.1) {
        near(*got, *expected, 1e-8);
    }
}

/// One signal, two skills: `1 / v = a / v1 + b / v2`, `m / v = a m1 / v1 + b m2 / v2`.
fn scalar<T: Real>(tolerance: f64) {
    let signals = &signals::<T>()[..1];
    for (seed, (a, b)) in (1..).zip([(0.5, 0.5), (0.25, 0.75), (1.0, 1.0), (0.875, 0.125)]) {
        let space = Space::<T>::random(seed, 2);
        let voices = [(0, a, 0.5, DURATION_S), (1, b, 0.5, DURATION_S)];
        let mut scratch = vec![T::zero(); trajectory_scratch_len(BASIS, RANK)];
        let row = tonus_shared::promp::Row::position(0, T::of(0.5));
        let mut of = |skill| {
            let trajectory = Trajectory::prior(space.latent(), space.skill(skill)).unwrap();
            let moments = trajectory.moments(&row, &mut scratch).unwrap();
            (moments.mean.widen(), moments.variance.widen() + 0.0625)
        };
        let ((m1, v1), (m2, v2)) = (of(0), of(1));
        let v = 1.0 / (a / v1 + b / v2);
        let (mean, covariance) = blended(&space, signals, &voices);
        near(covariance[0], v, tolerance * v);
        near(
            mean[0],
            v * (a * m1 / v1 + b * m2 / v2),
            tolerance * (1.0 + v),
        );
    }
}

#[test]
fn one_signal_is_the_precision_weighted_mean() {
    scalar::<f64>(1e-13);
    scalar::<f32>(3e-6);
}

#[test]
fn what_cannot_be_blended_is_refused() {
    let space = Space::<f64>::random(1, 2);
    let signals = signals::<f64>();
    let room = blend_len(4, BASIS, RANK);
    let at = |voices: &[Voice], room: usize| {
        let mut blend = Blend::new(&signals, vec![0.0; room]).unwrap();
        blend.at(&actives(&space, voices)).unwrap_err()
    };
    assert_eq!(at(&[], room), ComposeError::Inactive);
    assert_eq!(at(&[(0, 0.0, 0.5, 1.0)], room), ComposeError::Inactive);
    let negative = at(&[(0, 1.0, 0.5, 1.0), (1, -0.5, 0.5, 1.0)], room);
    let activation = -0.5;
    let index = 1;
    assert_eq!(negative, ComposeError::Activation { index, activation });
    let short = at(&[(0, 1.0, 0.5, 1.0)], room - 1);
    assert!(matches!(short, ComposeError::Row(_)), "{short}");
    let still = at(&[(0, 1.0, 0.5, 0.0)], room);
    assert!(matches!(still, ComposeError::Row(_)), "{still}");
    let mut loose = signals;
    loose[2].tolerance = 0.0;
    let refused = Blend::new(&loose, vec![0.0; room]).unwrap_err();
    let variance = 0.0;
    assert_eq!(refused, ComposeError::Tolerance { index: 2, variance });
}
