//! The products that conditioning is made of, written so that the compiler keeps several sums in registers
//! and none waits for another.

use crate::Real;

/// Numbers taken at once along a row, and rows at once.
const ABREAST: usize = 4;
/// Columns whose sums are kept in registers while the rows go by.
const COLUMNS: usize = 16;

type Four<T> = [T; ABREAST];

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

/// `out = M^T weights`, `M` row-major with as many rows as there are weights.
pub(super) fn combine<T: Real>(matrix: &[T], weights: &[T], out: &mut [T]) {
    let width = out.len();
    match width.checked_sub(COLUMNS) {
        // The last block overlaps the one before it rather than leave a rest.
        Some(last) => (0..width)
            .step_by(COLUMNS)
            .for_each(|at| columns::<T, COLUMNS>(matrix, weights, at.min(last), out)),
        None => (0..width).for_each(|at| columns::<T, 1>(matrix, weights, at, out)),
    }
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

/// Conditions root and mean: `t_i = M_i f` for each row of the square `M`, `mean_i += residual t_i`, and
/// `M_i -= factor t_i f`.
pub(super) fn project_out<T: Real>(
    matrix: &mut [T],
    mean: &mut [T],
    f: &[T],
    residual: T,
    factor: T,
) {
    let width = f.len();
    let (means, means_rest) = mean.as_chunks_mut::<ABREAST>();
    let mut blocks = matrix.chunks_exact_mut(ABREAST * width);
    for (block, mean) in (&mut blocks).zip(means) {
        let (a, rest) = block.split_at_mut(width);
        let (b, rest) = rest.split_at_mut(width);
        let (c, d) = rest.split_at_mut(width);
        let mut scales = four_dots([a, b, c, d], f);
        for (mean, scale) in mean.iter_mut().zip(&mut scales) {
            *mean += *scale * residual;
            *scale *= factor;
        }
        subtract_four([a, b, c, d], &scales, f);
    }
    let rows = blocks.into_remainder().chunks_exact_mut(width);
    for (row, mean) in rows.zip(means_rest) {
        let product = dot(row, f);
        *mean += product * residual;
        for (entry, f) in row.iter_mut().zip(f) {
            *entry -= product * factor * *f;
        }
    }
}

#[inline(always)]
fn four_dots<T: Real>([a, b, c, d]: [&[T]; ABREAST], f: &[T]) -> Four<T> {
    let (fs, f_rest) = f.as_chunks();
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks(), b.as_chunks());
    let ((c, c_rest), (d, d_rest)) = (c.as_chunks(), d.as_chunks());
    let zero = [T::zero(); ABREAST];
    let (mut of_a, mut of_b, mut of_c, mut of_d) = (zero, zero, zero, zero);
    for (f, ((a, b), (c, d))) in fs.iter().zip(a.iter().zip(b).zip(c.iter().zip(d))) {
        add_product(&mut of_a, a, f);
        add_product(&mut of_b, b, f);
        add_product(&mut of_c, c, f);
        add_product(&mut of_d, d, f);
    }
    let mut products = [total(&of_a), total(&of_b), total(&of_c), total(&of_d)];
    for (i, f) in f_rest.iter().enumerate() {
        let entries = [a_rest[i], b_rest[i], c_rest[i], d_rest[i]];
        add_product(&mut products, &entries, &[*f; ABREAST]);
    }
    products
}

/// `row_i -= scale_i f`.
#[inline(always)]
fn subtract_four<T: Real>([a, b, c, d]: [&mut [T]; ABREAST], scales: &Four<T>, f: &[T]) {
    let (fs, f_rest) = f.as_chunks();
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks_mut(), b.as_chunks_mut());
    let ((c, c_rest), (d, d_rest)) = (c.as_chunks_mut(), d.as_chunks_mut());
    let rows = a.iter_mut().zip(b).zip(c.iter_mut().zip(d));
    for (f, ((a, b), (c, d))) in fs.iter().zip(rows) {
        subtract(a, scales[0], f);
        subtract(b, scales[1], f);
        subtract(c, scales[2], f);
        subtract(d, scales[3], f);
    }
    for (i, f) in f_rest.iter().enumerate() {
        a_rest[i] -= scales[0] * *f;
        b_rest[i] -= scales[1] * *f;
        c_rest[i] -= scales[2] * *f;
        d_rest[i] -= scales[3] * *f;
    }
}

#[inline(always)]
fn add_product<T: Real>(sums: &mut Four<T>, x: &Four<T>, y: &Four<T>) {
    for (sum, (x, y)) in sums.iter_mut().zip(x.iter().zip(y)) {
        *sum += *x * *y;
    }
}

#[inline(always)]
fn subtract<T: Real>(out: &mut Four<T>, scale: T, f: &Four<T>) {
    for (out, f) in out.iter_mut().zip(f) {
        *out -= scale * *f;
    }
}

#[inline(always)]
fn total<T: Real>(sums: &Four<T>) -> T {
    (sums[0] + sums[2]) + (sums[1] + sums[3])
}
