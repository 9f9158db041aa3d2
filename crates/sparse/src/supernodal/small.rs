//! Dense kernels on column-major blocks: for small fronts, and for the narrow panels of large ones.

use crate::number::{Number, Row};

/// Rows of a tile of [`minus_outer`]: one register of AVX-512.
const TILE_ROWS: usize = 8;
/// Its columns: with eight accumulators or fewer in registers.
const TILE_COLUMNS: usize = 4;
/// `y` -= Σ_p x_p a_p for N columns at a time.
#[inline(always)]
pub(super) fn subtract_columns<T: Number, R: Row<T>, const N: usize>(
    y: &mut [R],
    a: [&[T]; N],
    x: [R; N],
) {
    let n = y.len();
    let a = from_row(a, 0, n);
    for i in 0..n {
        for p in 0..N {
            y[i] = y[i].less_product(a[p][i], x[p]);
        }
    }
}

/// `n` rows of `columns` from row `first` on. Here and below a loop, as the functions of arrays are calls that
/// are not inlined.
#[inline(always)]
pub(super) fn from_row<T, const N: usize>(columns: [&[T]; N], first: usize, n: usize) -> [&[T]; N] {
    let mut rows: [&[T]; N] = [&[]; N];
    for q in 0..N {
        rows[q] = &columns[q][first..][..n];
    }
    rows
}

/// Rows `first` to `end` of N columns of a `panel` of `m` rows, from number `p` on.
#[inline(always)]
pub(super) fn columns_of<T, const N: usize>(
    panel: &[T],
    m: usize,
    p: usize,
    [first, end]: [usize; 2],
) -> [&[T]; N] {
    let mut columns: [&[T]; N] = [&[]; N];
    for q in 0..N {
        columns[q] = &panel[(p + q) * m..][first..end];
    }
    columns
}

/// The N numbers of `y`.
#[inline(always)]
pub(super) fn numbers<R: Copy, const N: usize>(y: &[R]) -> [R; N] {
    *y.first_chunk().expect("as many numbers as columns")
}

/// y ← L⁻¹ y for the first k entries of `y`, and `y` -= L y for the rest: `panel` holds the columns
/// of L (unit diagonal), `m` rows each, of which the last `y.len()` count.
#[inline(always)]
pub(super) fn solve_lower<T: Number, R: Row<T>>(y: &mut [R], panel: &[T], m: usize) {
    let k = panel.len() / m;
    let mut p = 0;
    while p + 4 <= k {
        solve_lower_columns::<T, R, 4>(y, panel, m, p);
        p += 4;
    }
    if p + 2 <= k {
        solve_lower_columns::<T, R, 2>(y, panel, m, p);
        p += 2;
    }
    if p < k {
        solve_lower_columns::<T, R, 1>(y, panel, m, p);
    }
}

/// The same for N columns from number `p` on: their own triangle, then all rows below in one sweep.
#[inline(always)]
fn solve_lower_columns<T: Number, R: Row<T>, const N: usize>(
    y: &mut [R],
    panel: &[T],
    m: usize,
    p: usize,
) {
    let first = m - y.len() + p;
    let columns = columns_of::<T, N>(panel, m, p, [first, m]);
    let (pivots, below) = y[p..].split_at_mut(N);
    let x = solve_triangle(pivots, columns);
    subtract_columns(below, from_row(columns, N, below.len()), x);
}

/// x = L⁻¹ `y` for the N columns of L, the diagonal first, in the place of `y`.
#[inline(always)]
pub(super) fn solve_triangle<T: Number, R: Row<T>, const N: usize>(
    y: &mut [R],
    columns: [&[T]; N],
) -> [R; N] {
    let mut x: [R; N] = numbers(y);
    for q in 0..N {
        for i in q + 1..N {
            x[i] = x[i].less_product(columns[q][i], x[q]);
        }
    }
    y.copy_from_slice(&x);
    x
}

/// Eliminates the columns of a `panel` of `m` rows, the first pivot being in row `first`: L (unit
/// diagonal) and U of the pivots take its place, with the inverses of the pivots on the diagonal.
/// `false` for a pivot that is zero or not finite.
#[inline(always)]
pub(super) fn factor_panel<T: Number>(panel: &mut [T], m: usize, first: usize) -> bool {
    for j in 0..panel.len() / m {
        let (left, column) = panel[..(j + 1) * m].split_at_mut(j * m);
        let column = &mut column[first..];
        if j > 0 {
            solve_lower(column, left, m);
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
pub(super) fn mirror<T: Number>(panel: &mut [T], m: usize, first: usize) {
    for j in 1..panel.len() / m {
        for i in 0..j {
            panel[j * m + first + i] = panel[i * m + first + j];
        }
    }
}

/// U right of the pivots of a symmetric front, transposed: the rows of L from row `start` on times D,
/// `r` rows for each pivot. The first column of `panel` has its pivot in row `first`.
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

/// U right of the pivots from the rows of the matrix: both are kept transposed, `r` rows for each
/// of the pivots, whose L the `panel` of `m` rows holds.
#[inline(always)]
pub(super) fn eliminate_rows<T: Number>(upper: &mut [T], r: usize, panel: &[T], m: usize) {
    for j in 1..upper.len() / r {
        let (done, row) = upper[..(j + 1) * r].split_at_mut(j * r);
        let row = &mut row[..r];
        subtract_first(row, j, |p| (&done[p * r..], panel[p * m + j]));
    }
}

/// `y` -= Σ_p x_p a_p for p < n, with `column` giving a_p and x_p.
#[inline(always)]
pub(super) fn subtract_first<'a, T: Number>(
    y: &mut [T],
    n: usize,
    column: impl Fn(usize) -> (&'a [T], T),
) {
    let mut p = 0;
    while p + 4 <= n {
        let (mut a, mut x): ([&[T]; 4], _) = ([&[]; 4], [T::zero(); 4]);
        for q in 0..4 {
            (a[q], x[q]) = column(p + q);
        }
        subtract_columns(y, a, x);
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
fn outer_tile<T: Number, const ROWS: usize>(
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
