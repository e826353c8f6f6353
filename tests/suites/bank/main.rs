//! The bank of hypotheses (skill, duration, onset): against the mixture, dense algebra, closed forms, properties.
#![allow(
    clippy::unwrap_used,
    reason = "a test's helpers may stop it; clippy exempts test functions only"
)]

mod dense;
mod properties;
mod pruning;
mod streaming;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tonus_shared::Real;
use tonus_shared::promp::{
    Bank, Basis, Hypothesis, Latent, Observed, Quantity, Skill, bank_len, belief_len,
};

// Three skills of six DoFs and rank 27 in `f32`, eight hypotheses each: 47.1 kB of the chip's 256 KiB (a slot is 16 B there,
// 24 here). What fits beside the image's 91 kB is 171 kB: 89 such hypotheses.
const _: () = {
    assert!(4 * belief_len(27) == 1_876);
    assert!(4 * bank_len(24, 20, 27) == 47_088);
    assert!(4 * bank_len(24, 20, 27) + 24 * size_of::<Hypothesis<f32>>() <= 47_700);
    assert!(4 * bank_len(89, 20, 27) + 89 * size_of::<Hypothesis<f32>>() <= 262_144 - 90_944);
};

type Banks<'a, T> = Bank<'a, T, Vec<Hypothesis<T>>, Vec<T>>;

/// A random model of a few skills, in `f64`.
struct Model {
    basis: Basis,
    dofs: usize,
    rank: usize,
    loading: Vec<f64>,
    means: Vec<Vec<f64>>,
    roots: Vec<Vec<f64>>,
    residual: Vec<f64>,
    log_priors: Vec<f64>,
    /// Degrees of freedom of the skills, if they are not Gaussian.
    freedom: Option<f64>,
}

impl Model {
    fn random(basis: Basis, skills: usize, rng: &mut ChaCha8Rng) -> Self {
        let (dofs, rank) = (2, 4);
        let weights = dofs * basis.count();
        let mut draw =
            |n: usize| -> Vec<f64> { (0..n).map(|_| rng.random_range(-1.0..1.0)).collect() };
        Self {
            basis,
            dofs,
            rank,
            loading: draw(weights * rank),
            means: (0..skills).map(|_| draw(weights)).collect(),
            roots: (0..skills).map(|_| draw(rank * rank)).collect(),
            residual: vec![0.0, 0.03],
            log_priors: draw(skills),
            freedom: None,
        }
    }

    /// The same in the scalar `T`, for as long as the test runs.
    fn view<T: Real>(&self) -> (Latent<'static, T>, &'static [Skill<'static, T>]) {
        let leak = |numbers: &[f64]| -> &'static [T] {
            numbers.iter().map(|v| T::of(*v)).collect::<Vec<_>>().leak()
        };
        let latent = Latent::new(self.basis, self.dofs, self.rank, leak(&self.loading)).unwrap();
        let residual = leak(&self.residual);
        let skills = self.means.iter().zip(&self.roots).zip(&self.log_priors);
        let skills = skills.map(|((mean, root), log_prior)| {
            let root = Some(leak(&tonus_tests::triangle(self.rank, root)));
            let skill = Skill::new(&latent, leak(mean), root, residual, T::of(*log_prior)).unwrap();
            let freedom = self.freedom.map(T::of);
            freedom.map_or(skill, |freedom| skill.with_freedom(freedom).unwrap())
        });
        (latent, skills.collect::<Vec<_>>().leak())
    }

    fn bank<T: Real>(&self, capacity: usize, floor_nats: Option<T>) -> Banks<'static, T> {
        let (latent, skills) = self.view();
        let storage = vec![T::of(f64::NAN); bank_len(capacity, self.basis.count(), self.rank)];
        let slots = vec![Hypothesis::default(); capacity];
        Bank::new(latent, skills, slots, storage, floor_nats).unwrap()
    }
}

fn rng(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

fn models() -> impl Iterator<Item = (Model, ChaCha8Rng)> {
    let bases = [
        Basis::gaussian(6).unwrap(),
        Basis::fourier(5).unwrap(),
        Basis::bernstein(5).unwrap(),
    ];
    (0..9).map(move |seed| {
        let mut rng = rng(seed);
        let model = Model::random(bases[seed as usize % 3], 3, &mut rng);
        (model, rng)
    })
}

/// `each` hypotheses of every skill, onsets around zero.
fn hypotheses(model: &Model, each: usize, rng: &mut ChaCha8Rng) -> Vec<Hypothesis<f64>> {
    let skills = 0..model.means.len();
    let of_skill = |skill| std::iter::repeat_n(skill, each);
    let draw = |skill| Hypothesis {
        skill,
        duration_s: rng.random_range(0.5..3.0),
        onset_s: rng.random_range(-0.5..0.5),
        log_prior: rng.random_range(-2.0..0.0),
    };
    skills.flat_map(of_skill).map(draw).collect()
}

/// Positions and velocities from before any onset to after some ends.
fn observations(count: usize, rng: &mut ChaCha8Rng) -> Vec<Observed<f64>> {
    let draw = |index: usize| Observed {
        dof: index % 2,
        quantity: if index % 5 == 4 {
            Quantity::Velocity
        } else {
            Quantity::Position
        },
        time_s: -0.8 + 3.0 * index as f64 / count as f64,
        value: rng.random_range(-1.0..1.0),
        variance: 10.0_f64.powf(rng.random_range(-3.0..0.0)),
    };
    (0..count).map(draw).collect()
}

fn narrow(hypothesis: &Hypothesis<f64>) -> Hypothesis<f32> {
    Hypothesis {
        skill: hypothesis.skill,
        duration_s: f32::of(hypothesis.duration_s),
        onset_s: f32::of(hypothesis.onset_s),
        log_prior: f32::of(hypothesis.log_prior),
    }
}

fn narrow_seen(seen: &Observed<f64>) -> Observed<f32> {
    Observed {
        dof: seen.dof,
        quantity: seen.quantity,
        time_s: f32::of(seen.time_s),
        value: f32::of(seen.value),
        variance: f32::of(seen.variance),
    }
}

fn near(got: f64, expected: f64, tolerance: f64) {
    let error = (got - expected).abs();
    assert!(
        error <= tolerance * expected.abs().max(1.0),
        "{got} is not {expected}: {error:.1e}"
    );
}
