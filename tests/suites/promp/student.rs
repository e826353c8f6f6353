//! Skills with degrees of freedom: the multivariate Student-t against SciPy (`golden/student.py`), dense
//! algebra, its own integrals and its Gaussian limit.

use nalgebra::{Cholesky, DMatrix, DVector};
use proptest::prelude::*;
use serde_json::Value;
use tonus_shared::Real;
use tonus_shared::promp::{
    Basis, Belief, Latent, Mixture, ModelError, Observation, Row, Skill, Trajectory, belief_len,
    mixture_len, trajectory_scratch_len,
};

use super::dense::{BASIS, DURATION_S, RANK, problems, questions};

fn golden() -> Value {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/golden/student.json");
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

fn numbers<T: Real>(value: &Value) -> Vec<T> {
    let values = value.as_array().unwrap().iter();
    values.map(|v| T::of(v.as_f64().unwrap())).collect()
}

fn near<T: Real>(got: T, expected: f64, tolerance: f64) {
    let (got, scale) = (got.widen(), expected.abs().max(1.0));
    assert!(
        (got - expected).abs() <= tolerance * scale,
        "{got} is not {expected}"
    );
}

/// One constant basis function: DoF `i` is the `i`-th number of the case.
fn against_scipy<T: Real>(tolerance: f64) {
    for case in golden()["cases"].as_array().unwrap() {
        let lines = case["loading"].as_array().unwrap();
        let loading: Vec<T> = lines.iter().flat_map(numbers::<T>).collect();
        let (dofs, rank) = (lines.len(), loading.len() / lines.len());
        let basis = Basis::bernstein(1).unwrap();
        let latent = Latent::new(basis, dofs, rank, &loading).unwrap();
        let (mean, residual) = (numbers::<T>(&case["mean"]), vec![T::zero(); dofs]);
        let freedom = T::of(case["freedom"].as_f64().unwrap());
        let skill = Skill::new(&latent, &mean, None, &residual, T::zero());
        let skills = [skill.unwrap().with_freedom(freedom).unwrap()];
        let storage = vec![T::zero(); mixture_len(1, 1, rank)];
        let mut mixture = Mixture::new(latent, &skills, storage).unwrap();
        let seen = numbers::<T>(&case["seen"]);
        for (dof, (value, variance)) in seen.iter().zip(numbers::<T>(&case["noise"])).enumerate() {
            let row = Row::position(dof, T::zero());
            let value = *value;
            let observation = Observation {
                row,
                value,
                variance,
            };
            mixture.observe(&observation).unwrap();
        }
        let number = |name: &str| case[name].as_f64().unwrap();
        near(
            mixture.log_joint(0).unwrap(),
            number("log_density"),
            tolerance,
        );
        let mut scratch = vec![T::zero(); trajectory_scratch_len(1, rank)];
        let row = Row::position(dofs - 1, T::zero());
        let trajectory = mixture.trajectory(0).unwrap();
        let moments = trajectory.moments(&row, &mut scratch).unwrap();
        near(moments.mean, number("posterior_mean"), tolerance);
        near(moments.variance, number("posterior_variance"), tolerance);
        let covariance = trajectory.covariance(&row, &row, &mut scratch).unwrap();
        near(covariance, number("posterior_variance"), tolerance);
        let belief = mixture.belief(0).unwrap();
        assert_eq!(belief.observations(), T::of(seen.len() as f64));
        assert_eq!(belief.freedom(), Some(freedom + belief.observations()));
    }
    for case in golden()["long"].as_array().unwrap() {
        let freedom = case["freedom"].as_f64().unwrap();
        let got = joint::<T>(freedom, &numbers(&case["seen"]));
        let expected = case["log_density"].as_f64().unwrap();
        near(got, expected, tolerance);
    }
}

#[test]
fn density_and_conditional_moments_are_scipys_in_f64() {
    against_scipy::<f64>(1e-9);
}

#[test]
fn density_and_conditional_moments_are_scipys_in_f32() {
    against_scipy::<f32>(3e-6);
}

/// `ln G(a + n) - ln G(a)` for whole `n` is a sum of logarithms.
fn log_rising(a: f64, n: usize) -> f64 {
    (0..n).map(|i| (a + i as f64).ln()).sum()
}

#[test]
fn any_rows_agree_with_dense_algebra() {
    for (problem, freedom) in problems()
        .into_iter()
        .zip([2.5, 5.0, 17.0, 60.0].into_iter().cycle())
    {
        let count = problem.observations.len();
        assert!(count.is_multiple_of(2), "the closed form below needs pairs");
        let (mean, covariance) = problem.prior();
        let (h, noise, y) = problem.system();
        let s = &h * &covariance * h.transpose() + noise;
        let innovation = y - &h * &mean;
        let solved = Cholesky::new(s.clone()).unwrap();
        let distance = innovation.dot(&solved.solve(&innovation));
        let (nu, k) = (freedom, count as f64);
        let log_density = log_rising(nu / 2.0, count / 2)
            - 0.5 * k * ((nu - 2.0) * std::f64::consts::PI).ln()
            - 0.5 * solved.ln_determinant()
            - 0.5 * (nu + k) * (1.0 + distance / (nu - 2.0)).ln();
        let factor = (nu - 2.0 + distance) / (nu - 2.0 + k);
        let gain = &covariance * h.transpose();
        let after_mean: DVector<f64> = &mean + &gain * solved.solve(&innovation);
        let after: DMatrix<f64> = (&covariance - &gain * solved.solve(&gain.transpose())) * factor;

        let skill = problem.skill().with_freedom(freedom).unwrap();
        let mixture = problem.observe(skill, 0..count);
        near(mixture.log_joint(0).unwrap(), log_density, 1e-9);
        let belief = mixture.belief(0).unwrap();
        near(belief.mahalanobis(), distance, 1e-9);
        near(belief.inflation(), factor, 1e-9);
        let trajectory = mixture.trajectory(0).unwrap();
        let mut scratch = vec![0.0; trajectory_scratch_len(BASIS, RANK)];
        for one in questions() {
            let a = problem.weights_row(&one);
            let scale = 1e-8 * a.norm_squared().max(1.0) * factor.max(1.0);
            let moments = trajectory.moments(&one, &mut scratch).unwrap();
            near(moments.mean, a.dot(&after_mean), scale);
            near(moments.variance, a.dot(&(&after * &a)), scale);
            for other in questions() {
                let b = problem.weights_row(&other);
                let got = trajectory.covariance(&one, &other, &mut scratch).unwrap();
                near(got, a.dot(&(&after * &b)), scale * b.norm().max(1.0));
            }
        }
        let posterior = Trajectory::posterior(problem.latent(), skill, &belief).unwrap();
        let row = Row::velocity(1, 0.4, DURATION_S);
        assert_eq!(
            posterior.moments(&row, &mut scratch),
            trajectory.moments(&row, &mut scratch)
        );
    }
}

/// Conditioning is the Gaussian's, bit for bit; before the first observation so is everything.
#[test]
fn mean_and_root_are_the_gaussians() {
    for problem in problems() {
        let count = problem.observations.len();
        let mut scratch = vec![0.0; trajectory_scratch_len(BASIS, RANK)];
        for seen in [0, 1, count] {
            let gaussian = problem.observe(problem.skill(), 0..seen);
            let skill = problem.skill().with_freedom(6.0).unwrap();
            let student = problem.observe(skill, 0..seen);
            let (a, b) = (gaussian.belief(0).unwrap(), student.belief(0).unwrap());
            assert_eq!((a.mean(), a.root()), (b.mean(), b.root()));
            assert_eq!(a.mahalanobis(), b.mahalanobis());
            assert_eq!((a.inflation(), a.freedom()), (1.0, None));
            let of = |mixture: &Mixture<'_, f64, Vec<f64>>, scratch: &mut [f64]| {
                let row = Row::position(2, 0.7);
                let trajectory = mixture.trajectory(0).unwrap();
                trajectory.moments(&row, scratch).unwrap()
            };
            let (g, s) = (of(&gaussian, &mut scratch), of(&student, &mut scratch));
            assert_eq!(g.mean, s.mean);
            assert_eq!(g.variance * b.inflation(), s.variance);
            if seen == 0 {
                assert_eq!((b.inflation(), b.log_likelihood()), (1.0, 0.0));
            }
        }
    }
}

/// The Gaussian's log-likelihood is the sum of its innovations' log densities, and nothing else.
#[test]
fn without_freedom_the_density_is_the_gaussians() {
    for problem in problems() {
        let skill = problem.skill();
        let (mut psi, mut a) = (vec![0.0; BASIS], vec![0.0; RANK]);
        let mut belief = Belief::new(&skill, vec![0.0; belief_len(RANK)]).unwrap();
        let (mut expected, mut distance) = (0.0, 0.0);
        for seen in &problem.observations {
            problem.latent().row(&seen.row, &mut psi, &mut a).unwrap();
            let offset = skill.offset(&problem.basis, &seen.row, &psi).unwrap();
            let told = belief
                .condition(&a, offset, seen.value, seen.variance)
                .unwrap();
            let step = told.residual * told.residual / told.variance;
            expected -= 0.5 * (step + (std::f64::consts::TAU * told.variance).ln());
            distance += step;
        }
        near(belief.log_likelihood(), expected, 1e-13);
        near(belief.mahalanobis(), distance, 1e-13);
    }
}

/// The difference to the Gaussian falls as `1 / nu`, until rounding.
#[test]
fn many_degrees_of_freedom_tend_to_the_gaussian() {
    for problem in problems() {
        let count = problem.observations.len();
        let gaussian = problem.observe(problem.skill(), 0..count);
        let expected = gaussian.log_joint(0).unwrap();
        let distance = gaussian.belief(0).unwrap().mahalanobis();
        let scale = (distance + count as f64).powi(2).max(1.0);
        for freedom in [1e4, 1e6, 1e8, 1e12, 1e100] {
            let skill = problem.skill().with_freedom(freedom).unwrap();
            let student = problem.observe(skill, 0..count);
            let belief = student.belief(0).unwrap();
            let bound = scale / freedom + 1e-13 * scale.sqrt();
            assert!((belief.log_likelihood() - expected).abs() <= bound);
            assert!(
                (belief.inflation() - 1.0).abs() <= (distance + count as f64) / freedom + 1e-15
            );
        }
    }
}

#[test]
fn order_of_observations_does_not_matter() {
    for problem in problems() {
        let count = problem.observations.len();
        let skill = problem.skill().with_freedom(4.5).unwrap();
        let forward = problem.observe(skill, 0..count);
        let shuffled = problem.observe(skill, (0..count).map(|i| (i * 5 + 3) % count));
        let (a, b) = (forward.belief(0).unwrap(), shuffled.belief(0).unwrap());
        near(a.log_likelihood(), b.log_likelihood(), 1e-10);
        near(a.inflation(), b.inflation(), 1e-10);
    }
}

#[test]
fn freedom_without_a_covariance_is_refused() {
    let problem = &problems()[0];
    for freedom in [2.0, 1.0, 0.0, -3.0, f64::NAN, f64::INFINITY] {
        let refused = problem.skill().with_freedom(freedom).unwrap_err();
        assert!(matches!(refused, ModelError::Freedom { .. }));
        assert!(refused.to_string().contains("above 2"), "{refused}");
    }
    let skill = problem.skill().with_freedom(2.000_001).unwrap();
    assert_eq!(skill.freedom(), Some(2.000_001));
    assert_eq!(problem.skill().freedom(), None);
}

proptest! {
    #![proptest_config(tonus_tests::seeded(20_000))]

    /// What the next number will be, given two that were seen: the density over it integrates to one, and its
    /// second moment is the inflated variance. Neither knows a log-gamma.
    #[test]
    fn the_next_density_is_one(
        freedom in prop_oneof![2.5..12.0, 12.0..400.0],
        loading in prop::collection::vec(-2.0..2.0, 3),
        seen in prop::collection::vec(-6.0..6.0, 2),
        variance in 0.05..2.0,
    ) {
        const POINTS: usize = 64;
        let latent = Latent::new(Basis::bernstein(1).unwrap(), 3, 1, &loading).unwrap();
        let (mean, residual) = ([0.3, -0.1, 0.7], [0.0; 3]);
        let skill = Skill::new(&latent, &mean, None, &residual, 0.0).unwrap();
        let skill = skill.with_freedom(freedom).unwrap();
        let mut belief = Belief::new(&skill, [0.0; belief_len(1)]).unwrap();
        for (dof, value) in seen.iter().enumerate() {
            belief.condition(&loading[dof..=dof], mean[dof], *value, variance).unwrap();
        }
        let before = belief.log_likelihood();
        let next = |value: f64| {
            let mut belief = belief.clone();
            let told = belief.condition(&loading[2..], mean[2], value, variance).unwrap();
            (told, belief.log_likelihood() - before)
        };
        let (told, _) = next(mean[2]);
        let centre = mean[2] - told.residual;
        let spread = told.variance * belief.inflation();
        // y = centre + width tan(angle): the midpoint rule converges geometrically on a whole period.
        let width = spread.sqrt();
        let (mut total, mut second) = (0.0, 0.0);
        for i in 0..POINTS {
            let angle = std::f64::consts::PI * ((i as f64 + 0.5) / POINTS as f64 - 0.5);
            let step = width * angle.tan();
            let (told, log_density) = next(centre + step);
            let weight = log_density.exp() * width / angle.cos().powi(2) * std::f64::consts::PI / POINTS as f64;
            prop_assert!((told.residual - step).abs() < 1e-9 * (1.0 + step.abs()));
            total += weight;
            second += weight * step * step;
        }
        prop_assert!((total - 1.0).abs() < 1e-6, "{total}");
        prop_assert!((second / spread - 1.0).abs() < 1e-2, "{second} {spread}");
    }

    /// `f32` holds the joint density to a thousandth of a nat in three hundred numbers.
    #[test]
    fn f32_is_near_f64(
        freedom in prop_oneof![2.1..30.0, 30.0..1e6],
        values in prop::collection::vec(-3.0..3.0, 1..300),
    ) {
        let (wide, narrow) = (joint::<f64>(freedom, &values), joint::<f32>(freedom, &values));
        prop_assert!((wide - narrow).abs() < 1e-6 * (values.len() as f64 * 10.0), "{wide} {narrow}");
    }
}

fn joint<T: Real>(freedom: f64, values: &[f64]) -> f64 {
    let one = [T::one()];
    let latent = Latent::new(Basis::bernstein(1).unwrap(), 1, 1, &one).unwrap();
    let zero = [T::zero()];
    let skill = Skill::new(&latent, &zero, None, &zero, T::zero()).unwrap();
    let skill = skill.with_freedom(T::of(freedom)).unwrap();
    let mut belief = Belief::new(&skill, [T::zero(); belief_len(1)]).unwrap();
    for value in values {
        let told = belief.condition(&zero, T::zero(), T::of(*value), T::one());
        told.unwrap();
    }
    belief.log_likelihood().widen()
}
