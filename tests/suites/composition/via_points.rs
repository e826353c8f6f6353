//! Via-points: positions and velocities of any DoFs, as closely as asked.

use nalgebra::{DMatrix, DVector};
use tonus_shared::Real;
use tonus_shared::promp::{
    Belief, ConditionError, Moments, Observation, Row, RowError, Trajectory, belief_len,
    trajectory_scratch_len, via_len, via_point,
};

use crate::random::{BASIS, DURATION_S, RANK, Space, near};

fn vias<T: Real>() -> Vec<Observation<T>> {
    let via = |row, value: f64, std: f64| Observation {
        row,
        value: T::of(value),
        variance: T::of(std * std),
    };
    let (half, late) = (T::of(0.5), T::of(0.875));
    vec![
        via(Row::position(0, half), 0.75, 0.125),
        via(Row::velocity(1, half, T::of(DURATION_S)), -0.5, 0.25),
        via(Row::position(2, late), 1.5, 0.0625),
        via(Row::velocity(0, late, T::of(DURATION_S)), 0.0, 0.125),
    ]
}

fn through<T: Real>(space: &Space<T>, vias: &[Observation<T>]) -> Belief<T, Vec<T>> {
    let skill = space.skill(0);
    let mut belief = Belief::new(&skill, vec![T::zero(); belief_len(RANK)]).unwrap();
    let mut scratch = vec![T::zero(); via_len(BASIS, RANK)];
    for via in vias {
        via_point(&space.latent(), &skill, &mut belief, via, &mut scratch).unwrap();
    }
    belief
}

fn moments<T: Real>(space: &Space<T>, belief: &Belief<T, Vec<T>>, row: &Row<T>) -> Moments<T> {
    let trajectory = Trajectory::posterior(space.latent(), space.skill(0), belief).unwrap();
    let mut scratch = vec![T::zero(); trajectory_scratch_len(BASIS, RANK)];
    trajectory.moments(row, &mut scratch).unwrap()
}

/// The batch formula in weight space; the skill's residual (0.5, far above the variances asked) has no part.
fn batch_formula<T: Real>(tolerance: f64) {
    for seed in 1..=8 {
        let space = Space::<T>::random(seed, 1);
        let (mean, covariance) = space.dense(0);
        let vias = vias::<T>();
        let mut h = DMatrix::zeros(vias.len(), mean.len());
        for (i, via) in vias.iter().enumerate() {
            h.set_row(i, &space.weights_row(&via.row).transpose());
        }
        let noise = DVector::from_iterator(vias.len(), vias.iter().map(|v| v.variance.widen()));
        let y = DVector::from_iterator(vias.len(), vias.iter().map(|v| v.value.widen()));
        let s = &h * &covariance * h.transpose() + DMatrix::from_diagonal(&noise);
        let gain = &covariance * h.transpose() * s.try_inverse().unwrap();
        let after = &mean + &gain * (y - &h * &mean);
        let after_covariance = &covariance - &gain * &h * &covariance;
        let belief = through(&space, &vias);
        for dof in 0..3 {
            for phase in [0.0, 0.25, 0.5, 1.0] {
                let phase = T::of(phase);
                for row in [
                    Row::position(dof, phase),
                    Row::velocity(dof, phase, T::of(DURATION_S)),
                ] {
                    let g = space.weights_row(&row);
                    let got = moments(&space, &belief, &row);
                    let scale = g.norm_squared().max(1.0) * 10.0 * tolerance;
                    near(got.mean, g.dot(&after), scale);
                    near(got.variance, g.dot(&(&after_covariance * &g)), scale);
                }
            }
        }
    }
}

#[test]
fn via_points_are_the_batch_formula() {
    batch_formula::<f64>(1e-10);
    batch_formula::<f32>(3e-5);
}

/// One via-point alone: the precision-weighted mean of prior and wish.
fn one<T: Real>(tolerance: f64) {
    for seed in 1..=8 {
        let space = Space::<T>::random(seed, 1);
        for via in vias::<T>() {
            let before = moments(&space, &through(&space, &[]), &via.row);
            let (m, v) = (before.mean.widen(), before.variance.widen());
            let (value, r) = (via.value.widen(), via.variance.widen());
            let after = moments(&space, &through(&space, &[via]), &via.row);
            let scale = tolerance * (1.0 + m.abs() + v);
            near(after.mean, (m / v + value / r) / (1.0 / v + 1.0 / r), scale);
            near(after.variance, 1.0 / (1.0 / v + 1.0 / r), scale);
        }
    }
}

#[test]
fn one_via_point_is_the_precision_weighted_mean() {
    one::<f64>(1e-12);
    one::<f32>(1e-5);
}

/// A wish within two standard deviations of what the skill does, a hundred times closer than the skill is, is
/// met within its own standard deviation and is then as certain as asked.
fn met<T: Real>() {
    for seed in 1..=20 {
        let space = Space::<T>::random(seed, 1);
        let prior = through(&space, &[]);
        let rows = vias::<T>().into_iter().map(|via| via.row);
        let wishes = rows.enumerate().map(|(i, row)| {
            let before = moments(&space, &prior, &row);
            let std = before.variance.sqrt();
            let away = T::of([-2.0, 2.0, 1.5, 1.0][i]);
            let precision = std * T::of(0.01);
            Observation {
                row,
                value: before.mean + away * std,
                variance: precision * precision,
            }
        });
        for wish in wishes {
            let after = moments(&space, &through(&space, &[wish]), &wish.row);
            assert!((after.mean - wish.value).abs() <= wish.variance.sqrt());
            assert!(after.variance <= wish.variance);
        }
    }
}

#[test]
fn a_via_point_is_met_within_its_standard_deviation() {
    met::<f64>();
    met::<f32>();
}

#[test]
fn what_cannot_be_asked_leaves_the_belief_as_it_was() {
    let space = Space::<f64>::random(1, 1);
    let skill = space.skill(0);
    let mut belief = through(&space, &vias()[..1]);
    let before = belief.clone();
    let good = vias::<f64>()[0];
    let mut scratch = vec![0.0; via_len(BASIS, RANK)];
    let mut refused = |via: &Observation<f64>, scratch: &mut [f64]| {
        let error = via_point(&space.latent(), &skill, &mut belief, via, scratch).unwrap_err();
        assert_eq!(belief.mean(), before.mean());
        assert_eq!(belief.root(), before.root());
        error
    };
    let unknown = Observation {
        row: Row::position(3, 0.5),
        ..good
    };
    let exact = Observation {
        variance: 0.0,
        ..good
    };
    let nowhere = Observation {
        value: f64::NAN,
        ..good
    };
    assert!(matches!(
        refused(&unknown, &mut scratch),
        ConditionError::Row(RowError::Dof { dof: 3, dofs: 3 })
    ));
    assert!(matches!(
        refused(&exact, &mut scratch),
        ConditionError::Variance { variance: 0.0 }
    ));
    assert!(matches!(
        refused(&nowhere, &mut scratch),
        ConditionError::Value { .. }
    ));
    let short = refused(&good, &mut scratch[1..]);
    assert!(matches!(
        short,
        ConditionError::Row(RowError::Buffer {
            expected: 16,
            got: 15,
            ..
        })
    ));
}

#[test]
fn a_copied_belief_goes_its_own_way() {
    let space = Space::<f64>::random(2, 1);
    let belief = through(&space, &vias()[..2]);
    let mut copy = belief.copied(vec![0.0; belief_len(RANK)]).unwrap();
    assert_eq!(copy.mean(), belief.mean());
    assert_eq!(copy.root(), belief.root());
    assert_eq!(copy.log_likelihood(), belief.log_likelihood());
    let mut scratch = vec![0.0; via_len(BASIS, RANK)];
    let via = &vias()[2];
    via_point(
        &space.latent(),
        &space.skill(0),
        &mut copy,
        via,
        &mut scratch,
    )
    .unwrap();
    let all = through(&space, &vias()[..3]);
    assert_eq!(copy.mean(), all.mean());
    assert_ne!(copy.mean(), belief.mean());
    assert!(belief.copied(vec![0.0; belief_len(RANK) - 1]).is_err());
}
