//! Whatever is thrown at a bank, it either takes it and stays sound or refuses it and stays as it was.

use proptest::prelude::*;
use tonus_shared::Real;
use tonus_shared::promp::{Basis, Hypothesis, Observed, Quantity, trajectory_scratch_len};

use super::{Banks, Model, narrow, narrow_seen, rng};

/// Numbers from the whole line, the everyday ones often.
fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        8 => -2.0..2.0,
        1 => any::<f64>(),
        1 => prop::sample::select(vec![
            0.0, -0.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e-45, 1e-38, 1e19, -1e19, 3e38, f64::MAX,
        ]),
    ]
}

/// What happens to a bank.
#[derive(Clone, Debug)]
enum Step {
    Add(Hypothesis<f64>),
    Observe(Observed<f64>),
}

fn step() -> impl Strategy<Value = Step> {
    let add = (0..4_usize, number(), number(), number()).prop_map(
        |(skill, duration, onset_s, log_prior)| {
            Step::Add(Hypothesis {
                skill,
                duration_s: duration.abs(),
                onset_s,
                log_prior,
            })
        },
    );
    let quantity = prop::sample::select(vec![Quantity::Position, Quantity::Velocity]);
    let everyday = (0..2_usize, -1.0..3.0f64, -2.0..2.0f64, 1e-6..1.0f64);
    let any_number = (0..3_usize, number(), number(), number());
    let observe = (prop_oneof![4 => everyday, 1 => any_number], quantity).prop_map(
        |((dof, time_s, value, variance), quantity)| {
            Step::Observe(Observed {
                dof,
                quantity,
                time_s,
                value,
                variance,
            })
        },
    );
    prop_oneof![1 => add, 2 => observe]
}

/// All that can be asked of a bank, as bits.
fn snapshot<T: Real>(bank: &Banks<'_, T>) -> Vec<u64> {
    let mut all = vec![bank.observations() as u64, u64::from(bank.dropped().floor)];
    for (index, hypothesis) in bank.hypotheses().iter().enumerate() {
        let belief = bank.belief(index).unwrap();
        all.push(hypothesis.skill as u64);
        all.extend(belief.mean().iter().map(|v| v.widen().to_bits()));
        all.extend(belief.root().iter().map(|v| v.widen().to_bits()));
        all.push(belief.log_likelihood().widen().to_bits());
    }
    all
}

fn sound<T: Real>(bank: &Banks<'_, T>, model: &Model) {
    let count = bank.hypotheses().len();
    if count == 0 {
        return;
    }
    let mut posterior = vec![T::zero(); 3];
    bank.log_posterior(&mut posterior).unwrap();
    let total: f64 = posterior.iter().map(|p| p.widen().exp()).sum();
    assert!((total - 1.0).abs() < 1e-5, "{posterior:?}");
    let each: f64 = (0..count)
        .map(|index| bank.probability(index).unwrap().widen())
        .sum();
    assert!((each - 1.0).abs() < 1e-5, "{each}");
    let best = bank.most_likely().unwrap();
    assert!((0..count).all(|index| bank.log_joint(index) <= bank.log_joint(best)));
    let phase = bank.phase(None, T::one()).unwrap();
    assert!((-1e-5..=1.0 + 1e-5).contains(&phase.mean.widen()) && phase.variance >= T::zero());
    let mut scratch = vec![T::zero(); trajectory_scratch_len(model.basis.count(), model.rank)];
    let here = bank.moments(None, (0, Quantity::Position), T::one(), &mut scratch);
    assert!(here.is_ok_and(|moments| moments.variance >= T::zero()));
}

fn throw<T: Real>(
    steps: &[Step],
    seed: u64,
    narrowed: impl Fn(&Hypothesis<f64>) -> Hypothesis<T>,
    narrowed_seen: impl Fn(&Observed<f64>) -> Observed<T>,
) {
    let basis = [
        Basis::gaussian(5).unwrap(),
        Basis::fourier(3).unwrap(),
        Basis::bernstein(4).unwrap(),
    ];
    let model = Model::random(basis[seed as usize % 3], 3, &mut rng(seed));
    let mut bank = model.bank::<T>(4, Some(T::of(15.0)));
    let mut past = Vec::new();
    for step in steps {
        let before = snapshot(&bank);
        let (live, dropped) = (bank.hypotheses().len(), bank.dropped());
        let refused = match step {
            Step::Add(hypothesis) => bank.add(narrowed(hypothesis), &past).err(),
            Step::Observe(seen) => {
                let seen = narrowed_seen(seen);
                let outcome = bank.observe(&seen);
                if outcome.is_ok() {
                    past.push(seen);
                }
                outcome.err()
            }
        };
        let after = bank.dropped();
        if let Some(refused) = refused {
            assert_eq!(before, snapshot(&bank), "changed, though: {refused}");
            assert_eq!(dropped, after);
            assert!(!refused.to_string().is_empty());
        } else {
            // Every hypothesis that came is followed or was counted when it was dropped.
            let came = usize::from(matches!(step, Step::Add(_)));
            let gone = (after.full - dropped.full) + (after.floor - dropped.floor);
            assert_eq!(bank.hypotheses().len() + gone as usize, live + came);
        }
        sound(&bank, &model);
    }
}

proptest! {
    #![proptest_config(tonus_tests::seeded(300))]

    #[test]
    fn f32_is_never_damaged(steps in prop::collection::vec(step(), 0..40), seed in 0..50_u64) {
        throw::<f32>(&steps, seed, narrow, narrow_seen);
    }

    #[test]
    fn f64_is_never_damaged(steps in prop::collection::vec(step(), 0..40), seed in 0..50_u64) {
        throw::<f64>(&steps, seed, |h| *h, |seen| *seen);
    }
}
