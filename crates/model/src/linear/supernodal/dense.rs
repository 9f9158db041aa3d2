//! Dense kernels on column-major blocks.

use crate::linear::Number;

/// Rows of a tile of [`subtract_outer`]: one register of AVX-512.
const TILE_ROWS: usize = 8;
/// Its columns: with eight accumulators or fewer in registers.
const TILE_COLUMNS: usize = 4;

/// `y` -= Σ_p x_p a_p for four columns at a time.
#[inline(always)]
fn subtract_four<T: Number>(y: &mut [T], a: [&[T]; 4], x: [T; 4]) {
    let n = y.len();
    let (a0, a1, a2, a3) = (&a[0][..n], &a[1][..n], &a[2][..n], &a[3][..n]);
    let (x0, x1, x2, x3) = (-x[0], -x[1], -x[2], -x[3]);
    for i in 0..n {
        let first = y[i].plus_product(a0[i], x0).plus_product(a1[i], x1);
        y[i] = first.plus_product(a2[i], x2).plus_product(a3[i], x3);
    }
}

/// `y` -= x a.
#[inline(always)]
pub(super) fn subtract<T: Number>(y: &mut [T], a: &[T], x: T) {
    for (y, &a) in y.iter_mut().zip(a) {
        *y = y.plus_product(a, -x);
    }
}

/// `y` -= A x for column-major A with columns `stride` apart.
#[inline(always)]
fn subtract_product<T: Number>(y: &mut [T], a: &[T], stride: usize, x: &[T]) {
    let column = |p: usize| &a[p * stride..];
    let mut p = 0;
    while p + 4 <= x.len() {
        let columns = [column(p), column(p + 1), column(p + 2), column(p + 3)];
        subtract_four(y, columns, [x[p], x[p + 1], x[p + 2], x[p + 3]]);
        p += 4;
    }
    while p < x.len() {
        subtract(y, column(p), x[p]);
        p += 1;
    }
}

/// a · b, summed in eight lanes so that it becomes vector instructions.
#[inline(always)]
pub(super) fn dot<T: Number>(a: &[T], b: &[T]) -> T {
    let mut lanes = [T::zero(); 8];
    let (chunks_a, chunks_b) = (a.chunks_exact(8), b.chunks_exact(8));
    let tail = chunks_a.remainder().iter().zip(chunks_b.remainder());
    let tail = tail.fold(T::zero(), |sum, (&a, &b)| sum.plus_product(a, b));
    for (a, b) in chunks_a.zip(chunks_b) {
        for l in 0..8 {
            lanes[l] = lanes[l].plus_product(a[l], b[l]);
        }
    }
    lanes.iter().fold(tail, |sum, &lane| sum + lane)
}

/// y ← L⁻¹ y for the first k entries of `y`, and `y` -= L y for the rest: `panel` holds the columns
/// of L (unit diagonal), `y.len()` rows each.
#[inline(always)]
pub(super) fn solve_lower<T: Number>(y: &mut [T], panel: &[T]) {
    let m = y.len();
    let k = panel.len() / m;
    let mut p = 0;
    while p < k {
        // Four pivots at a time: their own triangle first, then all rows below in one sweep.
        let width = (k - p).min(4);
        for q in p..p + width {
            let x = -y[q];
            let column = &panel[q * m..][..m];
            for i in q + 1..p + width {
                y[i] = y[i].plus_product(column[i], x);
            }
        }
        let (solved, below) = y.split_at_mut(p + width);
        subtract_product(below, &panel[p * m + p + width..], m, &solved[p..]);
        p += width;
    }
}

/// Eliminates the columns of a `panel` of `m` rows: L (unit diagonal) and U of the pivots take its
/// place. `false` for a pivot that is zero or not finite.
#[inline(always)]
pub(super) fn factor_panel<T: Number>(panel: &mut [T], m: usize) -> bool {
    for j in 0..panel.len() / m {
        let (left, column) = panel[..(j + 1) * m].split_at_mut(j * m);
        if j > 0 {
            solve_lower(column, left);
        }
        let pivot = column[j];
        let inverse = T::one() / pivot;
        if pivot == T::zero() || !num_complex::ComplexFloat::is_finite(inverse) {
            return false;
        }
        for entry in &mut column[j + 1..] {
            *entry = *entry * inverse;
        }
    }
    true
}

/// U right of the pivots from the rows of the matrix: both are kept transposed, `r` rows for each
/// of the pivots, whose L the `panel` of `m` rows holds.
#[inline(always)]
pub(super) fn eliminate_rows<T: Number>(upper: &mut [T], r: usize, panel: &[T], m: usize) {
    for j in 1..upper.len() / r {
        let (done, row) = upper[..(j + 1) * r].split_at_mut(j * r);
        let mut p = 0;
        let factor = |p: usize| panel[p * m + j];
        let u = |p: usize| &done[p * r..][..r];
        while p + 4 <= j {
            let x = [factor(p), factor(p + 1), factor(p + 2), factor(p + 3)];
            subtract_four(row, [u(p), u(p + 1), u(p + 2), u(p + 3)], x);
            p += 4;
        }
        while p < j {
            subtract(row, u(p), factor(p));
            p += 1;
        }
    }
}

/// `s` -= A Bᵀ for the `r` × `r` block `s`; A has columns `stride` apart, B is `r` × k.
#[inline(always)]
pub(super) fn subtract_outer<T: Number>(s: &mut [T], r: usize, a: &[T], stride: usize, b: &[T]) {
    if r < TILE_ROWS {
        for (j, column) in s.chunks_exact_mut(r).enumerate() {
            for (p, b) in b.chunks_exact(r).enumerate() {
                subtract(column, &a[p * stride..][..r], b[j]);
            }
        }
        return;
    }
    let k = b.len() / r;
    let mut j = 0;
    while j < r {
        // The last tiles reach back over ones that are done, and write what is new only.
        let column = j.min(r - TILE_COLUMNS);
        let mut i = 0;
        while i < r {
            let row = i.min(r - TILE_ROWS);
            let mut tile = [[T::zero(); TILE_ROWS]; TILE_COLUMNS];
            for p in 0..k {
                let a = &a[p * stride + row..][..TILE_ROWS];
                let b = &b[p * r + column..][..TILE_COLUMNS];
                for c in 0..TILE_COLUMNS {
                    for t in 0..TILE_ROWS {
                        tile[c][t] = tile[c][t].plus_product(a[t], b[c]);
                    }
                }
            }
            for c in j - column..TILE_COLUMNS {
                let target = &mut s[(column + c) * r + row..][..TILE_ROWS];
                if i == row {
                    for t in 0..TILE_ROWS {
                        target[t] -= tile[c][t];
                    }
                } else {
                    for t in i - row..TILE_ROWS {
                        target[t] -= tile[c][t];
                    }
                }
            }
            i += TILE_ROWS;
        }
        j += TILE_COLUMNS;
    }
}
