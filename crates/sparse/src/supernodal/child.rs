//! Assembly of the update of a supernode into the front of its parent.

use std::ops::Range;

use super::update::Layout;
use crate::Kind;
use crate::Number;

/// Positions of the rows of a supernode among the columns and rows of its parent.
#[derive(Debug, Clone)]
pub(super) struct Child {
    /// Index of the child supernode.
    pub(super) node: u32,
    /// Positions in the parent, in ascending order.
    places: Vec<u32>,
    /// Number of positions among the columns of the parent.
    n_columns: usize,
    /// Runs of consecutive positions among the columns of the parent.
    column_runs: Vec<Run>,
    /// Runs of consecutive positions among the rows of the parent, relative to its first row.
    row_runs: Vec<Run>,
}

/// Rows of a child that are consecutive both in the child and in its parent.
#[derive(Debug, Clone, Copy)]
struct Run {
    /// First index in the child.
    from: u32,
    /// First index in the parent.
    to: u32,
    len: u32,
}

impl Child {
    /// Creates a child from its `places` in the parent. Places below `k` are columns of the parent.
    pub(super) fn new(node: u32, places: Vec<u32>, k: usize) -> Self {
        let n_columns = places.partition_point(|&place| (place as usize) < k);
        Self {
            node,
            column_runs: runs(&places[..n_columns], 0, 0),
            row_runs: runs(&places[n_columns..], n_columns, k),
            places,
            n_columns,
        }
    }

    /// Returns the storage layout of the update of the child.
    #[inline(always)]
    pub(super) fn layout(&self, kind: Kind) -> Layout {
        let r = self.places.len();
        Layout { r, kind }
    }

    /// Returns the heap size in bytes.
    pub(super) fn n_bytes(&self) -> usize {
        let n_runs = self.column_runs.len() + self.row_runs.len();
        size_of_val(&self.places[..]) + n_runs * size_of::<Run>()
    }

    /// Returns the columns of the child that correspond to the columns `start..end` of the parent, which has `k`
    /// columns.
    #[inline(always)]
    fn columns(&self, start: usize, end: usize, k: usize) -> Range<usize> {
        let place = |column: usize| match column {
            0 => 0,
            column if column == k => self.n_columns,
            column => self.places.partition_point(|&p| (p as usize) < column),
        };
        place(start)..place(end)
    }

    /// Adds the child's `update` to columns of the parent, which has `m` rows and `k` pivots. `chunk` contains the
    /// columns of the parent from `start` onward.
    #[inline(always)]
    pub(super) fn add_to_columns<T: Number>(
        &self,
        update: &[T],
        chunk: &mut [T],
        start: usize,
        [m, k]: [usize; 2],
        kind: Kind,
    ) {
        let layout = self.layout(kind);
        for j in self.columns(start, start + chunk.len() / m, k) {
            let update = layout.column(update, j);
            let column = self.places[j] as usize - start;
            let (pivots, rows) = chunk[column * m..][..m].split_at_mut(k);
            let first = if kind == Kind::Symmetric { j } else { 0 };
            add_runs(&self.column_runs, update, pivots, first);
            add_runs(&self.row_runs, update, rows, 0);
        }
    }

    /// Adds the child's `update` to the `r` columns to the right of the `k` pivots. `chunk` contains the pivot rows of
    /// the parent from `start` onward, transposed. For unsymmetric matrices only.
    #[inline(always)]
    pub(super) fn add_to_rows<T: Number>(
        &self,
        update: &[T],
        chunk: &mut [T],
        start: usize,
        [r, k]: [usize; 2],
    ) {
        let layout = self.layout(Kind::General);
        let own = self.columns(start, start + chunk.len() / r, k);
        let beyond = &self.places[self.n_columns..];
        for (j, &column) in (self.n_columns..).zip(beyond) {
            let (update, _) = layout.column(update, j);
            let column = column as usize - k;
            for (&row, &update) in self.places[own.clone()].iter().zip(&update[own.clone()]) {
                chunk[(row as usize - start) * r + column] += update;
            }
        }
    }

    /// Adds the remaining part of the child's `update` to the update of the parent, which has `k` pivots. `chunk`
    /// contains the parent's update from column `start` onward, stored in `layout`.
    #[inline(always)]
    pub(super) fn add_to_update<T: Number>(
        &self,
        update: &[T],
        chunk: &mut [T],
        start: usize,
        layout: Layout,
        k: usize,
    ) {
        let above = layout.first_row(start);
        let rows = layout.r - above;
        let end = start + chunk.len() / rows;
        let own = self.layout(layout.kind);
        let first = self.places.partition_point(|&p| (p as usize) < k + start);
        for (j, &place) in (first..).zip(&self.places[first..]) {
            let column = place as usize - k;
            if column >= end {
                break;
            }
            let first = if layout.kind == Kind::Symmetric { j } else { 0 };
            let chunk = &mut chunk[(column - start) * rows..][..rows];
            add_runs_below(&self.row_runs, own.column(update, j), chunk, first, above);
        }
    }
}

/// Returns the runs of consecutive `places`. `first` is the index of the first place in the child. Positions in the
/// parent are relative to `origin`.
fn runs(places: &[u32], first: usize, origin: usize) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::new();
    for (i, &place) in (first as u32..).zip(places) {
        let to = place - origin as u32;
        match runs.last_mut() {
            Some(run) if run.to + run.len == to => run.len += 1,
            _ => runs.push(Run { from: i, to, len: 1 }),
        }
    }
    runs
}

/// Adds the entries of `update` from row `first` onward to their positions in `target`. The number paired with the
/// update is the index of its first stored row.
#[inline(always)]
fn add_runs<T: Number>(runs: &[Run], update: (&[T], usize), target: &mut [T], first: usize) {
    add_runs_below(runs, update, target, first, 0);
}

/// Adds the entries of `update`, as [`add_runs`] does, to a target that starts at row `above`.
#[inline(always)]
fn add_runs_below<T: Number>(
    runs: &[Run],
    (update, row): (&[T], usize),
    target: &mut [T],
    first: usize,
    above: usize,
) {
    let done = match first {
        0 => 0,
        _ => runs.partition_point(|run| (run.from + run.len) as usize <= first),
    };
    for run in &runs[done..] {
        let (from, to, len) = (run.from as usize, run.to as usize, run.len as usize);
        let skipped = first.saturating_sub(from);
        let (from, to, len) = (from + skipped - row, to + skipped - above, len - skipped);
        for (target, &update) in target[to..to + len].iter_mut().zip(&update[from..from + len]) {
            *target += update;
        }
    }
}
