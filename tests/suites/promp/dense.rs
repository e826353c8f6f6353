//! The latent form against the same Gaussian written out in weight space: full covariance, batch
//! formula (eq. 13-16 corrected) with a matrix inverse, multivariate normal density by Cholesky.

use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tonus_shared::promp::{
    Basis, Latent, Mixture, Moments, Observation, Order, Row, RowError, Skill, Trajectory,
    curves_scratch_len, mixture_len, trajectory_scratch_len,
};

pub(crate) const DOFS: usize = 3;
pub(crate) const BASIS: usize = 7;
pub(crate) const RANK: usize = 5;
pub(crate) const DURATION_S: f64 = 1.7;

#[derive(Clone)]
pub(crate) struct Problem {
    pub(crate) basis: Basis,
    loading: Vec<f64>,
    mean: Vec<f64>,
    root: Vec<f64>,
    triangle: Vec<f64>,
    residual: [f64; DOFS],
    pub(crate) observations: Vec<Observation<f64>>,
}

impl Problem {
    fn random(basis: Basis, seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut draw =
            |n: usize| -> Vec<f64> { (0..n).map(|_| rng.random_range(-1.0..1.0)).collect() };
        let (loading, mean) = (draw(DOFS * BASIS * RANK), draw(DOFS * BASIS));
        let (root, more) = (draw(RANK * RANK), draw(3 * 12));
        let observations = more
            .chunks(3)
            .enumerate()
            .map(|(i, numbers)| {
                let (dof, phase) = (i % DOFS, 0.5 + 0.5 * numbers[0]);
                Observation {
                    row: if i % 4 == 3 {
                        Row::velocity(dof, phase, DURATION_S)
                    } else {
                        Row::position(dof, phase)
                    },
                    value: 2.0 * numbers[1],
                    variance: 10.0_f64.powf(2.0 * numbers[2] - 3.0),
                }
            })
            .collect();
        Self {
            basis,
            loading,
            mean,
            triangle: tonus_tests::triangle(RANK, &root),
            root,
            residual: [0.0, 0.02, 0.0],
            observations,
        }
    }

    /// The same with a covariance of so many directions.
    pub(crate) fn narrowed(mut self, directions: usize) -> Self {
        for row in self.root.chunks_exact_mut(RANK) {
            row[directions..].fill(0.0);
        }
        self.triangle = tonus_tests::triangle(RANK, &self.root);
        self
    }

    pub(crate) fn latent(&self) -> Latent<'_, f64> {
        Latent::new(self.basis, DOFS, RANK, &self.loading).unwrap()
    }

    pub(crate) fn skill(&self) -> Skill<'_, f64> {
        Skill::new(
            &self.latent(),
            &self.mean,
            Some(&self.triangle),
            &self.residual,
            0.0,
        )
        .unwrap()
    }

    /// The observation matrix's row in weight space.
    pub(crate) fn weights_row(&self, row: &Row<f64>) -> DVector<f64> {
        let mut psi = vec![0.0; BASIS];
        match row.order {
            Order::Position => self.basis.values(row.phase, &mut psi).unwrap(),
            Order::Velocity { duration_s } => {
                self.basis.derivatives(row.phase, &mut psi).unwrap();
                psi.iter_mut().for_each(|p| *p /= duration_s);
            }
        }
        let mut dense = DVector::zeros(DOFS * BASIS);
        dense.rows_mut(row.dof * BASIS, BASIS).copy_from_slice(&psi);
        dense
    }

    pub(crate) fn prior(&self) -> (DVector<f64>, DMatrix<f64>) {
        let loading = DMatrix::from_row_slice(DOFS * BASIS, RANK, &self.loading);
        let root = loading * DMatrix::from_row_slice(RANK, RANK, &self.root);
        let covariance = &root * root.transpose();
        (DVector::from_column_slice(&self.mean), covariance)
    }

    /// The observation matrix, the noise and the values of all observations.
    pub(crate) fn system(&self) -> (DMatrix<f64>, DMatrix<f64>, DVector<f64>) {
        let count = self.observations.len();
        let mut h = DMatrix::zeros(count, DOFS * BASIS);
        let mut noise = DMatrix::zeros(count, count);
        let mut y = DVector::zeros(count);
        for (i, seen) in self.observations.iter().enumerate() {
            h.set_row(i, &self.weights_row(&seen.row).transpose());
            let position = seen.row.order == Order::Position;
            let residual = if position {
                self.residual[seen.row.dof]
            } else {
                0.0
            };
            noise[(i, i)] = seen.variance + residual;
            y[i] = seen.value;
        }
        (h, noise, y)
    }

    pub(crate) fn observe<'a>(
        &'a self,
        skill: Skill<'a, f64>,
        order: impl Iterator<Item = usize>,
    ) -> Mixtures<'a> {
        // Leaked: a test's skill outlives its mixture.
        let skills = Box::leak(Box::new([skill]));
        let storage = vec![f64::NAN; mixture_len(1, BASIS, RANK)];
        let mut mixture = Mixture::new(self.latent(), skills, storage).unwrap();
        for i in order {
            mixture.observe(&self.observations[i]).unwrap();
        }
        mixture
    }
}

pub(crate) type Mixtures<'a> = Mixture<'a, f64, Vec<f64>>;

pub(crate) fn problems() -> Vec<Problem> {
    let bases = [
        Basis::gaussian(BASIS).unwrap(),
        Basis::fourier(BASIS).unwrap(),
        Basis::bernstein(BASIS).unwrap(),
    ];
    (0..12)
        .map(|seed| Problem::random(bases[seed % 3], seed as u64))
        .collect()
}

pub(crate) fn questions() -> Vec<Row<f64>> {
    (0..DOFS)
        .flat_map(|dof| {
            [0.0, 0.31, 1.0].into_iter().flat_map(move |phase| {
                [
                    Row::position(dof, phase),
                    Row::velocity(dof, phase, DURATION_S),
                ]
            })
        })
        .collect()
}

pub(crate) fn near(got: f64, expected: f64, scale: f64) {
    let error = (got - expected).abs();
    assert!(
        error <= 1e-9 * scale,
        "{got} is not {expected}: {error:.1e}"
    );
}

#[test]
fn posterior_equals_the_batch_formula() {
    for problem in problems() {
        equals_the_batch_formula(&problem, problem.skill());
    }
}

/// All that a skill of the problem's prior says, before and after its observations.
pub(crate) fn equals_the_batch_formula(problem: &Problem, skill: Skill<'_, f64>) {
    let (mean, covariance) = problem.prior();
    let count = problem.observations.len();
    let (h, noise, y) = problem.system();
    let s = &h * &covariance * h.transpose() + noise;
    let gain = &covariance * h.transpose() * s.clone().try_inverse().unwrap();
    let innovation = y - &h * &mean;
    let after_mean = &mean + &gain * &innovation;
    let after_covariance = &covariance - &gain * &h * &covariance;

    let mixture = problem.observe(skill, 0..count);
    let cholesky = s.cholesky().unwrap();
    let log_density = -0.5 * innovation.dot(&cholesky.solve(&innovation))
        - cholesky.l().diagonal().map(f64::ln).sum()
        - 0.5 * count as f64 * std::f64::consts::TAU.ln();
    let got = mixture.log_joint(0).unwrap();
    near(got, log_density, log_density.abs());

    let trajectory = mixture.trajectory(0).unwrap();
    check(problem, &trajectory, &after_mean, &after_covariance);
    let before = Trajectory::prior(problem.latent(), skill).unwrap();
    check(problem, &before, &mean, &covariance);
    let mut weights = vec![0.0; DOFS * BASIS];
    trajectory.weight_mean(&mut weights).unwrap();
    for (got, expected) in weights.iter().zip(after_mean.iter()) {
        near(*got, *expected, 1.0);
    }
}

/// Every mean, and the covariance of every two rows: across DoFs, phases, positions and velocities.
fn check(
    problem: &Problem,
    trajectory: &Trajectory<'_, f64>,
    mean: &DVector<f64>,
    covariance: &DMatrix<f64>,
) {
    let mut scratch = vec![0.0; trajectory_scratch_len(BASIS, RANK)];
    for one in questions() {
        let h = problem.weights_row(&one);
        let Moments { mean: m, variance } = trajectory.moments(&one, &mut scratch).unwrap();
        // Subtraction in the batch formula loses digits relative to the prior, hence the scale.
        let scale = h.norm_squared().max(1.0) * 10.0;
        near(m, h.dot(mean), scale);
        near(variance, h.dot(&(covariance * &h)), scale);
        for other in questions() {
            let g = problem.weights_row(&other);
            let got = trajectory.covariance(&one, &other, &mut scratch).unwrap();
            let back = trajectory.covariance(&other, &one, &mut scratch).unwrap();
            near(got, h.dot(&(covariance * &g)), scale * g.norm().max(1.0));
            near(got, back, scale * g.norm().max(1.0));
        }
    }
}

#[test]
fn order_of_observations_does_not_matter() {
    for problem in problems() {
        let count = problem.observations.len();
        let forward = problem.observe(problem.skill(), 0..count);
        let shuffled = problem.observe(problem.skill(), (0..count).map(|i| (i * 5 + 3) % count));
        let (a, b) = (
            forward.log_joint(0).unwrap(),
            shuffled.log_joint(0).unwrap(),
        );
        near(a, b, a.abs());
        let mut scratch = vec![0.0; trajectory_scratch_len(BASIS, RANK)];
        for row in questions() {
            let mut of = |mixture: &Mixtures<'_>| {
                let trajectory = mixture.trajectory(0).unwrap();
                trajectory.moments(&row, &mut scratch).unwrap()
            };
            let (a, b) = (of(&forward), of(&shuffled));
            near(a.mean, b.mean, 10.0 + a.mean.abs());
            near(a.variance, b.variance, 10.0);
        }
    }
}

#[test]
fn velocity_is_the_slope_of_position_in_time() {
    const STEP: f64 = 1e-5;
    for problem in problems() {
        let mixture = problem.observe(problem.skill(), 0..problem.observations.len());
        let trajectory = mixture.trajectory(0).unwrap();
        let mut scratch = vec![0.0; trajectory_scratch_len(BASIS, RANK)];
        for dof in 0..DOFS {
            for phase in [0.05, 0.4, 0.77] {
                let mut mean = |row| trajectory.moments(&row, &mut scratch).unwrap().mean;
                let rise =
                    mean(Row::position(dof, phase + STEP)) - mean(Row::position(dof, phase - STEP));
                let velocity = mean(Row::velocity(dof, phase, DURATION_S));
                let slope = rise / (2.0 * STEP) / DURATION_S;
                assert!((velocity - slope).abs() < 1e-6 * velocity.abs().max(10.0));
            }
        }
    }
}

/// All at once is one by one.
#[test]
fn curves_are_the_moments_of_every_row() {
    let phases = [-0.3, 0.0, 0.21, 0.5, 0.83, 1.0, 1.4];
    for problem in problems() {
        let mixture = problem.observe(problem.skill().with_freedom(5.0).unwrap(), 0..7);
        let posterior = mixture.trajectory(0).unwrap();
        let prior = Trajectory::prior(problem.latent(), problem.skill()).unwrap();
        let mut scratch = vec![f64::NAN; curves_scratch_len(DOFS, BASIS, RANK)];
        let mut one = vec![0.0; trajectory_scratch_len(BASIS, RANK)];
        for trajectory in [&prior, &posterior] {
            for order in [
                Order::Position,
                Order::Velocity {
                    duration_s: DURATION_S,
                },
            ] {
                let nothing = Moments {
                    mean: f64::NAN,
                    variance: f64::NAN,
                };
                let mut all = vec![nothing; DOFS * phases.len()];
                trajectory
                    .curves(order, &phases, &mut scratch, &mut all)
                    .unwrap();
                for (i, got) in all.iter().enumerate() {
                    let (dof, phase) = (i / phases.len(), phases[i % phases.len()]);
                    let row = Row { dof, order, phase };
                    let expected = trajectory.moments(&row, &mut one).unwrap();
                    near(
                        got.mean,
                        expected.mean,
                        expected.mean.abs().max(10.0) * 1e-3,
                    );
                    near(
                        got.variance,
                        expected.variance,
                        expected.variance.max(1.0) * 1e-3,
                    );
                }
            }
        }
        let mut short = vec![
            Moments {
                mean: 0.0,
                variance: 0.0
            };
            DOFS * phases.len() - 1
        ];
        let refused = prior.curves(Order::Position, &phases, &mut scratch, &mut short);
        assert!(refused.unwrap_err().to_string().contains("21"));
        assert_eq!(
            prior.curves(Order::Position, &[], &mut scratch, &mut []),
            Ok(())
        );
        let refused = prior.curves(
            Order::Position,
            &[f64::NAN],
            &mut scratch,
            &mut short[..DOFS],
        );
        assert!(matches!(refused, Err(RowError::Phase { .. })));
        let refused = prior.curves(Order::Position, &phases, &mut scratch[1..], &mut []);
        assert!(refused.is_err());
    }
}
