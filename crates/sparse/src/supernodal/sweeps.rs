//! Solves with the triangles of one front.

use super::small::{columns_of, from_row, numbers, solve_lower, solve_triangle, subtract_columns};
use crate::number::{Number, Row};

/// Columns of this length or more come from memory, which is faster from four places at once.
const LONG: usize = 160;
/// Partial sums of a scalar product: one register of AVX-512.
const LANES: usize = 8;
/// How far [chunks](solve_lower_in_chunks) reach.
pub(super) const BEYOND: usize = LANES - 1;

/// −a · b, summed in eight lanes so that it becomes vector instructions.
#[inline(always)]
pub(super) fn minus_dot<T: Number, R: Row<T>>(a: &[T], b: &[R]) -> R {
    minus_dots([a], b)[0]
}

/// [`solve_lower`] for all `m` rows and `k` columns of a `panel`, in whole chunks of rows, which reach up to
/// [`BEYOND`] numbers behind a column and behind the `m` numbers of `y`: there stands nothing that counts.
/// A rest that is no chunk, row by row, would be half of the instructions of a small front.
#[inline(always)]
pub(super) fn solve_lower_in_chunks<T: Number, R: Row<T>>(
    y: &mut [R],
    panel: &[T],
    [m, k]: [usize; 2],
) {
    if size_of::<R>() > size_of::<T>() {
        // A row fills the registers.
        return solve_lower(&mut y[..m], &panel[..m * k], m);
    }
    let mut p = 0;
    while p + 4 <= k {
        lower_columns_in_chunks::<T, R, 4>(y, panel, m, p);
        p += 4;
    }
    if p + 2 <= k {
        lower_columns_in_chunks::<T, R, 2>(y, panel, m, p);
        p += 2;
    }
    if p < k {
        lower_columns_in_chunks::<T, R, 1>(y, panel, m, p);
    }
}

/// The same for N columns from number `p` on.
#[inline(always)]
fn lower_columns_in_chunks<T: Number, R: Row<T>, const N: usize>(
    y: &mut [R],
    panel: &[T],
    m: usize,
    p: usize,
) {
    let columns = columns_of::<T, N>(panel, m, p, [p, m + BEYOND]);
    let (pivots, below) = y[p..].split_at_mut(N);
    let x = solve_triangle(pivots, columns);
    let n = (m - p - N).div_ceil(LANES);
    let y = &mut below.as_chunks_mut::<LANES>().0[..n];
    let mut a: [&[[T; LANES]]; N] = [&[]; N];
    for q in 0..N {
        a[q] = &columns[q][N..].as_chunks().0[..n];
    }
    for i in 0..n {
        let mut sum = y[i];
        for q in 0..N {
            let a = a[q][i];
            for l in 0..LANES {
                sum[l] = sum[l].less_product(a[l], x[q]);
            }
        }
        y[i] = sum;
    }
}

/// y ← U⁻¹ y: `panel` holds the columns of U, `m` rows each, with the inverses of the pivots on the
/// diagonal.
#[inline(always)]
pub(super) fn solve_upper<T: Number, R: Row<T>>(y: &mut [R], panel: &[T], m: usize) {
    let mut p = y.len();
    while p >= 4 {
        p -= 4;
        solve_upper_columns::<T, R, 4>(y, panel, m, p);
    }
    if p >= 2 {
        p -= 2;
        solve_upper_columns::<T, R, 2>(y, panel, m, p);
    }
    if p == 1 {
        solve_upper_columns::<T, R, 1>(y, panel, m, 0);
    }
}

/// The same for N columns from number `p` on.
#[inline(always)]
fn solve_upper_columns<T: Number, R: Row<T>, const N: usize>(
    y: &mut [R],
    panel: &[T],
    m: usize,
    p: usize,
) {
    let columns = columns_of::<T, N>(panel, m, p, [0, p + N]);
    let (above, pivots) = y[..p + N].split_at_mut(p);
    let mut x: [R; N] = numbers(pivots);
    for q in (0..N).rev() {
        x[q] = x[q].times(columns[q][p + q]);
        for i in 0..q {
            x[i] = x[i].less_product(columns[q][p + i], x[q]);
        }
    }
    pivots.copy_from_slice(&x);
    subtract_columns(above, columns, x);
}

/// y ← (Lᵀ)⁻¹ y for the first k entries of `y`, the rest being known: `panel` holds the columns of L
/// (unit diagonal), `y.len()` rows each.
#[inline(always)]
pub(super) fn solve_transposed<T: Number, R: Row<T>>(y: &mut [R], panel: &[T]) {
    let m = y.len();
    let mut p = panel.len() / m;
    while p >= 4 && m >= LONG {
        p -= 4;
        solve_transposed_columns::<T, R, 4>(y, panel, p);
    }
    for (p, column) in panel.chunks_exact(m).enumerate().take(p).rev() {
        let (pivots, below) = y.split_at_mut(p + 1);
        pivots[p] = pivots[p].plus(minus_dot(&column[p + 1..], below));
    }
}

/// The same for N columns from number `p` on: all rows below in one sweep, then their own triangle.
#[inline(always)]
fn solve_transposed_columns<T: Number, R: Row<T>, const N: usize>(
    y: &mut [R],
    panel: &[T],
    p: usize,
) {
    let m = y.len();
    let columns = columns_of::<T, N>(panel, m, p, [p, m]);
    let (pivots, below) = y[p..].split_at_mut(N);
    let sums = minus_dots(from_row(columns, N, below.len()), below);
    let mut x: [R; N] = numbers(pivots);
    for q in (0..N).rev() {
        x[q] = x[q].plus(sums[q]);
        for i in q + 1..N {
            x[q] = x[q].less_product(columns[q][i], x[i]);
        }
    }
    pivots.copy_from_slice(&x);
}

/// `y` += −Aᵀ `b` for the columns of A, `b.len()` rows each.
#[inline(always)]
pub(super) fn subtract_products<T: Number, R: Row<T>>(y: &mut [R], a: &[T], b: &[R]) {
    let r = b.len();
    let mut p = 0;
    while p + 4 <= y.len() {
        let sums = minus_dots(columns_of::<T, 4>(a, r, p, [0, r]), b);
        for q in 0..4 {
            y[p + q] = y[p + q].plus(sums[q]);
        }
        p += 4;
    }
    for p in p..y.len() {
        y[p] = y[p].plus(minus_dot(&a[p * r..][..r], b));
    }
}

/// −a · b for each of N columns, each summed in eight lanes so that it becomes vector instructions.
#[inline(always)]
fn minus_dots<T: Number, R: Row<T>, const N: usize>(a: [&[T]; N], b: &[R]) -> [R; N] {
    let mut lanes = [[R::none(); LANES]; N];
    let (chunks, rest) = b.as_chunks::<LANES>();
    let n = chunks.len();
    let mut of_a: [&[[T; LANES]]; N] = [&[]; N];
    for q in 0..N {
        of_a[q] = &a[q].as_chunks().0[..n];
    }
    for i in 0..n {
        for q in 0..N {
            let (a, b) = (of_a[q][i], chunks[i]);
            for l in 0..LANES {
                lanes[q][l] = lanes[q][l].less_product(a[l], b[l]);
            }
        }
    }
    let mut sums = [R::none(); N];
    for q in 0..N {
        for (&a, &b) in a[q].as_chunks::<LANES>().1.iter().zip(rest) {
            sums[q] = sums[q].less_product(a, b);
        }
        for half in [4, 2, 1] {
            for l in 0..half {
                lanes[q][l] = lanes[q][l].plus(lanes[q][l + half]);
            }
        }
        sums[q] = lanes[q][0].plus(sums[q]);
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::super::small::solve_lower;
    use super::{BEYOND, minus_dot, solve_lower_in_chunks, subtract_products};

    /// Numbers between -1 and 1 that do not repeat for long.
    fn numbers(n: usize, seed: usize) -> Vec<f64> {
        let number = |i| ((i + seed) * 7919 % 1013) as f64 / 506.0 - 1.0;
        (0..n).map(number).collect()
    }

    #[test]
    fn several_columns_and_chunks_give_the_same_bits_as_one_by_one() {
        for m in 1..40 {
            for k in 1..=m.min(12) {
                // What follows the last column must not count.
                let panel = numbers(m * k + BEYOND, m);
                let y = numbers(m, k);
                let mut by_rows = y.clone();
                solve_lower(&mut by_rows, &panel[..m * k], m);
                let mut in_chunks = y.clone();
                in_chunks.extend(numbers(BEYOND, 3));
                solve_lower_in_chunks(&mut in_chunks, &panel, [m, k]);
                assert_eq!(in_chunks[..m], by_rows[..], "{m} rows, {k} columns");

                let mut sums = vec![1.0; k];
                subtract_products(&mut sums, &panel[..m * k], &y);
                let one_by_one = panel.chunks_exact(m).take(k);
                let one_by_one: Vec<f64> = one_by_one.map(|a| 1.0 + minus_dot(a, &y)).collect();
                assert_eq!(sums, one_by_one, "{m} rows, {k} columns");
            }
        }
    }
}
