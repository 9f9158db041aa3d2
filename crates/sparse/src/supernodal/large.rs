//! Dense kernels for large fronts: recursion down to narrow panels, with products by faer.
//!
//! The partition of a front does not depend on the number of threads, and each part is computed by one thread.
//! Therefore, results are bitwise reproducible.

use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::solve_unit_lower_triangular_in_place;
use faer::reborrow::{IntoConst, Reborrow, ReborrowMut};
use faer::{Accum, MatMut, MatRef, Par};
use pulp::{Arch, Simd, WithSimd};
use rayon::iter::{IndexedParallelIterator, IntoParallelIterator, ParallelIterator};
use rayon::slice::ParallelSliceMut;

use super::analysis::Supernode;
use super::child::Child;
use super::small::{factor_panel, mirror, scale_rows, subtract_first};
use super::update::{CHUNK, Layout, chunk_width};
use crate::Kind;
use crate::Number;

/// Maximum width of panels eliminated column by column.
const NARROW: usize = 32;
/// Number of rows of a narrow panel eliminated together. They fit in the first-level cache.
const SHORT: usize = 128;
/// Maximum number of rows of a product computed by one thread.
const LONG: usize = 512;
/// The number of rows of a part is a multiple of this number.
const STRIPE: usize = 48;
/// Number of terms of a product that are summed at once. More terms would not stay in the cache.
const DEEP: usize = 64;

/// Dimensions of a front, and options for its elimination.
#[derive(Debug, Clone, Copy)]
pub(super) struct Front {
    /// Number of rows.
    pub(super) m: usize,
    /// Number of columns eliminated.
    pub(super) k: usize,
    pub(super) kind: Kind,
    /// Whether the work is shared among the threads of the pool.
    pub(super) in_threads: bool,
    pub(super) arch: Arch,
}

impl Front {
    /// Fills the `block` of `node` with its matrix entries and with the contributions of its children to its pivots.
    /// Returns the columns and, unless the matrix is symmetric, the rows.
    #[inline(never)]
    pub(super) fn assemble<'b, 'c, T: Number>(
        &self,
        node: &Supernode,
        block: &'b mut [T],
        values: &[T],
        of_child: &(impl Fn(&Child) -> &'c [T] + Sync),
    ) -> (&'b mut [T], &'b mut [T]) {
        let Self { m, k, kind, .. } = *self;
        self.chunks(block, m, |_, chunk| chunk.fill(T::zero()));
        for &(index, position) in &node.entries {
            block[position as usize] = values[index as usize];
        }
        let (panel, upper) = block.split_at_mut(m * k);
        self.chunks(panel, m, |start, chunk| {
            for child in &node.children {
                child.add_to_columns(of_child(child), chunk, start, [m, k], kind);
            }
        });
        if !upper.is_empty() {
            self.chunks(upper, m - k, |start, chunk| {
                for child in &node.children {
                    child.add_to_rows(of_child(child), chunk, start, [m - k, k]);
                }
            });
        }
        (panel, upper)
    }

    /// Eliminates an assembled front. L and U overwrite `panel` and `upper`. `update` is set to −L U plus the
    /// contributions that `add` adds to its columns. Returns `false` if a pivot is zero or not finite.
    #[inline(never)]
    pub(super) fn eliminate_all<T: Number>(
        &self,
        panel: &mut [T],
        upper: &mut [T],
        update: &mut [T],
        add: &(impl Fn(usize, &mut [T]) + Sync),
    ) -> bool {
        if !self.factor(panel, 0) {
            return false;
        }
        if self.m > self.k {
            self.factor_upper(upper, panel);
            self.update(update, panel, upper, add);
        }
        true
    }

    /// Eliminates the columns in `panel`, which starts with column `first` of the front. L, U and the inverse pivots
    /// overwrite the panel. Returns `false` if a pivot is zero or not finite.
    fn factor<T: Number>(&self, panel: &mut [T], first: usize) -> bool {
        let (m, width) = (self.m, panel.len() / self.m);
        if width <= NARROW {
            return self.factor_narrow(panel, first);
        }
        let multiple = if width > 2 * CHUNK { CHUNK } else { NARROW };
        let half = (width / 2).next_multiple_of(multiple);
        let (left, right) = panel.split_at_mut(half * m);
        if !self.factor(left, first) {
            return false;
        }
        let middle = first + half;
        self.chunks(right, m, |start, chunk| self.eliminate(left, first, chunk, middle + start));
        self.factor(right, middle)
    }

    /// Eliminates a few columns: first the square block of their pivots, then the rows below it.
    fn factor_narrow<T: Number>(&self, panel: &mut [T], first: usize) -> bool {
        let (m, width) = (self.m, panel.len() / self.m);
        let mut workspace = [T::zero(); NARROW * NARROW];
        let pivots = &mut workspace[..width * width];
        for (own, column) in pivots.chunks_exact_mut(width).zip(panel.chunks_exact(m)) {
            own.copy_from_slice(&column[first..][..width]);
        }
        let is_symmetric = self.kind == Kind::Symmetric;
        if !self.arch.dispatch(Square { pivots, width, is_symmetric }) {
            return false;
        }
        for (own, column) in pivots.chunks_exact(width).zip(panel.chunks_exact_mut(m)) {
            column[first..][..width].copy_from_slice(own);
        }
        let below = MatMut::from_column_major_slice_mut(panel, m, width);
        let below = below.get_mut(first + width.., ..);
        self.rows(below, SHORT, &|_, rows| {
            self.arch.dispatch(Below { rows, pivots });
        });
        true
    }

    /// Eliminates the columns in `left`, which start at column `first` of the front, from the columns in `chunk`, which
    /// start at column `column` of the front.
    fn eliminate<T: Number>(&self, left: &[T], first: usize, chunk: &mut [T], column: usize) {
        let m = self.m;
        let (half, width) = (left.len() / m, chunk.len() / m);
        let left = MatRef::from_column_major_slice(left, m, half);
        let chunk = MatMut::from_column_major_slice_mut(chunk, m, width);
        let (mut upper, lower) = chunk.get_mut(first.., ..).split_at_row_mut(half);
        let start = match self.kind {
            Kind::General => {
                solve_unit_lower(left.get(first..first + half, ..), upper.rb_mut());
                first + half
            }
            Kind::Symmetric => {
                for p in 0..half {
                    let pivot = T::one() / left[(first + p, p)];
                    for j in 0..width {
                        upper[(p, j)] = left[(column + j, p)] * pivot;
                    }
                }
                column
            }
        };
        let target = lower.get_mut(start - first - half.., ..);
        self.rows(target, LONG, &|above, target| {
            let lower = left.get(start + above..start + above + target.nrows(), ..);
            subtract_product(target, Accum::Add, lower, upper.rb());
        });
    }

    /// Computes U to the right of the pivots, and stores its transpose in `upper`. For a symmetric matrix, U follows
    /// from `panel`; otherwise `upper` initially contains the transposed rows of the matrix.
    fn factor_upper<T: Number>(&self, upper: &mut [T], panel: &[T]) {
        let (m, k) = (self.m, self.k);
        let r = m - k;
        if self.kind == Kind::Symmetric {
            return self.chunks(upper, r, |first, chunk| {
                scale_rows(chunk, r, &panel[first * m..], m, [first, k]);
            });
        }
        let triangle = MatRef::from_column_major_slice(panel, m, k).get(..k, ..);
        let rows = MatMut::from_column_major_slice_mut(upper, r, k);
        self.rows(rows, chunk_width(self.kind), &|_, rows| {
            solve_unit_lower(triangle, rows.transpose_mut());
        });
    }

    /// Computes `update` ← −L U for the rows and columns beyond the pivots. Calls `add` with each chunk and its first
    /// column.
    fn update<T: Number>(
        &self,
        update: &mut [T],
        panel: &[T],
        upper: &[T],
        add: impl Fn(usize, &mut [T]) + Sync,
    ) {
        let (m, k) = (self.m, self.k);
        let layout = Layout { r: m - k, kind: self.kind };
        let r = layout.r;
        let lower = MatRef::from_column_major_slice(panel, m, k).get(k.., ..);
        let upper = MatRef::from_column_major_slice(upper, r, k);
        let work = |(first, chunk): (usize, &mut [T])| {
            let row = layout.first_row(first);
            let width = chunk.len() / (r - row);
            let upper = upper.get(first..first + width, ..).transpose();
            let target = MatMut::from_column_major_slice_mut(&mut *chunk, r - row, width);
            self.rows(target, LONG, &|above, target| {
                let lower = lower.get(row + above..row + above + target.nrows(), ..);
                subtract_product(target, Accum::Replace, lower, upper);
            });
            add(first, chunk);
        };
        if self.in_threads {
            let chunks: Vec<_> = layout.chunks(update).collect();
            chunks.into_par_iter().with_max_len(1).for_each(work);
        } else {
            layout.chunks(update).for_each(work);
        }
    }

    /// Splits a block of `rows` rows into chunks of columns and calls `work` with each chunk and its first column.
    fn chunks<T: Number>(
        &self,
        block: &mut [T],
        rows: usize,
        work: impl Fn(usize, &mut [T]) + Sync,
    ) {
        let width = chunk_width(self.kind);
        let size = width * rows;
        if self.in_threads {
            let chunks = block.par_chunks_mut(size).enumerate().with_max_len(1);
            chunks.for_each(|(i, chunk)| work(i * width, chunk));
        } else {
            let chunks = block.chunks_mut(size).enumerate();
            chunks.for_each(|(i, chunk)| work(i * width, chunk));
        }
    }

    /// Splits `block` into parts of at most `size` rows and calls `work` with each part and the number of rows above
    /// it.
    fn rows<'m, T: Number>(
        &self,
        block: MatMut<'m, T>,
        size: usize,
        work: &(impl Fn(usize, MatMut<'m, T>) + Sync),
    ) {
        self.rows_from(0, block, size, work);
    }

    fn rows_from<'m, T: Number>(
        &self,
        above: usize,
        block: MatMut<'m, T>,
        size: usize,
        work: &(impl Fn(usize, MatMut<'m, T>) + Sync),
    ) {
        let n = block.nrows();
        if n <= size {
            return work(above, block);
        }
        let half = (n / 2).next_multiple_of(STRIPE);
        let (upper, lower) = block.split_at_row_mut(half);
        let halves = (
            || self.rows_from(above, upper, size, work),
            || self.rows_from(above + half, lower, size, work),
        );
        if self.in_threads {
            rayon::join(halves.0, halves.1);
        } else {
            (halves.0)();
            (halves.1)();
        }
    }
}

/// Computes `target` ← −L U or, with [`Accum::Add`], `target` ← `target` − L U.
fn subtract_product<T: Number>(
    mut target: MatMut<'_, T>,
    first: Accum,
    lower: MatRef<'_, T>,
    upper: MatRef<'_, T>,
) {
    let (depth, width) = upper.shape();
    let mut workspace = vec![T::zero(); depth.min(DEEP) * width];
    let mut accum = first;
    for start in (0..depth).step_by(DEEP) {
        let terms = start..depth.min(start + DEEP);
        let upper = side_by_side(&mut workspace, upper.get(terms.clone(), ..));
        let (target, lower) = (target.rb_mut(), lower.get(.., terms));
        matmul(target, accum, lower, upper, -T::one(), Par::Seq);
        accum = Accum::Add;
    }
}

/// Computes `x` ← L⁻¹ `x` for a unit lower triangular L.
fn solve_unit_lower<T: Number>(lower: MatRef<'_, T>, mut x: MatMut<'_, T>) {
    let (n, width) = x.shape();
    let mut workspace = vec![T::zero(); n.min(DEEP) * width];
    for start in (0..n).step_by(DEEP) {
        let end = n.min(start + DEEP);
        let (done, mut below) = x.rb_mut().split_at_row_mut(end);
        let mut done = done.get_mut(start.., ..);
        let triangle = lower.get(start..end, start..end);
        solve_unit_lower_triangular_in_place(triangle, done.rb_mut(), Par::Seq);
        let done = side_by_side(&mut workspace, done.rb());
        for above in (end..n).step_by(LONG) {
            let rows = above..n.min(above + LONG);
            let target = below.rb_mut().get_mut(above - end..rows.end - end, ..);
            let lower = lower.get(rows, start..end);
            matmul(target, Accum::Add, lower, done, -T::one(), Par::Seq);
        }
    }
}

/// Copies `rows` of U to `workspace`. In a front, consecutive entries of a row are far apart, each in a separate page.
fn side_by_side<'a, T: Number>(workspace: &'a mut [T], rows: MatRef<'_, T>) -> MatRef<'a, T> {
    let (n, width) = rows.shape();
    let mut copy = MatMut::from_row_major_slice_mut(&mut workspace[..n * width], n, width);
    copy.copy_from(rows);
    copy.into_const()
}

/// Elimination of the pivots of a narrow panel with vector instructions.
struct Square<'a, T> {
    pivots: &'a mut [T],
    width: usize,
    is_symmetric: bool,
}

impl<T: Number> WithSimd for Square<'_, T> {
    type Output = bool;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> bool {
        if self.is_symmetric {
            mirror(self.pivots, self.width, 0);
        }
        factor_panel(self.pivots, self.width, 0)
    }
}

/// Elimination of the rows below the pivots of a narrow panel with vector instructions.
struct Below<'a, T> {
    rows: MatMut<'a, T>,
    pivots: &'a [T],
}

impl<T: Number> WithSimd for Below<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let width = self.rows.ncols();
        let columns = self.rows.col_iter_mut().map(|column| {
            let column = column.try_as_col_major_mut();
            column.expect("fronts are kept column by column").as_slice_mut()
        });
        let mut columns: Vec<&mut [T]> = columns.collect();
        for (j, pivots) in self.pivots.chunks_exact(width).enumerate() {
            let (done, rest) = columns.split_at_mut(j);
            let column = &mut *rest[0];
            subtract_first(column, j, |p| (&*done[p], pivots[p]));
            for entry in column {
                *entry *= pivots[j];
            }
        }
    }
}
