//! The products that conditioning is made of, written so that the compiler keeps several numbers in one
//! register and no sum waits for another.

use crate::Real;

/// Numbers, or rows of a matrix, taken at once.
const ABREAST: usize = 4;

/// Inner product of two slices of one length.
#[inline(always)]
pub(super) fn dot<T: Real>(a: &[T], b: &[T]) -> T {
    let ((xs, x_rest), (ys, y_rest)) = (a.as_chunks::<ABREAST>(), b.as_chunks::<ABREAST>());
    let mut sums = [T::zero(); ABREAST];
    for (x, y) in xs.iter().zip(ys) {
        for lane in 0..ABREAST {
            sums[lane] += x[lane] * y[lane];
        }
    }
    let rest = x_rest.iter().zip(y_rest);
    let rest = rest.fold(T::zero(), |sum, (x, y)| sum + *x * *y);
    (sums[0] + sums[2]) + (sums[1] + sums[3]) + rest
}

/// `out = M^T weights`, `M` row-major with as many rows as there are weights.
pub(super) fn combine<T: Real>(matrix: &[T], weights: &[T], out: &mut [T]) {
    let width = out.len();
    out.fill(T::zero());
    let (fours, rest) = weights.as_chunks::<ABREAST>();
    let (blocks, last) = matrix.split_at(fours.len() * ABREAST * width);
    for (w, block) in fours.iter().zip(blocks.chunks_exact(ABREAST * width)) {
        let (a, rows) = block.split_at(width);
        let (b, rows) = rows.split_at(width);
        let (c, d) = rows.split_at(width);
        for (sum, (((a, b), c), d)) in out.iter_mut().zip(a.iter().zip(b).zip(c).zip(d)) {
            *sum += (w[0] * *a + w[1] * *b) + (w[2] * *c + w[3] * *d);
        }
    }
    for (weight, row) in rest.iter().zip(last.chunks_exact(width)) {
        subtract(out, -*weight, row);
    }
}

/// `out -= scale b`.
#[inline(always)]
pub(super) fn subtract<T: Real>(out: &mut [T], scale: T, b: &[T]) {
    let (outs, out_rest) = out.as_chunks_mut::<ABREAST>();
    let (bs, b_rest) = b.as_chunks::<ABREAST>();
    for (out, b) in outs.iter_mut().zip(bs) {
        for lane in 0..ABREAST {
            out[lane] -= scale * b[lane];
        }
    }
    for (out, b) in out_rest.iter_mut().zip(b_rest) {
        *out -= scale * *b;
    }
}
