//! Dense kernels on column-major fronts.

use crate::linear::Number;

/// `y` -= Σ_p x_p a_p for four columns at a time.
#[inline(always)]
fn subtract_four<T: Number>(y: &mut [T], a: [&[T]; 4], x: [T; 4]) {
    let n = y.len();
    let [a0, a1, a2, a3] = a.map(|column| &column[..n]);
    for i in 0..n {
        y[i] -= (a0[i] * x[0] + a1[i] * x[1]) + (a2[i] * x[2] + a3[i] * x[3]);
    }
}

/// `y` -= x a.
#[inline(always)]
pub(super) fn subtract<T: Number>(y: &mut [T], a: &[T], x: T) {
    for (y, &a) in y.iter_mut().zip(a) {
        *y -= a * x;
    }
}

/// `y` -= A x for column-major A with `y.len()` rows.
#[inline(always)]
pub(super) fn subtract_product<T: Number>(y: &mut [T], a: &[T], x: &[T]) {
    let n = y.len();
    if n == 0 {
        return;
    }
    let mut columns = a.chunks_exact(4 * n);
    let mut xs = x.chunks_exact(4);
    for (block, x) in columns.by_ref().zip(xs.by_ref()) {
        let (a0, rest) = block.split_at(n);
        let (a1, rest) = rest.split_at(n);
        let (a2, a3) = rest.split_at(n);
        subtract_four(y, [a0, a1, a2, a3], [x[0], x[1], x[2], x[3]]);
    }
    for (column, &x) in columns.remainder().chunks_exact(n).zip(xs.remainder()) {
        subtract(y, column, x);
    }
}

/// a · b, summed in eight lanes so that it becomes vector instructions.
#[inline(always)]
pub(super) fn dot<T: Number>(a: &[T], b: &[T]) -> T {
    let mut lanes = [T::zero(); 8];
    let (chunks_a, chunks_b) = (a.chunks_exact(8), b.chunks_exact(8));
    let tail = chunks_a.remainder().iter().zip(chunks_b.remainder());
    let tail = tail.fold(T::zero(), |sum, (&a, &b)| sum + a * b);
    for (a, b) in chunks_a.zip(chunks_b) {
        for l in 0..8 {
            lanes[l] += a[l] * b[l];
        }
    }
    lanes.iter().fold(tail, |sum, &lane| sum + lane)
}

/// Eliminates the first `k` of `m` columns of a front: L (unit diagonal) and U take the place of
/// its first columns and rows, the rest is updated. `false` for a pivot that is zero or not finite.
#[inline(always)]
pub(super) fn eliminate<T: Number>(front: &mut [T], m: usize, k: usize) -> bool {
    for j in 0..m {
        let (left, column) = front[..(j + 1) * m].split_at_mut(j * m);
        // Four pivots at a time: their own triangle first, then all rows below in one sweep.
        let end = j.min(k);
        let mut p = 0;
        while p < end {
            let width = (end - p).min(4);
            for q in p..p + width {
                let x = column[q];
                let lower = &left[q * m..(q + 1) * m];
                for i in q + 1..p + width {
                    column[i] -= lower[i] * x;
                }
            }
            let (solved, below) = column.split_at_mut(p + width);
            let lower = |q: usize| &left[q * m + p + width..(q + 1) * m];
            if width == 4 {
                let x = [solved[p], solved[p + 1], solved[p + 2], solved[p + 3]];
                subtract_four(
                    below,
                    [lower(p), lower(p + 1), lower(p + 2), lower(p + 3)],
                    x,
                );
            } else {
                for (q, &x) in solved.iter().enumerate().skip(p) {
                    subtract(below, lower(q), x);
                }
            }
            p += width;
        }
        if j < k {
            let pivot = column[j];
            let inverse = T::one() / pivot;
            if pivot == T::zero() || !num_complex::ComplexFloat::is_finite(inverse) {
                return false;
            }
            for entry in &mut column[j + 1..] {
                *entry = *entry * inverse;
            }
        }
    }
    true
}
