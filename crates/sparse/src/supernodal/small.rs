//! Dense kernels on column-major blocks, for small fronts and for the narrow panels of large fronts.

use std::array::from_fn;
use std::ops::Range;

use crate::Number;
use crate::row::Row;

/// Number of rows of a tile of [`minus_outer`]: one AVX-512 register.
const TILE_ROWS: usize = 8;
/// Number of columns of a tile. Their sums use at most eight AVX-512 registers, or 16 for complex numbers.
const TILE_COLUMNS: usize = 4;
/// Minimum length of columns whose scalar products are computed four at a time. Columns of this length are usually read
/// from memory, which is faster with four concurrent streams.
const LONG: usize = 160;
/// Number of partial sums of a scalar product: one AVX-512 register.
pub(super) const LANES: usize = 8;

/// Returns the given `rows` of N columns of a `panel` with `m` rows, starting at column `p`. Do not fill the array by a
/// closure: its call would not use vector instructions.
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

/// Copies a few scalars without a function call. A loop or a copy of variable length would be compiled to a call.
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

/// Computes `y` -= Σ_p x_p a_p for N columns at once.
#[inline(always)]
fn subtract_columns<T: Number, R: Row<T>, const N: usize>(y: &mut [R], a: [&[T]; N], x: [R; N]) {
    let n = y.len();
    let a = a.map(|a| &a[..n]);
    for i in 0..n {
        for p in 0..N {
            y[i] = y[i].minus_product(a[p][i], x[p]);
        }
    }
}

/// Returns −a · b, summed in eight lanes to allow vector instructions.
#[inline(always)]
pub(super) fn minus_dot<T: Number, R: Row<T>>(a: &[T], b: &[R]) -> R {
    let mut lanes = [R::zeros(); LANES];
    let (chunks_a, chunks_b) = (a.chunks_exact(LANES), b.chunks_exact(LANES));
    let mut tail = R::zeros();
    // Do not use a fold: its closure would be compiled without vector instructions.
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

#[inline(always)]
pub(super) fn sum_lanes<T: Number, R: Row<T>>(mut lanes: [R; LANES]) -> R {
    for half in [4, 2, 1] {
        for l in 0..half {
            lanes[l] = lanes[l].plus(lanes[l + half]);
        }
    }
    lanes[0]
}

/// Computes y ← L⁻¹ y for the first k entries of `y`, and `y` -= L y for the other entries. `panel` contains k columns
/// of L (with a unit diagonal) with `m` rows each. `y` contains the rows from `first` onward.
#[inline(always)]
pub(super) fn solve_lower<T: Number, R: Row<T>>(y: &mut [R], panel: &[T], m: usize, first: usize) {
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

/// Solves with N columns from column `p` onward: first with their triangle, then with all rows below in one sweep.
#[inline(always)]
fn solve_lower_columns<T: Number, R: Row<T>, const N: usize>(
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

/// Subtracts the products of `x` with the columns of a `panel` with `m` rows. `y` contains the rows from `first`
/// onward.
#[inline(always)]
pub(super) fn subtract_rows<T: Number, R: Row<T>>(
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

/// Computes y ← U⁻¹ y. `panel` contains the columns of U with `m` rows each. The diagonal contains the inverse pivots,
/// which are replaced by ones if `IS_UNIT`.
#[inline(always)]
pub(super) fn solve_upper<T: Number, R: Row<T>, const IS_UNIT: bool>(
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

/// Solves with N columns from column `p` onward.
#[inline(always)]
fn solve_upper_columns<T: Number, R: Row<T>, const IS_UNIT: bool, const N: usize>(
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

/// Subtracts the products of `x` with the last rows of the columns of a `panel` with `m` rows.
#[inline(always)]
pub(super) fn subtract_products<T: Number, R: Row<T>>(y: &mut [R], panel: &[T], m: usize, x: &[R]) {
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

/// Computes y ← (Lᵀ)⁻¹ y. `panel` contains the columns of L (with a unit diagonal) with `m` rows each. Only its first
/// `y.len()` rows and columns are used.
#[inline(always)]
pub(super) fn solve_transposed<T: Number, R: Row<T>>(y: &mut [R], panel: &[T], m: usize) {
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

/// Solves for N entries of `y` from entry `p` onward: first subtracts the products of the N columns with all entries
/// below in one sweep, then solves with the triangle of these columns.
#[inline(always)]
fn solve_transposed_columns<T: Number, R: Row<T>, const N: usize>(
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

/// Returns −a · b for each of N columns a, summed in eight lanes to allow vector instructions.
#[inline(always)]
fn minus_dots<T: Number, R: Row<T>, const N: usize>(a: [&[T]; N], b: &[R]) -> [R; N] {
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

/// Eliminates the columns of a `panel` with `m` rows, whose first pivot is in row `first`. L (with a unit diagonal) and
/// the U of the pivots overwrite the panel; the diagonal contains the inverse pivots. Returns `false` if a pivot is
/// zero or not finite.
#[inline(always)]
pub(super) fn factor_panel<T: Number>(panel: &mut [T], m: usize, first: usize) -> bool {
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

/// Copies the lower triangle of the pivots of a symmetric `panel` to the upper triangle. The first pivot is in row
/// `first`.
#[inline(always)]
pub(super) fn mirror<T: Number>(panel: &mut [T], m: usize, first: usize) {
    for j in 1..panel.len() / m {
        for i in 0..j {
            panel[j * m + first + i] = panel[i * m + first + j];
        }
    }
}

/// Computes the part of U to the right of the pivots of a symmetric front. Its transpose is stored with `r` entries for
/// each pivot: the rows of L from `start` onward, multiplied by D. The pivot of the first column of `panel` is in row
/// `first`.
#[inline(always)]
pub(super) fn scale_rows<T: Number>(
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

/// Computes U to the right of the pivots from the rows of the matrix. The rows and U are stored transposed, with `r`
/// entries for each pivot. `panel` has `m` rows and contains L of the pivots.
#[inline(always)]
pub(super) fn eliminate_rows<T: Number>(upper: &mut [T], r: usize, panel: &[T], m: usize) {
    for j in 1..upper.len() / r {
        let (done, row) = upper[..(j + 1) * r].split_at_mut(j * r);
        let row = &mut row[..r];
        subtract_first(row, j, |p| (&done[p * r..], panel[p * m + j]));
    }
}

/// Computes `y` -= Σ_p x_p a_p for p < n; `column` returns a_p and x_p.
#[inline(always)]
pub(super) fn subtract_first<'a, T: Number>(
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

/// Size of a block of an update, and the column strides of its two factors A and B.
#[derive(Debug, Clone, Copy)]
pub(super) struct Block {
    pub(super) rows: usize,
    pub(super) columns: usize,
    pub(super) stride_a: usize,
    pub(super) stride_b: usize,
    /// Whether only the lower triangle, which starts at the first entry, is needed.
    pub(super) is_symmetric: bool,
}

/// Computes `s` ← −A Bᵀ for `n` columns of A and B.
#[inline(always)]
pub(super) fn minus_outer<T: Number>(s: &mut [T], block: Block, a: &[T], b: &[T], n: usize) {
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
    // The last tiles may overlap earlier tiles.
    for j in (0..columns).step_by(TILE_COLUMNS) {
        let column = j.min(columns - TILE_COLUMNS);
        let mut i = match block.is_symmetric {
            true => column - column % TILE_ROWS,
            false => 0,
        };
        while T::IS_REAL && i + 2 * TILE_ROWS <= rows {
            outer_tile::<T, { 2 * TILE_ROWS }>(s, block, a, b, n, [i, column]);
            i += 2 * TILE_ROWS;
        }
        while i < rows {
            outer_tile::<T, TILE_ROWS>(s, block, a, b, n, [i.min(rows - TILE_ROWS), column]);
            i += TILE_ROWS;
        }
    }
}

/// Computes [`minus_outer`] for `ROWS` rows and [`TILE_COLUMNS`] columns from the given position onward. The products
/// with the real and imaginary parts of B are summed separately, so that no complex vector is rearranged within the
/// loop.
#[inline(always)]
fn outer_tile<T: Number, const ROWS: usize>(
    s: &mut [T],
    block: Block,
    a: &[T],
    b: &[T],
    n: usize,
    [row, column]: [usize; 2],
) {
    let mut with_re = [[T::zero(); ROWS]; TILE_COLUMNS];
    let mut with_im = [[T::zero(); ROWS]; TILE_COLUMNS];
    for p in 0..n {
        let a = &a[p * block.stride_a + row..][..ROWS];
        let b = &b[p * block.stride_b + column..][..TILE_COLUMNS];
        for c in 0..TILE_COLUMNS {
            for t in 0..ROWS {
                with_re[c][t] = with_re[c][t].plus_real_product(a[t], b[c].re());
            }
            if !T::IS_REAL {
                for t in 0..ROWS {
                    with_im[c][t] = with_im[c][t].plus_real_product(a[t], b[c].im());
                }
            }
        }
    }
    for c in 0..TILE_COLUMNS {
        let target = &mut s[(column + c) * block.rows + row..][..ROWS];
        for t in 0..ROWS {
            target[t] = -T::of_sums(with_re[c][t], with_im[c][t]);
        }
    }
}
