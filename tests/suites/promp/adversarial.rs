//! Whatever is thrown at a mixture, it either takes it and stays sound or refuses it and stays as it was.

use proptest::prelude::*;
use tonus_shared::Real;
use tonus_shared::promp::{
    Basis, Latent, Mixture, Observation, Row, Skill, mixture_len, trajectory_scratch_len,
};

/// Numbers from the whole line, the everyday ones often.
fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        6 => -2.0..2.0,
        2 => any::<f64>(),
        1 => prop::sample::select(vec![
            0.0, -0.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e-45, 1e-38, 1e-320, 1e19, -1e19, 3e38, -3e38,
            f64::MAX, f64::MIN,
        ]),
    ]
}

fn model_number() -> impl Strategy<Value = f64> {
    prop_oneof![
        8 => -2.0..2.0,
        1 => (-18.0..18.0f64).prop_map(|exponent| 10.0_f64.powf(exponent)),
    ]
}

#[derive(Debug, Clone)]
struct Shape {
    basis: Basis,
    dofs: usize,
    rank: usize,
    freedom: Option<f64>,
    numbers: Vec<f64>,
}

fn shape() -> impl Strategy<Value = Shape> {
    let basis = prop_oneof![
        (1..6_usize).prop_map(|k| Basis::gaussian(k).unwrap()),
        (0..3_usize).prop_map(|k| Basis::fourier(2 * k + 1).unwrap()),
        (1..6_usize).prop_map(|k| Basis::bernstein(k).unwrap()),
    ];
    (basis, 1..4_usize, 1..5_usize).prop_flat_map(|(basis, dofs, rank)| {
        let weights = dofs * basis.count();
        let count = weights * rank + 2 * weights + rank * rank + dofs;
        let freedom = prop::option::of(prop_oneof![2.000_001..2.1, 2.1..40.0]);
        let numbers = prop::collection::vec(model_number(), count);
        (numbers, freedom).prop_map(move |(numbers, freedom)| Shape {
            basis,
            dofs,
            rank,
            freedom,
            numbers,
        })
    })
}

fn observation() -> impl Strategy<Value = (usize, Option<f64>, f64, f64, f64)> {
    let everyday = (0.0..1.0f64, -2.0..2.0f64, 1e-8..1.0f64);
    prop_oneof![
        3 => (0..3_usize, prop::option::of(0.1..5.0f64), everyday)
            .prop_map(|(dof, duration, (s, y, r))| (dof, duration, s, y, r)),
        1 => (0..5_usize, prop::option::of(number()), number(), number(), number()),
    ]
}

/// All that can be asked of a mixture, as bits.
fn snapshot<T: Real>(mixture: &Mixture<'_, T, Vec<T>>) -> Vec<u64> {
    let mut all = Vec::new();
    for q in 0..mixture.skills().len() {
        let belief = mixture.belief(q).unwrap();
        all.extend(belief.mean().iter().map(|v| v.widen().to_bits()));
        all.extend(belief.shares().iter().map(|v| v.widen().to_bits()));
        all.extend(belief.root().iter().map(|v| v.widen().to_bits()));
        all.push(belief.log_likelihood().widen().to_bits());
        all.push(belief.inflation().widen().to_bits());
    }
    all
}

fn latent_variances<T: Real>(mixture: &Mixture<'_, T, Vec<T>>) -> Vec<f64> {
    (0..mixture.skills().len())
        .flat_map(|q| {
            let belief = mixture.belief(q).unwrap();
            tonus_tests::covariance_diagonal(belief.shares(), belief.root())
        })
        .collect()
}

fn sound<T: Real>(mixture: &Mixture<'_, T, Vec<T>>, shape: &Shape) {
    let mut posterior = vec![T::zero(); mixture.skills().len()];
    mixture.log_posterior(&mut posterior).unwrap();
    let total: f64 = posterior.iter().map(|p| p.widen().exp()).sum();
    assert!((total - 1.0).abs() < 1e-5, "{posterior:?}");
    assert!(posterior[mixture.most_likely()] >= posterior[0]);
    assert!(
        snapshot(mixture)
            .iter()
            .all(|bits| f64::from_bits(*bits).is_finite())
    );
    let mut scratch = vec![T::zero(); trajectory_scratch_len(shape.basis.count(), shape.rank)];
    for q in 0..mixture.skills().len() {
        let trajectory = mixture.trajectory(q).unwrap();
        let row = Row::position(0, T::of(0.4));
        // A model near the scalar's range may refuse; an answer is finite and not negative.
        if let Ok(moments) = trajectory.moments(&row, &mut scratch) {
            assert!(moments.mean.is_finite());
            assert!(moments.variance.is_finite() && moments.variance >= T::zero());
            assert_eq!(trajectory.mean(&row, &mut scratch), Ok(moments.mean));
        }
    }
}

fn throw<T: Real>(
    shape: &Shape,
    observations: &[(usize, Option<f64>, f64, f64, f64)],
    rounding: f64,
) {
    let numbers: Vec<T> = shape.numbers.iter().map(|v| T::of(*v)).collect();
    let weights = shape.dofs * shape.basis.count();
    let (loading, rest) = numbers.split_at(weights * shape.rank);
    let (means, rest) = rest.split_at(2 * weights);
    let (root, residual) = rest.split_at(shape.rank * shape.rank);
    let root = tonus_tests::triangle(shape.rank, root);
    let residual: Vec<T> = residual.iter().map(|v| v.abs()).collect();
    let latent = Latent::new(shape.basis, shape.dofs, shape.rank, loading).unwrap();
    let other = Skill::new(&latent, &means[weights..], Some(&root), &residual, T::one()).unwrap();
    let skills = [
        Skill::new(&latent, &means[..weights], None, &residual, T::zero()).unwrap(),
        shape
            .freedom
            .map_or(other, |freedom| other.with_freedom(T::of(freedom)).unwrap()),
    ];
    let storage = vec![T::zero(); mixture_len(2, shape.basis.count(), shape.rank)];
    let mut mixture = Mixture::new(latent, &skills, storage).unwrap();
    for (dof, duration_s, phase, value, variance) in observations {
        let row = match duration_s {
            None => Row::position(*dof, T::of(*phase)),
            Some(duration_s) => Row::velocity(*dof, T::of(*phase), T::of(*duration_s)),
        };
        let (before, spread) = (snapshot(&mixture), latent_variances(&mixture));
        let outcome = mixture.observe(&Observation {
            row,
            value: T::of(*value),
            variance: T::of(*variance),
        });
        match outcome {
            Err(refused) => {
                assert_eq!(before, snapshot(&mixture), "changed, though: {refused}");
                assert!(!refused.to_string().is_empty());
            }
            Ok(()) => {
                assert!(T::of(*value).is_finite() && T::of(*variance) > T::zero());
                // Knowing more never makes a coordinate less certain.
                for (after, before) in latent_variances(&mixture).iter().zip(spread) {
                    assert!(*after <= before * (1.0 + rounding) + f64::from(f32::MIN_POSITIVE));
                }
            }
        }
        sound(&mixture, shape);
    }
}

proptest! {
    #![proptest_config(tonus_tests::seeded(400))]

    #[test]
    fn f32_is_never_damaged(shape in shape(), seen in prop::collection::vec(observation(), 0..40)) {
        throw::<f32>(&shape, &seen, 1e-5);
    }

    #[test]
    fn f64_is_never_damaged(shape in shape(), seen in prop::collection::vec(observation(), 0..40)) {
        throw::<f64>(&shape, &seen, 1e-13);
    }

    #[test]
    fn any_phase_gives_a_finite_basis(count in 1..40_usize, phase in number(), width in number()) {
        use tonus_shared::promp::Family;
        let bases = [
            Basis::gaussian(count),
            Basis::fourier(2 * count - 1),
            Basis::bernstein(count),
            Basis::new(Family::Gaussian { width: width.abs() }, count),
        ];
        for basis in bases.into_iter().flatten() {
            let mut out = vec![0.0; basis.count()];
            let mut narrow = vec![0.0; basis.count()];
            let small = f32::of(phase);
            for (wide, short) in [
                (basis.values(phase, &mut out), basis.values(small, &mut narrow)),
                (basis.derivatives(phase, &mut out), basis.derivatives(small, &mut narrow)),
            ] {
                prop_assert_eq!(wide.is_ok(), phase.is_finite());
                prop_assert_eq!(short.is_ok(), small.is_finite());
                prop_assert!(out.iter().all(|v: &f64| v.is_finite()));
                prop_assert!(narrow.iter().all(|v: &f32| v.is_finite()));
            }
        }
    }
}
