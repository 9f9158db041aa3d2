//! Solves with fronts of two columns, which are the displacements of one node. Most fronts of a plane body have this
//! form. Their few rows are loaded from the right-hand side into registers and stored back directly. Wider fronts first
//! gather their rows in memory, and the processor must wait when it reads a vector whose elements have just been
//! written individually.

use super::analysis::Supernode;
use super::small::{LANES, sum_lanes, take_columns};
use crate::Number;
use crate::row::Row;

/// Number of columns.
const N: usize = 2;

/// Front of two columns and its position in the right-hand side.
#[derive(Debug, Clone, Copy)]
pub(super) struct NarrowFront<'a, T> {
    first: usize,
    /// Columns of the front, one after the other. In each column, the pivot rows come first, followed by `rows`.
    panel: &'a [T],
    rows: &'a [u32],
}

impl<'a, T: Number> NarrowFront<'a, T> {
    /// Returns the front of `node` if it has two columns and if a row of the right-hand side is one real number. Wider
    /// rows would not be faster.
    #[inline(always)]
    pub(super) fn of<R: Row<T>>(node: &'a Supernode, factors: &'a [T]) -> Option<Self> {
        let is_narrow = T::IS_REAL && size_of::<R>() == size_of::<T>() && node.n_columns() == N;
        is_narrow.then(|| Self {
            first: node.shape.columns.start,
            panel: &factors[node.start..][..N * node.size()],
            rows: &node.shape.rows,
        })
    }

    /// Computes x ← L⁻¹ x for the unknowns of this front, and updates the rows below.
    #[inline(always)]
    pub(super) fn lower<R: Row<T>>(&self, x: &mut [R]) {
        let pivots = &mut x[self.first..][..N];
        pivots[1] = pivots[1].minus_product(self.panel[1], pivots[0]);
        let own = [pivots[0], pivots[1]];
        let (n, mut start) = (self.rows.len(), 0);
        while start + LANES <= n {
            self.scatter::<R, LANES>(x, own, &mut start);
        }
        if n & 4 != 0 {
            self.scatter::<R, 4>(x, own, &mut start);
        }
        if n & 2 != 0 {
            self.scatter::<R, 2>(x, own, &mut start);
        }
        if n & 1 != 0 {
            self.scatter::<R, 1>(x, own, &mut start);
        }
    }

    /// Computes x ← (D Lᵀ)⁻¹ x for the unknowns of this front. The diagonal stores the inverse of D.
    #[inline(always)]
    pub(super) fn scaled_upper<R: Row<T>>(&self, x: &mut [R]) {
        let sums = self.gather_all(x, self.below());
        let [first, second] = self.inverses();
        let x = &mut x[self.first..][..N];
        x[1] = x[1].times(second).plus(sums[1]);
        x[0] = x[0].times(first).plus(sums[0]).minus_product(self.panel[1], x[1]);
    }

    /// Computes x ← U⁻¹ x for the unknowns of this front. `upper` contains the rows of U to the right of the pivots,
    /// one after the other.
    #[inline(always)]
    pub(super) fn upper<R: Row<T>>(&self, x: &mut [R], upper: &[T]) {
        let sums = self.gather_all(x, take_columns(upper, self.rows.len(), 0, 0..self.rows.len()));
        let [first, second] = self.inverses();
        let x = &mut x[self.first..][..N];
        x[1] = x[1].plus(sums[1]).times(second);
        let entry = self.panel[N + self.rows.len()];
        x[0] = x[0].plus(sums[0]).minus_product(entry, x[1]).times(first);
    }

    /// Returns the inverse pivots.
    #[inline(always)]
    fn inverses(&self) -> [T; N] {
        [self.panel[0], self.panel[N + self.rows.len() + 1]]
    }

    /// Returns the entries of L below the pivots.
    #[inline(always)]
    fn below(&self) -> [&'a [T]; N] {
        let m = N + self.rows.len();
        take_columns(self.panel, m, 0, N..m)
    }

    /// Subtracts the product of the factor and `own` from the next `L` rows of `x`, beginning at `start`, and advances
    /// `start`.
    #[inline(always)]
    fn scatter<R: Row<T>, const L: usize>(&self, x: &mut [R], own: [R; N], start: &mut usize) {
        let (rows, columns) = self.next::<L>(self.below(), start);
        let mut update = [R::zeros(); L];
        for p in 0..N {
            for l in 0..L {
                update[l] = update[l].minus_product(columns[p][l], own[p]);
            }
        }
        for l in 0..L {
            let x = &mut x[rows[l] as usize];
            *x = x.plus(update[l]);
        }
    }

    /// Returns the negative products of `columns` with the entries of `x` in the rows of the front.
    #[inline(always)]
    fn gather_all<R: Row<T>>(&self, x: &[R], columns: [&[T]; N]) -> [R; N] {
        let (n, mut start) = (self.rows.len(), 0);
        let mut lanes = [[R::zeros(); LANES]; N];
        while start + LANES <= n {
            self.gather::<R, LANES>(x, columns, &mut lanes, &mut start);
        }
        if n & 4 != 0 {
            self.gather::<R, 4>(x, columns, &mut lanes, &mut start);
        }
        if n & 2 != 0 {
            self.gather::<R, 2>(x, columns, &mut lanes, &mut start);
        }
        if n & 1 != 0 {
            self.gather::<R, 1>(x, columns, &mut lanes, &mut start);
        }
        [sum_lanes(lanes[0]), sum_lanes(lanes[1])]
    }

    /// Subtracts the products for the next `L` rows from `lanes`, and advances `start`.
    #[inline(always)]
    fn gather<R: Row<T>, const L: usize>(
        &self,
        x: &[R],
        columns: [&[T]; N],
        lanes: &mut [[R; LANES]; N],
        start: &mut usize,
    ) {
        let (rows, columns) = self.next::<L>(columns, start);
        let mut right = [R::zeros(); L];
        for l in 0..L {
            right[l] = x[rows[l] as usize];
        }
        for p in 0..N {
            for l in 0..L {
                lanes[p][l] = lanes[p][l].minus_product(columns[p][l], right[l]);
            }
        }
    }

    /// Returns the next `L` rows and the corresponding entries of `columns`, and advances `start`.
    #[inline(always)]
    fn next<'c, const L: usize>(
        &self,
        columns: [&'c [T]; N],
        start: &mut usize,
    ) -> (&'a [u32], [&'c [T]; N]) {
        let rows = *start..*start + L;
        *start = rows.end;
        let [first, second] = columns;
        (&self.rows[rows.clone()], [&first[rows.clone()], &second[rows]])
    }
}
