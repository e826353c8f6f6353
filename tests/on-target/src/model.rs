//! Smooth made-up numbers in the shapes of a model: what is counted does not depend on them.

use libm::{cosf, sinf};
use tonus_shared::promp::root_len;

/// `N` numbers between -1 and 1.
pub(crate) fn numbers<const N: usize>(rate: f32) -> [f32; N] {
    core::array::from_fn(|i| sinf(rate * i as f32 + 0.4))
}

/// A packed root of rank `rank` with a diagonal of about one.
pub(crate) fn root<const N: usize>(rank: usize) -> [f32; N] {
    assert!(N == root_len(rank));
    let mut root = core::array::from_fn(|i| 0.1 * cosf(i as f32));
    let mut diagonal = 0;
    for column in (1..=rank).rev() {
        root[diagonal] += 1.0;
        diagonal += column;
    }
    root
}
