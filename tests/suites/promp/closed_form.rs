//! Exact Gaussians small enough to work out by hand.

use std::f64::consts::TAU;

use tonus_shared::promp::{
    Basis, Belief, ConditionError, Latent, Mixture, Observation, Row, Skill, Trajectory,
    belief_len, mixture_len, trajectory_scratch_len,
};

fn near(got: f64, expected: f64) {
    assert!(
        (got - expected).abs() <= 1e-13 * expected.abs().max(1.0),
        "{got} is not {expected}"
    );
}

fn log_normal(residual: f64, variance: f64) -> f64 {
    -0.5 * (residual * residual / variance + (TAU * variance).ln())
}

/// One weight, one direction: `y ~ N(m, l^2)`, seen as `v` with noise `r`.
#[test]
fn one_dimension() {
    let (m, l, v, r) = (0.7, 0.3, 1.1, 0.04);
    let basis = Basis::bernstein(1).unwrap();
    let loading = [l];
    let latent = Latent::new(basis, 1, 1, &loading).unwrap();
    let (mean, residual) = ([m], [0.0]);
    let skill = Skill::new(&latent, &mean, None, &residual, 0.0).unwrap();
    let mut belief = Belief::new(&skill, [0.0; belief_len(1)]).unwrap();
    let innovation = belief.condition(&[l], m, v, r).unwrap();
    near(innovation.residual, v - m);
    near(innovation.variance, l * l + r);
    near(belief.log_likelihood(), log_normal(v - m, l * l + r));
    let after = Trajectory::posterior(latent, skill, &belief).unwrap();
    let mut scratch = [0.0; trajectory_scratch_len(1, 1)];
    let moments = after.moments(&Row::position(0, 0.4), &mut scratch).unwrap();
    near(moments.mean, m + l * l / (l * l + r) * (v - m));
    near(moments.variance, l * l * r / (l * l + r));
    belief.reset(&skill).unwrap();
    assert_eq!((belief.mean(), belief.root()), (&[0.0][..], &[1.0][..]));
    near(belief.log_likelihood(), 0.0);
}

/// Two DoFs with correlation `rho`: seeing the first is a regression of the second.
#[test]
fn two_correlated_dofs() {
    let (s0, s1, rho) = (2.0, 0.5, 0.8);
    let loading = [s0, 0.0, s1 * rho, s1 * f64::sqrt(1.0 - rho * rho)];
    let latent = Latent::new(Basis::bernstein(1).unwrap(), 2, 2, &loading).unwrap();
    let (mean, residual) = ([1.0, -3.0], [0.0, 0.0]);
    let skills = [Skill::new(&latent, &mean, None, &residual, 0.0).unwrap()];
    let mut mixture = Mixture::new(latent, &skills, [0.0; mixture_len(1, 1, 2)]).unwrap();
    let (value, noise) = (2.5, 0.25);
    mixture
        .observe(&Observation {
            row: Row::position(0, 0.5),
            value,
            variance: noise,
        })
        .unwrap();
    let gain = rho * s0 * s1 / (s0 * s0 + noise);
    let trajectory = mixture.trajectory(0).unwrap();
    let mut scratch = [0.0; trajectory_scratch_len(1, 2)];
    let (first, second) = (Row::position(0, 0.0), Row::position(1, 1.0));
    let moments = trajectory.moments(&second, &mut scratch).unwrap();
    near(moments.mean, -3.0 + gain * 1.5);
    near(moments.variance, s1 * s1 - gain * rho * s0 * s1);
    let left = noise / (s0 * s0 + noise);
    let covariance = trajectory
        .covariance(&first, &second, &mut scratch)
        .unwrap();
    near(covariance, rho * s0 * s1 * left);
    near(
        mixture.log_joint(0).unwrap(),
        log_normal(1.5, s0 * s0 + noise),
    );
}

/// A residual is noise of positions, and not of velocities.
#[test]
fn residual_variance_adds_to_positions_only() {
    let basis = Basis::bernstein(2).unwrap();
    let loading = [1.0, 0.5];
    let latent = Latent::new(basis, 1, 1, &loading).unwrap();
    let (mean, none, some) = ([0.0, 0.0], [0.0], [0.3]);
    let exact = [Skill::new(&latent, &mean, None, &none, 0.0).unwrap()];
    let loose = [Skill::new(&latent, &mean, None, &some, 0.0).unwrap()];
    for (row, extra) in [
        (Row::position(0, 0.2), 0.3),
        (Row::velocity(0, 0.2, 2.0), 0.0),
    ] {
        let seen = |skills, variance| {
            let mut mixture = Mixture::new(latent, skills, [0.0; mixture_len(1, 2, 1)]).unwrap();
            let value = 0.9;
            mixture
                .observe(&Observation {
                    row,
                    value,
                    variance,
                })
                .unwrap();
            (mixture.log_joint(0), mixture.belief(0).unwrap().mean()[0])
        };
        assert_eq!(seen(&loose, 0.1), seen(&exact, 0.1 + extra));
    }
}

/// A straight line from -1 to 3 over 4 s: 1 per second, not 4.
#[test]
fn velocity_is_per_second() {
    let loading = [0.0, 2.0];
    let latent = Latent::new(Basis::bernstein(2).unwrap(), 1, 1, &loading).unwrap();
    let (mean, residual) = ([-1.0, 3.0], [0.0]);
    let skill = Skill::new(&latent, &mean, None, &residual, 0.0).unwrap();
    let prior = Trajectory::prior(latent, skill).unwrap();
    let mut scratch = [0.0; trajectory_scratch_len(2, 1)];
    let row = Row::velocity(0, 0.3, 4.0);
    let moments = prior.moments(&row, &mut scratch).unwrap();
    near(moments.mean, 1.0);
    near(moments.variance, 0.25);
    let at_end = Row::position(0, 1.0);
    near(prior.covariance(&row, &at_end, &mut scratch).unwrap(), 1.0);
}

/// Skills thousands of nats apart: `ln(p)` stays right where `p` itself is zero.
#[test]
fn log_posterior_does_not_underflow() {
    let loading = [1.0];
    let latent = Latent::new(Basis::bernstein(1).unwrap(), 1, 1, &loading).unwrap();
    let means = [[0.0], [100.0], [0.0]];
    let residual = [0.0];
    let log_prior = [0.5_f64.ln(), 0.25_f64.ln(), 0.25_f64.ln()];
    let skills: [Skill<'_, f64>; 3] = std::array::from_fn(|q| {
        Skill::new(&latent, &means[q], None, &residual, log_prior[q]).unwrap()
    });
    let mut mixture = Mixture::new(latent, &skills, vec![0.0; mixture_len(3, 1, 1)]).unwrap();
    let mut posterior = [0.0; 3];
    mixture.log_posterior(&mut posterior).unwrap();
    posterior
        .iter()
        .zip(log_prior)
        .for_each(|(g, e)| near(*g, e));
    mixture
        .observe(&Observation {
            row: Row::position(0, 0.0),
            value: 0.0,
            variance: 1.0,
        })
        .unwrap();
    mixture.log_posterior(&mut posterior).unwrap();
    near(posterior[0], (2.0_f64 / 3.0).ln());
    near(posterior[1], -2500.0 + (1.0_f64 / 3.0).ln());
    near(posterior[2], (1.0_f64 / 3.0).ln());
    assert_eq!(mixture.most_likely(), 0);
    mixture.reset();
    mixture.log_posterior(&mut posterior).unwrap();
    posterior
        .iter()
        .zip(log_prior)
        .for_each(|(g, e)| near(*g, e));
}

/// The second skill cannot hold what the first could: neither moves.
#[test]
fn one_refusal_stops_all() {
    let loading = [1.0_f32];
    let latent = Latent::new(Basis::bernstein(1).unwrap(), 1, 1, &loading).unwrap();
    let (near_by, far, residual) = ([0.0], [3.0e38], [0.0]);
    let skills = [near_by, far];
    let skills: [Skill<'_, f32>; 2] =
        std::array::from_fn(|q| Skill::new(&latent, &skills[q], None, &residual, 0.0).unwrap());
    let mut mixture = Mixture::new(latent, &skills, [0.0; mixture_len(2, 1, 1)]).unwrap();
    let refused = mixture
        .observe(&Observation {
            row: Row::position(0, 0.0),
            value: -3.0e38,
            variance: 1e-3,
        })
        .unwrap_err();
    assert!(matches!(refused, ConditionError::Overflow { .. }));
    for q in 0..2 {
        let belief = mixture.belief(q).unwrap();
        assert_eq!((belief.mean(), belief.root()), (&[0.0][..], &[1.0][..]));
        assert_eq!(mixture.log_joint(q), Some(0.0));
    }
}
