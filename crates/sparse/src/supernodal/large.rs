//! Dense kernels on large fronts: recursion down to narrow panels, products by faer.
//!
//! A front is cut the same way for any number of threads, and each cut is computed by one: results
//! are equal to the bit.

use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::solve_unit_lower_triangular_in_place;
use faer::reborrow::{Reborrow, ReborrowMut};
use faer::{Accum, MatMut, MatRef, Par};
use pulp::{Arch, Simd, WithSimd};
use rayon::iter::{IndexedParallelIterator, IntoParallelIterator, ParallelIterator};
use rayon::slice::ParallelSliceMut;

use super::small::{factor_panel, mirror, scale_rows};
use super::update::{CHUNK, Layout};
use crate::{Kind, Number};

/// Panels of this width are eliminated column by column.
const NARROW: usize = 32;

/// The sizes of a front and how it is dealt with.
#[derive(Debug, Clone, Copy)]
pub(super) struct Front {
    /// Rows.
    pub(super) m: usize,
    /// Columns that are eliminated.
    pub(super) k: usize,
    pub(super) kind: Kind,
    /// Whether to share the work among the threads of the pool.
    pub(super) in_threads: bool,
    pub(super) arch: Arch,
}

impl Front {
    /// Eliminates an assembled front: L and U take the place of `panel` and `upper`, `update` becomes
    /// -L U, with what `add` adds to its columns. `false` for a pivot that is zero or not finite.
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

    /// Eliminates the columns from number `first` on that `panel` holds: L, U and the inverses of
    /// the pivots take its place. `false` for a pivot that is zero or not finite.
    fn factor<T: Number>(&self, panel: &mut [T], first: usize) -> bool {
        let (m, width) = (self.m, panel.len() / self.m);
        if width <= NARROW {
            let is_symmetric = self.kind == Kind::Symmetric;
            return self.arch.dispatch(Narrow {
                panel,
                m,
                first,
                is_symmetric,
            });
        }
        let multiple = if width > 2 * CHUNK { CHUNK } else { NARROW };
        let half = (width / 2).next_multiple_of(multiple);
        let (left, right) = panel.split_at_mut(half * m);
        if !self.factor(left, first) {
            return false;
        }
        let middle = first + half;
        self.chunks(right, m, |start, chunk| {
            self.eliminate(left, first, chunk, middle + start)
        });
        self.factor(right, middle)
    }

    /// Eliminates the columns `left`, the first of which is number `first`, from those of `chunk`,
    /// the first of which is number `column`.
    fn eliminate<T: Number>(&self, left: &[T], first: usize, chunk: &mut [T], column: usize) {
        let m = self.m;
        let (half, width) = (left.len() / m, chunk.len() / m);
        let left = MatRef::from_column_major_slice(left, m, half);
        let chunk = MatMut::from_column_major_slice_mut(chunk, m, width);
        let (mut upper, mut lower) = chunk.get_mut(first.., ..).split_at_row_mut(half);
        let start = match self.kind {
            Kind::General => {
                let triangle = left.get(first..first + half, ..);
                solve_unit_lower_triangular_in_place(triangle, upper.rb_mut(), Par::Seq);
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
        let target = lower.rb_mut().get_mut(start - first - half.., ..);
        subtract_product(target, left.get(start.., ..), upper.rb());
    }

    /// U right of the pivots from the rows of the matrix, or of the `panel` if it is symmetric; both are
    /// kept transposed in `upper`.
    fn factor_upper<T: Number>(&self, upper: &mut [T], panel: &[T]) {
        let (m, k) = (self.m, self.k);
        let r = m - k;
        if self.kind == Kind::Symmetric {
            return scale_rows(upper, r, panel, m, k);
        }
        let triangle = MatRef::from_column_major_slice(panel, m, k).get(..k, ..);
        let rows = MatMut::from_column_major_slice_mut(upper, r, k);
        self.solve_rows(triangle, rows);
    }

    fn solve_rows<T: Number>(&self, triangle: MatRef<'_, T>, rows: MatMut<'_, T>) {
        let r = rows.nrows();
        if r <= CHUNK {
            solve_unit_lower_triangular_in_place(triangle, rows.transpose_mut(), Par::Seq);
            return;
        }
        let (above, below) = rows.split_at_row_mut((r / 2).next_multiple_of(CHUNK / 2));
        let halves = (
            || self.solve_rows(triangle, above),
            || self.solve_rows(triangle, below),
        );
        if self.in_threads {
            rayon::join(halves.0, halves.1);
        } else {
            (halves.0)();
            (halves.1)();
        }
    }

    /// `update` ← -L U for the rows and columns beyond the pivots, column by column followed by
    /// `add`, which is told the first column of those it gets.
    fn update<T: Number>(
        &self,
        update: &mut [T],
        panel: &[T],
        upper: &[T],
        add: impl Fn(usize, &mut [T]) + Sync,
    ) {
        let (m, k) = (self.m, self.k);
        let layout = Layout {
            r: m - k,
            kind: self.kind,
        };
        let r = layout.r;
        let lower = MatRef::from_column_major_slice(panel, m, k).get(k.., ..);
        let upper = MatRef::from_column_major_slice(upper, r, k);
        let work = |(first, chunk): (usize, &mut [T])| {
            let row = layout.first_row(first);
            let width = chunk.len() / (r - row);
            matmul(
                MatMut::from_column_major_slice_mut(&mut *chunk, r - row, width),
                Accum::Replace,
                lower.get(row.., ..),
                upper.get(first..first + width, ..).transpose(),
                -T::one(),
                Par::Seq,
            );
            add(first, chunk);
        };
        if self.in_threads {
            let chunks: Vec<_> = layout.chunks(update).collect();
            chunks.into_par_iter().for_each(work);
        } else {
            layout.chunks(update).for_each(work);
        }
    }

    /// Cuts a block of `rows` rows into chunks of columns, each worked on with its first column.
    fn chunks<T: Number>(
        &self,
        block: &mut [T],
        rows: usize,
        work: impl Fn(usize, &mut [T]) + Sync,
    ) {
        let size = CHUNK * rows;
        if self.in_threads {
            let chunks = block.par_chunks_mut(size).enumerate();
            chunks.for_each(|(i, chunk)| work(i * CHUNK, chunk));
        } else {
            let chunks = block.chunks_mut(size).enumerate();
            chunks.for_each(|(i, chunk)| work(i * CHUNK, chunk));
        }
    }
}

/// `target` -= A B.
fn subtract_product<T: Number>(target: MatMut<'_, T>, a: MatRef<'_, T>, b: MatRef<'_, T>) {
    matmul(target, Accum::Add, a, b, -T::one(), Par::Seq);
}

/// The elimination of a narrow panel, to be run with the processor's vector instructions.
struct Narrow<'a, T> {
    panel: &'a mut [T],
    m: usize,
    first: usize,
    is_symmetric: bool,
}

impl<T: Number> WithSimd for Narrow<'_, T> {
    type Output = bool;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> bool {
        if self.is_symmetric {
            mirror(self.panel, self.m, self.first);
        }
        factor_panel(self.panel, self.m, self.first)
    }
}
