//! How far two groupings of the same things agree.

use std::collections::BTreeMap;

/// Adjusted Rand index of two groupings: 1 where they are the same whatever the groups are called, 0 on average where
/// one is by chance. With `n_ij` things in group `i` of the one and `j` of the other and sums `a_i`, `b_j`,
///
/// `(S - E) / ((A + B) / 2 - E)`, `S = sum C(n_ij, 2)`, `A = sum C(a_i, 2)`, `B = sum C(b_j, 2)`, `E = A B / C(n, 2)`.
///
/// Where both put everything into one group, or each thing into its own, they are the same and it is 1. `None` for
/// groupings of different lengths or of nothing.
///
/// Source: Hubert and Arabie, Comparing partitions, Journal of Classification 2 (1985), eq. 5.
#[must_use]
pub fn adjusted_rand_index<A: Ord, B: Ord>(one: &[A], other: &[B]) -> Option<f64> {
    if one.len() != other.len() || one.is_empty() {
        return None;
    }
    let joint = pairs(one.iter().zip(other));
    let (a, b) = (pairs(one.iter()), pairs(other.iter()));
    let n = one.len() as f64;
    let expected = if one.len() > 1 {
        a * b / (0.5 * n * (n - 1.0))
    } else {
        0.0
    };
    let range = 0.5 * (a + b) - expected;
    if range > 0.0 {
        Some((joint - expected) / range)
    } else {
        Some(1.0)
    }
}

/// Pairs of the same key, `sum C(count, 2)`.
fn pairs<K: Ord>(keys: impl Iterator<Item = K>) -> f64 {
    let mut counts: BTreeMap<K, f64> = BTreeMap::new();
    for key in keys {
        *counts.entry(key).or_default() += 1.0;
    }
    counts
        .values()
        .map(|count| 0.5 * count * (count - 1.0))
        .sum()
}
