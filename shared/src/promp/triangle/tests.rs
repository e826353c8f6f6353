//! Against dense algebra, at ranks with every rest of four and with columns of zeros.

use nalgebra::SMatrix;

use super::{Real, observe, project, root_len, triangular_root};

/// Makes the triangle of a made-up root of which the last `zeros` columns are zero, and observes ten rows. The greatest
/// errors: of the triangle's square, and of the covariance.
fn errors<T: Real, const R: usize>(zeros: usize) -> (f64, f64) {
    let root = SMatrix::<f64, R, R>::from_fn(|i, j| {
        let entry = libm::sin(1.3 * (i * R + j) as f64);
        if j < R - zeros { entry } else { 0.0 }
    });
    let mut packed = [T::zero(); 64];
    let packed = &mut packed[..root_len(R)];
    let mut matrix = [[T::zero(); R]; R];
    for (i, line) in matrix.iter_mut().enumerate() {
        *line = core::array::from_fn(|j| T::of(root[(i, j)]));
    }
    assert_eq!(
        triangular_root(R, matrix.as_flattened_mut(), packed),
        Ok(())
    );
    let mut shares = [T::one(); R];
    let mut dense = root * root.transpose();
    let made = (covariance::<T, R>(packed, &shares) - dense).amax();
    for step in 0..10 {
        let a = SMatrix::<f64, R, 1>::from_fn(|i, _| libm::cos(0.7 * (i + step * R) as f64));
        let (row, mut f): ([T; R], _) = (core::array::from_fn(|i| T::of(a[i])), [T::zero(); R]);
        project(packed, &row, &mut f);
        let noise = 10.0_f64.powi(-(step as i32));
        observe(packed, &mut shares, &mut f, T::of(noise));
        let gain = dense * a;
        for (e, expected) in f.iter().zip(gain.iter()) {
            assert!((e.widen() - expected).abs() < 1e-3, "P a: {e} {expected}");
        }
        dense -= gain * gain.transpose() / (a.dot(&gain) + noise);
        assert!(shares.iter().all(|share| *share > T::zero()));
    }
    (made, (covariance::<T, R>(packed, &shares) - dense).amax())
}

fn covariance<T: Real, const R: usize>(packed: &[T], shares: &[T]) -> SMatrix<f64, R, R> {
    let mut root = SMatrix::<f64, R, R>::zeros();
    let mut entries = packed.iter();
    for column in 0..R {
        for (row, entry) in (column..R).zip(&mut entries) {
            root[(row, column)] = entry.widen();
        }
    }
    let shares = SMatrix::<f64, R, R>::from_fn(|i, j| if i == j { shares[i].widen() } else { 0.0 });
    root * shares * root.transpose()
}

#[test]
fn root_and_update_are_the_dense_ones() {
    let all = [
        (errors::<f64, 1>(0), errors::<f32, 1>(0)),
        (errors::<f64, 4>(0), errors::<f32, 4>(0)),
        (errors::<f64, 6>(0), errors::<f32, 6>(0)),
        (errors::<f64, 7>(3), errors::<f32, 7>(3)),
        (errors::<f64, 9>(0), errors::<f32, 9>(0)),
        (errors::<f64, 9>(7), errors::<f32, 9>(7)),
    ];
    for (double, single) in all {
        assert!(double.0 < 1e-13 && double.1 < 1e-9, "{double:?}");
        assert!(single.0 < 1e-5 && single.1 < 1e-3, "{single:?}");
    }
}

#[test]
fn a_triangle_stays_as_it_is_and_lengths_are_checked() {
    let mut matrix = [-2.0, 0.0, 0.5, 3.0];
    let mut packed = [0.0; 3];
    assert_eq!(triangular_root(2, &mut matrix, &mut packed), Ok(()));
    assert_eq!(packed, [-2.0, 0.5, 3.0]);
    assert!(triangular_root(2, &mut matrix[..3], &mut packed).is_err());
    assert!(triangular_root(2, &mut matrix, &mut packed[..2]).is_err());
}
