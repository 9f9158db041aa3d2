//! Where the update of a supernode goes in the front of its parent.

use std::ops::Range;

use super::update::Layout;
use crate::Kind;
use crate::Scalar;

/// The places of a supernode's rows among the columns and rows of its parent.
#[derive(Debug, Clone)]
pub(super) struct Child {
    /// Which supernode.
    pub(super) node: u32,
    /// The places, ascending.
    places: Vec<u32>,
    /// How many of these are columns.
    n_columns: usize,
    /// The places that are columns, as few runs of neighbours.
    column_runs: Vec<Run>,
    /// The places that are rows, likewise, counted from the first row of the parent.
    row_runs: Vec<Run>,
}

/// Neighbours in a child's rows that are neighbours in its parent's, too.
#[derive(Debug, Clone, Copy)]
struct Run {
    /// The first of them in the child.
    from: u32,
    /// The first of them in the parent.
    to: u32,
    len: u32,
}

impl Child {
    /// Supernode `node` with these `places`, of which all below `k` are columns of the parent.
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

    /// How its update is kept.
    #[inline(always)]
    pub(super) fn layout(&self, kind: Kind) -> Layout {
        let r = self.places.len();
        Layout { r, kind }
    }

    /// Bytes on the heap.
    pub(super) fn n_bytes(&self) -> usize {
        let n_runs = self.column_runs.len() + self.row_runs.len();
        size_of_val(&self.places[..]) + n_runs * size_of::<Run>()
    }

    /// Which of its columns are among those of the parent from number `start` to `end`, of `k`.
    #[inline(always)]
    fn columns(&self, start: usize, end: usize, k: usize) -> Range<usize> {
        let place = |column: usize| match column {
            0 => 0,
            column if column == k => self.n_columns,
            column => self.places.partition_point(|&p| (p as usize) < column),
        };
        place(start)..place(end)
    }

    /// Adds the `update` of this child to columns of its parent, which has `m` rows and `k` pivots: to
    /// those that `chunk` holds, from number `start` on.
    #[inline(always)]
    pub(super) fn add_to_columns<T: Scalar>(
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

    /// Adds it to the `r` columns beyond the `k` pivots, in the rows that `chunk` holds transposed, from
    /// number `start` on. Not for symmetric matrices.
    #[inline(always)]
    pub(super) fn add_to_rows<T: Scalar>(
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

    /// Adds the rest of it to the `chunk` from column `start` on of the update of its parent, kept
    /// by `layout`, whose front has `k` pivots.
    #[inline(always)]
    pub(super) fn add_to_update<T: Scalar>(
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

/// The runs in `places`, the first of which is number `first` of the child; places of the parent
/// count from `origin`.
fn runs(places: &[u32], first: usize, origin: usize) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::new();
    for (i, &place) in (first as u32..).zip(places) {
        let to = place - origin as u32;
        match runs.last_mut() {
            Some(run) if run.to + run.len == to => run.len += 1,
            _ => runs.push(Run {
                from: i,
                to,
                len: 1,
            }),
        }
    }
    runs
}

/// Adds the entries of `update`, whose first row is given with it, from row `first` on to their places in
/// `target`.
#[inline(always)]
fn add_runs<T: Scalar>(runs: &[Run], update: (&[T], usize), target: &mut [T], first: usize) {
    add_runs_below(runs, update, target, first, 0);
}

/// The same for a target that begins at row `above`.
#[inline(always)]
fn add_runs_below<T: Scalar>(
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
        for (target, &update) in target[to..to + len]
            .iter_mut()
            .zip(&update[from..from + len])
        {
            *target += update;
        }
    }
}
