//! The products that conditioning is made of, written so that the compiler keeps several sums in registers
//! and none waits for another.

use crate::Real;

/// Numbers taken at once along a row, and columns of a triangle at once.
pub(super) const ABREAST: usize = 4;
/// Columns whose sums are kept in registers while the rows go by.
const COLUMNS: usize = 16;

pub(super) type Four<T> = [T; ABREAST];

/// Inner product of two slices of one length.
#[inline(always)]
pub(super) fn dot<T: Real>(a: &[T], b: &[T]) -> T {
    let ((xs, x_rest), (ys, y_rest)) = (a.as_chunks(), b.as_chunks());
    let mut sums = [T::zero(); ABREAST];
    for (x, y) in xs.iter().zip(ys) {
        add_product(&mut sums, x, y);
    }
    let rest = x_rest.iter().zip(y_rest);
    total(&sums) + rest.fold(T::zero(), |sum, (x, y)| sum + *x * *y)
}

/// `sum a_i (b_i - center)`.
#[inline(always)]
pub(super) fn dot_about<T: Real>(a: &[T], b: &[T], center: T) -> T {
    let ((xs, x_rest), (ys, y_rest)) = (a.as_chunks(), b.as_chunks());
    let mut sums = [T::zero(); ABREAST];
    for (x, y) in xs.iter().zip(ys) {
        add_product(&mut sums, x, &y.map(|y| y - center));
    }
    let rest = x_rest.iter().zip(y_rest);
    total(&sums) + rest.fold(T::zero(), |sum, (x, y)| sum + *x * (*y - center))
}

/// `sum w_i x_i y_i`; without weights the inner product.
pub(super) fn weighted_dot<T: Real>(weights: Option<&[T]>, x: &[T], y: &[T]) -> T {
    match weights {
        Some(weights) => {
            let (xs, x_rest) = x.as_chunks::<ABREAST>();
            let (ys, y_rest) = y.as_chunks();
            let (ws, w_rest) = weights.as_chunks::<ABREAST>();
            let mut sums = [T::zero(); ABREAST];
            for ((x, y), w) in xs.iter().zip(ys).zip(ws) {
                add_product(&mut sums, &core::array::from_fn(|i| x[i] * w[i]), y);
            }
            let rest = x_rest.iter().zip(y_rest).zip(w_rest);
            total(&sums) + rest.fold(T::zero(), |sum, ((x, y), w)| sum + *x * *w * *y)
        }
        None => dot(x, y),
    }
}

/// `out = M^T weights`, `M` row-major with as many rows as there are weights.
pub(super) fn combine<T: Real>(matrix: &[T], weights: &[T], out: &mut [T]) {
    let width = out.len();
    if let Some(last) = width.checked_sub(COLUMNS) {
        // The last block overlaps the one before it rather than leave a rest.
        return (0..width)
            .step_by(COLUMNS)
            .for_each(|at| columns::<T, COLUMNS>(matrix, weights, at.min(last), out));
    }
    let (mut at, half) = (0, COLUMNS / 2);
    if width >= half {
        columns::<T, { COLUMNS / 2 }>(matrix, weights, 0, out);
        at = half;
    }
    while at + ABREAST <= width {
        columns::<T, ABREAST>(matrix, weights, at, out);
        at += ABREAST;
    }
    (at..width).for_each(|at| columns::<T, 1>(matrix, weights, at, out));
}

/// `W` numbers of [`combine`], from column `at` on.
#[inline(always)]
fn columns<T: Real, const W: usize>(matrix: &[T], weights: &[T], at: usize, out: &mut [T]) {
    let mut sums = [T::zero(); W];
    for (weight, row) in weights.iter().zip(matrix.chunks_exact(out.len())) {
        for (sum, entry) in sums.iter_mut().zip(&row[at..at + W]) {
            *sum += *weight * *entry;
        }
    }
    out[at..at + W].copy_from_slice(&sums);
}

/// Whether every number is finite.
pub(super) fn all_finite<T: Real>(numbers: &[T]) -> bool {
    let (fours, rest) = numbers.as_chunks();
    let nothing = [T::zero(); ABREAST];
    let mut sums = nothing;
    for four in fours {
        add_product(&mut sums, four, &nothing);
    }
    // Zero, unless a number is not finite.
    let rest = rest.iter().fold(T::zero(), |sum, x| sum + *x * T::zero());
    (total(&sums) + rest).is_zero()
}

/// `sums_i += x_i y_i`.
#[inline(always)]
pub(super) fn add_product<T: Real>(sums: &mut Four<T>, x: &Four<T>, y: &Four<T>) {
    for (sum, (x, y)) in sums.iter_mut().zip(x.iter().zip(y)) {
        *sum += *x * *y;
    }
}

/// The sum of all.
#[inline(always)]
pub(super) fn total<T: Real>(sums: &Four<T>) -> T {
    (sums[0] + sums[2]) + (sums[1] + sums[3])
}
