//! Dense kernels on column-major blocks: for small fronts, and for the narrow panels of large ones.

use std::array::from_fn;
use std::ops::Range;

use crate::Scalar;
use crate::row::Row;

/// Rows of a tile of [`minus_outer`]: one register of AVX-512.
const TILE_ROWS: usize = 8;
/// Its columns: with eight accumulators or fewer in registers.
const TILE_COLUMNS: usize = 4;
/// Columns of this length or more come from memory, which is faster from four places at once.
const LONG: usize = 160;
/// Partial sums of a scalar product: one register of AVX-512.
pub(super) const LANES: usize = 8;

/// These rows of N columns of a `panel` of `m` rows, from column `p` on. No closure fills the array: it would be a
/// call, without vector instructions.
#[inline(always)]
pub(super) fn take_columns<T, const N: usize>(
    panel: &[T],
    m: usize,
    p: usize,
    rows: Range<usize>,
) -> [&[T]; N] {
    let mut columns: [&[T]; N] = [&[]; N];
    for q in 0..N {
        columns[q] = &panel[(p + q) * m..][rows.start..rows.end];
    }
    columns
}

/// Copies a few numbers, in place of the call that a loop or a copy of any length would become.
#[inline(always)]
pub(super) fn copy_few<R: Copy>(to: &mut [R], from: &[R]) {
    #[inline(always)]
    fn copy<R: Copy, const N: usize>(to: &mut [R], from: &[R], start: &mut usize) {
        if to.len() & N != 0 {
            to[*start..][..N].copy_from_slice(&from[*start..][..N]);
            *start += N;
        }
    }
    if to.len() >= 32 {
        return to.copy_from_slice(from);
    }
    let mut start = 0;
    copy::<R, 16>(to, from, &mut start);
    copy::<R, 8>(to, from, &mut start);
    copy::<R, 4>(to, from, &mut start);
    copy::<R, 2>(to, from, &mut start);
    copy::<R, 1>(to, from, &mut start);
}

/// `y` -= Σ_p x_p a_p for N columns at a time.
#[inline(always)]
fn subtract_columns<T: Scalar, R: Row<T>, const N: usize>(y: &mut [R], a: [&[T]; N], x: [R; N]) {
    let n = y.len();
    let a = a.map(|a| &a[..n]);
    for i in 0..n {
        for p in 0..N {
            y[i] = y[i].minus_product(a[p][i], x[p]);
        }
    }
}

/// −a · b, summed in eight lanes so that it becomes vector instructions.
#[inline(always)]
pub(super) fn minus_dot<T: Scalar, R: Row<T>>(a: &[T], b: &[R]) -> R {
    let mut lanes = [R::zeros(); LANES];
    let (chunks_a, chunks_b) = (a.chunks_exact(LANES), b.chunks_exact(LANES));
    let mut tail = R::zeros();
    // No fold: its closure would be compiled without vector instructions.
    for (&a, &b) in chunks_a.remainder().iter().zip(chunks_b.remainder()) {
        tail = tail.minus_product(a, b);
    }
    for (a, b) in chunks_a.zip(chunks_b) {
        for l in 0..LANES {
            lanes[l] = lanes[l].minus_product(a[l], b[l]);
        }
    }
    sum_lanes(lanes).plus(tail)
}

/// The sum of the lanes.
#[inline(always)]
pub(super) fn sum_lanes<T: Scalar, R: Row<T>>(mut lanes: [R; LANES]) -> R {
    for half in [4, 2, 1] {
        for l in 0..half {
            lanes[l] = lanes[l].plus(lanes[l + half]);
        }
    }
    lanes[0]
}

/// y ← L⁻¹ y for the first k entries of `y`, and `y` -= L y for the rest: `panel` holds k columns of L (unit
/// diagonal), `m` rows each, of which `y` has those from number `first` on.
#[inline(always)]
pub(super) fn solve_lower<T: Scalar, R: Row<T>>(y: &mut [R], panel: &[T], m: usize, first: usize) {
    let k = panel.len() / m;
    let mut p = 0;
    while p + 4 <= k {
        solve_lower_columns::<T, R, 4>(y, panel, m, [first, p]);
        p += 4;
    }
    if p + 2 <= k {
        solve_lower_columns::<T, R, 2>(y, panel, m, [first, p]);
        p += 2;
    }
    if p < k {
        solve_lower_columns::<T, R, 1>(y, panel, m, [first, p]);
    }
}

/// The same for N columns from number `p` on: their own triangle, then all rows below in one sweep.
#[inline(always)]
fn solve_lower_columns<T: Scalar, R: Row<T>, const N: usize>(
    y: &mut [R],
    panel: &[T],
    m: usize,
    [first, p]: [usize; 2],
) {
    let rows = first + p..first + y.len();
    let below = rows.start + N..rows.end;
    let columns = take_columns::<T, N>(panel, m, p, rows);
    let (pivots, y) = y[p..].split_at_mut(N);
    let mut x = [R::zeros(); N];
    x.copy_from_slice(pivots);
    for q in 0..N {
        for i in q + 1..N {
            x[i] = x[i].minus_product(columns[q][i], x[q]);
        }
    }
    pivots.copy_from_slice(&x);
    subtract_columns(y, take_columns::<T, N>(panel, m, p, below), x);
}

/// `y` -= the products of `x` with the columns of a `panel` of `m` rows, of which `y` has those from number
/// `first` on.
#[inline(always)]
pub(super) fn subtract_rows<T: Scalar, R: Row<T>>(
    y: &mut [R],
    panel: &[T],
    m: usize,
    first: usize,
    x: &[R],
) {
    let rows = first..first + y.len();
    let mut p = 0;
    while p + 4 <= x.len() {
        let mut four = [R::zeros(); 4];
        four.copy_from_slice(&x[p..p + 4]);
        subtract_columns(y, take_columns::<T, 4>(panel, m, p, rows.clone()), four);
        p += 4;
    }
    for (p, &x) in x.iter().enumerate().skip(p) {
        subtract_columns(y, take_columns::<T, 1>(panel, m, p, rows.clone()), [x]);
    }
}

/// y ← U⁻¹ y: `panel` holds the columns of U, `m` rows each, with the inverses of the pivots on the
/// diagonal, which count as ones where the diagonal `IS_UNIT`.
#[inline(always)]
pub(super) fn solve_upper<T: Scalar, R: Row<T>, const IS_UNIT: bool>(
    y: &mut [R],
    panel: &[T],
    m: usize,
) {
    let mut p = y.len();
    while p >= 4 {
        p -= 4;
        solve_upper_columns::<T, R, IS_UNIT, 4>(y, panel, m, p);
    }
    if p >= 2 {
        p -= 2;
        solve_upper_columns::<T, R, IS_UNIT, 2>(y, panel, m, p);
    }
    if p == 1 {
        solve_upper_columns::<T, R, IS_UNIT, 1>(y, panel, m, 0);
    }
}

/// The same for N columns from number `p` on.
#[inline(always)]
fn solve_upper_columns<T: Scalar, R: Row<T>, const IS_UNIT: bool, const N: usize>(
    y: &mut [R],
    panel: &[T],
    m: usize,
    p: usize,
) {
    let columns = take_columns::<T, N>(panel, m, p, 0..p + N);
    let (above, pivots) = y[..p + N].split_at_mut(p);
    let mut x = [R::zeros(); N];
    x.copy_from_slice(pivots);
    for q in (0..N).rev() {
        if !IS_UNIT {
            x[q] = x[q].times(columns[q][p + q]);
        }
        for i in 0..q {
            x[i] = x[i].minus_product(columns[q][p + i], x[q]);
        }
    }
    pivots.copy_from_slice(&x);
    subtract_columns(above, columns, x);
}

/// `y` -= the products of the columns of a `panel` of `m` rows, of which the last count, with `x`.
#[inline(always)]
pub(super) fn subtract_products<T: Scalar, R: Row<T>>(y: &mut [R], panel: &[T], m: usize, x: &[R]) {
    let first = m - x.len();
    let mut p = 0;
    while p + 4 <= y.len() && x.len() >= LONG {
        let sums = minus_dots(take_columns::<T, 4>(panel, m, p, first..m), x);
        for q in 0..4 {
            y[p + q] = y[p + q].plus(sums[q]);
        }
        p += 4;
    }
    for p in p..y.len() {
        y[p] = y[p].plus(minus_dot(&panel[p * m..][first..m], x));
    }
}

/// y ← (Lᵀ)⁻¹ y: `panel` holds the columns of L (unit diagonal), `m` rows each, of which the first count.
#[inline(always)]
pub(super) fn solve_transposed<T: Scalar, R: Row<T>>(y: &mut [R], panel: &[T], m: usize) {
    let k = y.len();
    let mut p = k;
    while p >= 4 && k >= LONG {
        p -= 4;
        solve_transposed_columns::<T, R, 4>(y, panel, m, p);
    }
    for p in (0..p).rev() {
        let (pivots, below) = y.split_at_mut(p + 1);
        let column = &panel[p * m..][p + 1..k];
        if column.len() >= LANES {
            pivots[p] = pivots[p].plus(minus_dot(column, below));
        } else {
            for (&entry, &x) in column.iter().zip(&*below) {
                pivots[p] = pivots[p].minus_product(entry, x);
            }
        }
    }
}

/// The same for N columns from number `p` on: all rows below in one sweep, then their own triangle.
#[inline(always)]
fn solve_transposed_columns<T: Scalar, R: Row<T>, const N: usize>(
    y: &mut [R],
    panel: &[T],
    m: usize,
    p: usize,
) {
    let k = y.len();
    let columns = take_columns::<T, N>(panel, m, p, p..p + N);
    let (pivots, below) = y[p..].split_at_mut(N);
    let mut x = minus_dots(take_columns::<T, N>(panel, m, p, p + N..k), below);
    for q in (0..N).rev() {
        x[q] = pivots[q].plus(x[q]);
        for i in q + 1..N {
            x[q] = x[q].minus_product(columns[q][i], x[i]);
        }
    }
    pivots.copy_from_slice(&x);
}

/// −a · b for each of N columns, each summed in eight lanes so that it becomes vector instructions.
#[inline(always)]
fn minus_dots<T: Scalar, R: Row<T>, const N: usize>(a: [&[T]; N], b: &[R]) -> [R; N] {
    let mut lanes = [[R::zeros(); LANES]; N];
    let whole = b.len() / LANES * LANES;
    let mut start = 0;
    while start < whole {
        let b = &b[start..][..LANES];
        for q in 0..N {
            let a = &a[q][start..][..LANES];
            for l in 0..LANES {
                lanes[q][l] = lanes[q][l].minus_product(a[l], b[l]);
            }
        }
        start += LANES;
    }
    let mut sums = [R::zeros(); N];
    for q in 0..N {
        for i in whole..b.len() {
            sums[q] = sums[q].minus_product(a[q][i], b[i]);
        }
        sums[q] = sum_lanes(lanes[q]).plus(sums[q]);
    }
    sums
}

/// Eliminates the columns of a `panel` of `m` rows, the first pivot being in row `first`: L (unit
/// diagonal) and U of the pivots take its place, with the inverses of the pivots on the diagonal.
/// `false` for a pivot that is zero or not finite.
#[inline(always)]
pub(super) fn factor_panel<T: Scalar>(panel: &mut [T], m: usize, first: usize) -> bool {
    for j in 0..panel.len() / m {
        let (left, column) = panel[..(j + 1) * m].split_at_mut(j * m);
        let column = &mut column[first..];
        if j > 0 {
            solve_lower(column, left, m, first);
        }
        let pivot = column[j];
        let inverse = T::one() / pivot;
        if pivot == T::zero() || !num_complex::ComplexFloat::is_finite(inverse) {
            return false;
        }
        column[j] = inverse;
        for entry in &mut column[j + 1..] {
            *entry *= inverse;
        }
    }
    true
}

/// Copies the triangle below the diagonal of the pivots of a symmetric `panel`, the first in row
/// `first`, above it.
#[inline(always)]
pub(super) fn mirror<T: Scalar>(panel: &mut [T], m: usize, first: usize) {
    for j in 1..panel.len() / m {
        for i in 0..j {
            panel[j * m + first + i] = panel[i * m + first + j];
        }
    }
}

/// U right of the pivots of a symmetric front, transposed: the rows of L from row `start` on times D,
/// `r` rows for each pivot. The first column of `panel` has its pivot in row `first`.
#[inline(always)]
pub(super) fn scale_rows<T: Scalar>(
    upper: &mut [T],
    r: usize,
    panel: &[T],
    m: usize,
    [first, start]: [usize; 2],
) {
    for (p, scaled) in upper.chunks_exact_mut(r).enumerate() {
        let column = &panel[p * m..][..m];
        let pivot = T::one() / column[first + p];
        for (scaled, &entry) in scaled.iter_mut().zip(&column[start..]) {
            *scaled = entry * pivot;
        }
    }
}

/// U right of the pivots from the rows of the matrix: both are kept transposed, `r` rows for each
/// of the pivots, whose L the `panel` of `m` rows holds.
#[inline(always)]
pub(super) fn eliminate_rows<T: Scalar>(upper: &mut [T], r: usize, panel: &[T], m: usize) {
    for j in 1..upper.len() / r {
        let (done, row) = upper[..(j + 1) * r].split_at_mut(j * r);
        let row = &mut row[..r];
        subtract_first(row, j, |p| (&done[p * r..], panel[p * m + j]));
    }
}

/// `y` -= Σ_p x_p a_p for p < n, with `column` giving a_p and x_p.
#[inline(always)]
pub(super) fn subtract_first<'a, T: Scalar>(
    y: &mut [T],
    n: usize,
    column: impl Fn(usize) -> (&'a [T], T),
) {
    let mut p = 0;
    while p + 4 <= n {
        let four: [_; 4] = from_fn(|q| column(p + q));
        subtract_columns::<T, T, 4>(y, four.map(|(a, _)| a), four.map(|(_, x)| x));
        p += 4;
    }
    for p in p..n {
        let (a, x) = column(p);
        subtract_columns(y, [a], [x]);
    }
}

/// The rows and columns of a block of an update, and the distances of columns in the factors of the product.
#[derive(Debug, Clone, Copy)]
pub(super) struct Block {
    pub(super) rows: usize,
    pub(super) columns: usize,
    /// Of A.
    pub(super) stride_a: usize,
    /// Of B.
    pub(super) stride_b: usize,
    /// Whether only the triangle below the diagonal from the first entry on is needed.
    pub(super) is_symmetric: bool,
}

/// `s` ← -A Bᵀ for `n` columns of A and B.
#[inline(always)]
pub(super) fn minus_outer<T: Scalar>(s: &mut [T], block: Block, a: &[T], b: &[T], n: usize) {
    let Block { rows, columns, .. } = block;
    if rows < TILE_ROWS || columns < TILE_COLUMNS {
        s.fill(T::zero());
        for (j, column) in s.chunks_exact_mut(rows).enumerate() {
            for p in 0..n {
                let (a, b) = (&a[p * block.stride_a..], b[p * block.stride_b + j]);
                subtract_columns(column, [a], [b]);
            }
        }
        return;
    }
    // The last tiles reach back over ones that are done.
    for j in (0..columns).step_by(TILE_COLUMNS) {
        let column = j.min(columns - TILE_COLUMNS);
        let mut i = match block.is_symmetric {
            true => column - column % TILE_ROWS,
            false => 0,
        };
        while i + 2 * TILE_ROWS <= rows {
            outer_tile::<T, { 2 * TILE_ROWS }>(s, block, a, b, n, [i, column]);
            i += 2 * TILE_ROWS;
        }
        while i < rows {
            outer_tile::<T, TILE_ROWS>(s, block, a, b, n, [i.min(rows - TILE_ROWS), column]);
            i += TILE_ROWS;
        }
    }
}

/// [`minus_outer`] for `ROWS` rows of [`TILE_COLUMNS`] columns, from this place on.
#[inline(always)]
fn outer_tile<T: Scalar, const ROWS: usize>(
    s: &mut [T],
    block: Block,
    a: &[T],
    b: &[T],
    n: usize,
    [row, column]: [usize; 2],
) {
    let mut tile = [[T::zero(); ROWS]; TILE_COLUMNS];
    for p in 0..n {
        let a = &a[p * block.stride_a + row..][..ROWS];
        let b = &b[p * block.stride_b + column..][..TILE_COLUMNS];
        for c in 0..TILE_COLUMNS {
            for t in 0..ROWS {
                tile[c][t] = tile[c][t].plus_product(a[t], b[c]);
            }
        }
    }
    for (c, tile) in tile.iter().enumerate() {
        let target = &mut s[(column + c) * block.rows + row..][..ROWS];
        for t in 0..ROWS {
            target[t] = -tile[t];
        }
    }
}
