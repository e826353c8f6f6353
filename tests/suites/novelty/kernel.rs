//! The judging kernel against closed forms and dense algebra.

use nalgebra::{Cholesky, DMatrix, DVector};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use tonus_shared::Real;
use tonus_shared::promp::{Known, ModelError, Watch, WatchError, triangle_len, watch_len};

/// `L = [[2, 0], [1, 3]]`, references whitened to (0, 0) and (2, 1), of skills 0 and 1.
fn two_rows<T: Real>(overflows: bool) {
    let number = T::of;
    let factors = [2.0, 1.0, 3.0, 2.0, 1.0, 3.0].map(number);
    let references = [0.0, 0.0, 2.0, 1.0].map(number);
    let thresholds = [0.1, 1.0].map(number);
    let known = Known {
        factors: &factors,
        references: &references,
        skills: &[0, 1],
        tail: number(1.0),
        thresholds: &thresholds,
    };
    let mut watch = Watch::new(known, [T::zero(); watch_len(2, 2, 2)]).unwrap();
    assert!(watch.novelty().is_none());
    let close = |got: T, expected: f64| assert!((got.widen() - expected).abs() < 1e-6, "{got}");

    // Whitened: 4 / 2 = 2; then (8 - 1 * 2) / 3 = 2.
    watch.observe(number(4.0)).unwrap();
    let first = watch.novelty().unwrap();
    assert_eq!((first.nearest, first.unknown()), (1, false));
    close(first.score, 0.0);
    watch.observe(number(8.0)).unwrap();
    let second = watch.novelty().unwrap();
    assert_eq!((second.nearest, second.unknown()), (1, false));
    close(second.score, 2.0_f64.ln() / 2.0);
    close(second.threshold, 1.0);
    close(second.distance, 0.5_f64.sqrt());
    let all: Vec<(usize, T)> = watch.surprises().collect();
    close(all[0].1, 5.0_f64.ln());

    assert_eq!(
        watch.observe(number(1.0)),
        Err(WatchError::Full { rows: 2 })
    );
    watch.reset();
    let refused = watch.observe(number(f64::NAN));
    assert!(matches!(refused, Err(WatchError::Value { .. })));
    let refused = watch.observe(number(1e38));
    assert_eq!(
        matches!(refused, Err(WatchError::Overflow { .. })),
        overflows
    );
    assert_eq!(watch.seen(), usize::from(!overflows));
    watch.reset();
    watch.observe(number(-10.0)).unwrap();
    assert!(watch.novelty().unwrap().unknown());
}

#[test]
fn two_rows_by_hand() {
    // The square of 1e38 is more than `f32` holds.
    two_rows::<f32>(true);
    two_rows::<f64>(false);
}

#[test]
fn the_streamed_distance_is_the_dense_one() {
    let mut random = ChaCha8Rng::seed_from_u64(11);
    for rows in [1, 3, 12] {
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let a = DMatrix::from_fn(rows, rows + 2, |_, _| normal());
        let covariance = &a * a.transpose();
        let factor = Cholesky::new(covariance.clone()).unwrap();
        let reference = DVector::from_fn(rows, |_, _| normal());
        let seen = DVector::from_fn(rows, |_, _| normal());
        let lower = factor.l();
        let packed: Vec<f64> = (0..rows)
            .flat_map(|row| (0..=row).map(move |column| (row, column)))
            .map(|place| lower[place])
            .collect();
        assert_eq!(packed.len(), triangle_len(rows));
        let whitened = lower.solve_lower_triangular(&reference).unwrap();
        let known = Known {
            factors: &packed,
            references: whitened.as_slice(),
            skills: &[0],
            tail: 1.0,
            thresholds: &vec![1.0; rows],
        };
        let mut watch = Watch::new(known, vec![0.0; watch_len(1, rows, 1)]).unwrap();
        for (row, &value) in seen.iter().enumerate() {
            watch.observe(value).unwrap();
            // The Mahalanobis distance of the first rows, by a solver that knows no order.
            let part = covariance.view((0, 0), (row + 1, row + 1)).into_owned();
            let apart = (&seen - &reference).rows(0, row + 1).into_owned();
            let solved = part.lu().solve(&apart).unwrap();
            let expected = (apart.dot(&solved) / (row + 1) as f64).sqrt();
            let got = watch.novelty().unwrap().distance;
            assert!(
                (got - expected).abs() < 1e-9 * (1.0 + expected),
                "{got} {expected}"
            );
        }
    }
}

#[test]
fn lists_that_do_not_fit_are_refused() {
    let good = Known {
        factors: &[1.0_f64],
        references: &[0.0],
        skills: &[0],
        tail: 1.0,
        thresholds: &[1.0],
    };
    assert!(Watch::new(good, [0.0; 3]).is_ok());
    let refused = |known, length: usize| Watch::new(known, vec![0.0; length]).unwrap_err();
    assert!(matches!(
        refused(good, 2),
        ModelError::Storage {
            needed: 3,
            got: 2,
            ..
        }
    ));
    let short = Known {
        references: &[],
        ..good
    };
    assert!(matches!(refused(short, 3), ModelError::Length { .. }));
    let singular = Known {
        factors: &[0.0],
        ..good
    };
    assert!(matches!(refused(singular, 3), ModelError::Empty { .. }));
    let infinite = Known {
        thresholds: &[f64::NAN],
        ..good
    };
    assert!(matches!(refused(infinite, 3), ModelError::NonFinite { .. }));
    let empty = Known {
        skills: &[],
        references: &[],
        ..good
    };
    assert!(matches!(refused(empty, 3), ModelError::Empty { .. }));
}
