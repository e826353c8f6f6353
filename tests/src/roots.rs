//! Roots of covariances as inference takes them.

use tonus_shared::Real;
use tonus_shared::promp::{root_len, triangular_root};

/// The packed triangle of any square root, `rank x rank` row-major.
///
/// # Panics
/// When it is of another size.
#[must_use]
pub fn triangle<T: Real>(rank: usize, root: &[T]) -> Vec<T> {
    let mut packed = vec![T::zero(); root_len(rank)];
    let made = triangular_root(rank, &mut root.to_vec(), &mut packed);
    assert_eq!(made, Ok(()));
    packed
}

/// The diagonal of `S diag(shares) S^T`, `S` a packed triangle.
#[must_use]
pub fn covariance_diagonal<T: Real>(shares: &[T], triangle: &[T]) -> Vec<f64> {
    let mut variances = vec![0.0; shares.len()];
    let mut entries = triangle.iter().map(|entry| entry.widen());
    for (column, share) in shares.iter().enumerate() {
        for (variance, entry) in variances[column..].iter_mut().zip(&mut entries) {
            *variance += share.widen() * entry * entry;
        }
    }
    variances
}
