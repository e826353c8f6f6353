//! Square roots of a covariance as packed lower triangles: how one comes from any other root, and the two products
//! that conditioning is made of.
//!
//! Column after column, each from its diagonal down: entry `(i, j)` is number `i - j` of column `j`, which is
//! `r - j` long. Columns are taken [`ABREAST`] at once, the odd ones first, so that below every block there are
//! whole groups of [`ABREAST`] rows and no sum waits for another.

use super::error::ModelError;
use super::latent::check_finite;
use super::linear::{ABREAST, Four, add_product, dot, total};
use crate::Real;

/// Numbers in the packed triangle of `rank` rows: `r (r + 1) / 2`.
#[must_use]
pub const fn root_len(rank: usize) -> usize {
    rank * (rank + 1) / 2
}

/// Writes the lower triangle `S` with `S S^T = M M^T` to `out` (packed by columns, [`root_len`] numbers). `matrix` is
/// `M`, `r x r` row-major, any square root; it is overwritten. By Householder reflections from the
/// right, `2/3 r^3` multiply-adds: done once, where a model is made. A matrix that is triangular is copied as it is, and
/// last columns of zeros stay zeros (they cost no time later).
///
/// # Errors
/// A length that does not fit the rank, a number that is not finite.
pub fn triangular_root<T: Real>(
    rank: usize,
    matrix: &mut [T],
    out: &mut [T],
) -> Result<(), ModelError> {
    let lengths = [
        ("the root", rank.saturating_mul(rank), matrix.len()),
        ("the triangular root", root_len(rank), out.len()),
    ];
    for (what, expected, got) in lengths {
        if expected != got {
            return Err(ModelError::Length {
                what,
                expected,
                got,
            });
        }
    }
    check_finite("the root", matrix)?;
    for pivot in 0..rank {
        let (above, below) = matrix.split_at_mut((pivot + 1) * rank);
        let line = &mut above[pivot * rank + pivot..];
        let Some(length) = reflector(line) else {
            continue;
        };
        for row in below.chunks_exact_mut(rank) {
            let row = &mut row[pivot..];
            let twice = dot(row, line) + dot(row, line);
            for (entry, v) in row.iter_mut().zip(line.iter()) {
                *entry -= twice * *v;
            }
        }
        line[0] = length;
    }
    let mut rest = out;
    for column in 0..rank {
        let (packed, after) = rest.split_at_mut(rank - column);
        let entries = matrix[column * rank + column..].iter().step_by(rank);
        for (entry, from) in packed.iter_mut().zip(entries) {
            *entry = *from;
        }
        rest = after;
    }
    Ok(())
}

/// Makes of a row the unit vector `v` whose reflection `1 - 2 v v^T` takes it to a multiple of the first axis, and
/// returns that multiple; `None` if it is one already.
fn reflector<T: Real>(line: &mut [T]) -> Option<T> {
    let rest = line.iter().skip(1);
    let largest = rest.fold(T::zero(), |most, entry| most.max(entry.abs()));
    if largest.is_zero() {
        return None;
    }
    // In units of the largest entry, or squares leave the scalar's range.
    let unit = largest.max(line[0].abs());
    for entry in line.iter_mut() {
        *entry /= unit;
    }
    let length = dot(line, line).sqrt().copysign(-line[0]);
    line[0] -= length;
    let norm = dot(line, line).sqrt();
    for entry in line.iter_mut() {
        *entry /= norm;
    }
    Some(length * unit)
}

/// `f = S^T a`: `r^2 / 2` multiply-adds.
pub(super) fn project<T: Real>(root: &[T], a: &[T], f: &mut [T]) {
    let odd = a.len() % ABREAST;
    let (root, f) = match odd {
        1 => project_block::<T, 1>(root, a, f),
        2 => project_block::<T, 2>(root, a, f),
        3 => project_block::<T, 3>(root, a, f),
        _ => (root, f),
    };
    let (mut root, mut f, mut a) = (root, f, &a[odd..]);
    while !a.is_empty() {
        (root, f) = project_block::<T, ABREAST>(root, a, f);
        a = &a[ABREAST..];
    }
}

/// `M` columns of [`project`], as long as `a`; returns what comes after them.
#[inline(always)]
fn project_block<'r, 'f, T: Real, const M: usize>(
    root: &'r [T],
    a: &[T],
    f: &'f mut [T],
) -> (&'r [T], &'f mut [T]) {
    let ((corners, tails), rest) = cut::<T, M>(root, a.len());
    let (near, far) = a.split_at(M);
    let (far, _) = far.as_chunks::<ABREAST>();
    let tails = tails.map(|tail| &tail[..far.len()]);
    let mut sums = [[T::zero(); ABREAST]; M];
    for (m, sum) in sums.iter_mut().enumerate() {
        let products = corners[m].iter().zip(&near[m..]);
        for (sum, (entry, a)) in sum.iter_mut().zip(products) {
            *sum = *entry * *a;
        }
    }
    for (i, a) in far.iter().enumerate() {
        for (sum, tail) in sums.iter_mut().zip(tails) {
            add_product(sum, &tail[i], a);
        }
    }
    let (out, after) = f.split_at_mut(M);
    for (out, sum) in out.iter_mut().zip(&sums) {
        *out = total(sum);
    }
    (rest, after)
}

/// Of each column: what it has in the block's own rows, and in groups of the rows below.
type Cut<'r, T, const M: usize> = ([&'r [T]; M], [&'r [Four<T>]; M]);

/// Columns of length `rows` and less: what each has in the block's own rows, and in groups of the rows below; and what
/// comes after them.
#[inline(always)]
fn cut<T, const M: usize>(mut root: &[T], rows: usize) -> (Cut<'_, T, M>, &[T]) {
    let (mut corners, mut tails): ([&[T]; M], [&[Four<T>]; M]) = ([&[]; M], [&[]; M]);
    for m in 0..M {
        let (column, rest) = root.split_at(rows - m);
        let (corner, tail) = column.split_at(M - m);
        (corners[m], tails[m]) = (corner, tail.as_chunks().0);
        root = rest;
    }
    ((corners, tails), root)
}

/// A share below which it is multiplied into its column, so that no column outgrows the scalar.
const LEAST_SHARE: f64 = 1e-6;

/// Bierman's update of `P = S diag(shares) S^T`, from the last column to the first, in place and without square roots:
///
/// ```text
/// alpha_j = alpha_(j+1) + d_j f_j^2       from alpha_r = noise
/// S_j    <- S_j - f_j / alpha_(j+1) e     d_j <- d_j alpha_(j+1) / alpha_j
/// e      <- e + d_j f_j S_j               from zero, with S_j and d_j as they were
/// ```
///
/// so that afterwards `P` is less by `P a a^T P / (sum d_j f_j^2 + noise)`. Takes `f = S^T a`, leaves `e = P a` in its place.
/// No share becomes negative. `r^2` multiply-adds, `r` divisions; blocks of columns that are zero are
/// passed over. `noise` is positive and normal.
pub(super) fn observe<T: Real>(root: &mut [T], shares: &mut [T], f: &mut [T], noise: T) {
    let rank = f.len();
    let odd = rank % ABREAST;
    let mut alpha = Alpha {
        value: noise,
        inverse: T::one() / noise,
        small: false,
    };
    let (mut left, mut rows) = (&mut *root, 0);
    for from in (odd..rank).step_by(ABREAST).rev() {
        rows += ABREAST;
        // As many rows less the corner's missing triangle.
        let length = ABREAST * rows - ABREAST * (ABREAST - 1) / 2;
        let (before, block) = left.split_at_mut(left.len() - length);
        observe_block::<T, ABREAST>(block, &mut shares[from..], &mut f[from..], &mut alpha);
        left = before;
    }
    match odd {
        1 => observe_block::<T, 1>(left, shares, f, &mut alpha),
        2 => observe_block::<T, 2>(left, shares, f, &mut alpha),
        3 => observe_block::<T, 3>(left, shares, f, &mut alpha),
        _ => {}
    }
    if alpha.small {
        fold(root, shares);
    }
}

/// The running sum of the update, and whether it has left a share small.
struct Alpha<T> {
    value: T,
    inverse: T,
    small: bool,
}

/// What the update does to one column: `S <- S - take e`, `e <- e + add S`.
#[derive(Clone, Copy)]
struct Step<T> {
    take: T,
    add: T,
}

/// `M` columns of [`observe`]: `vector` is `f` in the block's rows and `e` below them, then `e` in all.
#[inline(always)]
fn observe_block<T: Real, const M: usize>(
    block: &mut [T],
    shares: &mut [T],
    vector: &mut [T],
    alpha: &mut Alpha<T>,
) {
    let rows = vector.len();
    let (Some((near, far)), Some(shares)) = (
        vector.split_first_chunk_mut::<M>(),
        shares.first_chunk_mut::<M>(),
    ) else {
        return;
    };
    if near.iter().all(|f| f.is_zero()) {
        return;
    }
    let steps = steps(near, shares, alpha);
    let columns = split_mut::<T, M>(block, rows);
    let (far, _) = far.as_chunks_mut::<ABREAST>();
    let mut e = [T::zero(); M];
    let (mut corners, mut tails): ([&mut [T]; M], [&mut [Four<T>]; M]) = (
        core::array::from_fn(|_| &mut [][..]),
        core::array::from_fn(|_| &mut [][..]),
    );
    for (m, column) in columns.into_iter().enumerate() {
        let (corner, tail) = column.split_at_mut(M - m);
        (corners[m], tails[m]) = (corner, &mut tail.as_chunks_mut().0[..far.len()]);
    }
    for m in (0..M).rev() {
        // The diagonal stays: nothing of `e` is in its row yet.
        let Some((diagonal, below)) = corners[m].split_first_mut() else {
            return;
        };
        e[m] = steps[m].add * *diagonal;
        for (entry, e) in below.iter_mut().zip(&mut e[m + 1..]) {
            turn(entry, e, &steps[m]);
        }
    }
    *near = e;
    for (i, e) in far.iter_mut().enumerate() {
        let mut sums = *e;
        for m in (0..M).rev() {
            // Out of memory, and back: in between nothing can alias.
            let mut four = tails[m][i];
            for (entry, e) in four.iter_mut().zip(&mut sums) {
                turn(entry, e, &steps[m]);
            }
            tails[m][i] = four;
        }
        *e = sums;
    }
}

/// The steps of a block's columns, and their shares after it. The divisions do not wait for each other.
#[inline(always)]
fn steps<T: Real, const M: usize>(
    f: &[T; M],
    shares: &mut [T; M],
    alpha: &mut Alpha<T>,
) -> [Step<T>; M] {
    let (first, mut before) = (alpha.inverse, [alpha.value; M]);
    let mut steps = [Step {
        take: T::zero(),
        add: T::zero(),
    }; M];
    for m in (0..M).rev() {
        before[m] = alpha.value;
        steps[m].add = shares[m] * f[m];
        alpha.value += steps[m].add * f[m];
    }
    let mut inverse = [alpha.value; M];
    for m in 0..M {
        let after = if m > 0 { before[m - 1] } else { alpha.value };
        inverse[m] = T::one() / after;
    }
    for m in 0..M {
        steps[m].take = f[m] * if m + 1 < M { inverse[m + 1] } else { first };
        shares[m] *= before[m] * inverse[m];
        alpha.small |= shares[m] < T::of(LEAST_SHARE);
    }
    alpha.inverse = inverse[0];
    steps
}

/// Multiplies the shares that have become small into their columns.
#[cold]
fn fold<T: Real>(root: &mut [T], shares: &mut [T]) {
    let (rank, mut rest) = (shares.len(), root);
    for (index, share) in shares.iter_mut().enumerate() {
        let (column, after) = rest.split_at_mut(rank - index);
        rest = after;
        if *share < T::of(LEAST_SHARE) {
            let scale = share.sqrt();
            for entry in column {
                *entry *= scale;
            }
            *share = T::one();
        }
    }
}

#[inline(always)]
fn split_mut<T, const M: usize>(mut root: &mut [T], rows: usize) -> [&mut [T]; M] {
    core::array::from_fn(|m| {
        let (column, rest) = core::mem::take(&mut root).split_at_mut(rows - m);
        root = rest;
        column
    })
}

#[inline(always)]
fn turn<T: Real>(entry: &mut T, e: &mut T, step: &Step<T>) {
    let before = *entry;
    *entry = before - step.take * *e;
    *e += step.add * before;
}

#[cfg(test)]
mod tests;
