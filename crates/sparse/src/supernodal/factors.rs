//! The numbers of a supernodal factorisation.

use std::sync::Arc;

use pulp::{Arch, Simd, WithSimd};

use super::analysis::{Analysis, Child, Run, Supernode};
use super::dense::{dot, eliminate_rows, factor_panel, minus_outer, solve_lower, solve_upper};
use crate::number::Number;

/// A pivot was zero or not finite: another order, or exchanges of pivots, are needed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("a pivot is zero or not finite in the fixed order of elimination")]
pub struct ZeroPivot;

/// LU factors in dense blocks. After construction nothing allocates.
///
/// For a supernode of k columns and r rows below them: L and U of its columns, (k + r) × k, and
/// then its rows of U, transposed, r × k; all column-major, one supernode after the other. In the
/// place of the pivots are their inverses.
#[derive(Debug, Clone)]
pub struct Supernodal<T: Number> {
    analysis: Arc<Analysis>,
    factors: Vec<T>,
    /// Updates waiting for their parents, the youngest on top: those of supernodes at even and at
    /// odd depth, so that one is formed in its place while those of the children are read.
    stacks: [Vec<T>; 2],
    x: Vec<T>,
    gathered: Vec<T>,
    arch: Arch,
}

impl<T: Number> Supernodal<T> {
    /// Room for the factors.
    pub fn new(analysis: Arc<Analysis>) -> Self {
        let zeros = |n: usize| vec![T::zero(); n];
        let largest = |f: fn(&Supernode) -> usize| {
            analysis.supernodes.iter().map(f).max().unwrap_or_default()
        };
        Self {
            factors: zeros(analysis.n_entries()),
            stacks: stack_heights(&analysis).map(zeros),
            x: zeros(analysis.n()),
            gathered: zeros(largest(Supernode::size)),
            arch: Arch::new(),
            analysis,
        }
    }

    /// Factorises the matrix with these `values`, in the order of the pattern analysed.
    ///
    /// # Errors
    /// [`ZeroPivot`]; there are no factors then.
    pub fn factor(&mut self, values: &[T]) -> Result<(), ZeroPivot> {
        let arch = self.arch;
        arch.dispatch(Factor {
            factors: self,
            values,
        })
    }

    #[inline(always)]
    fn factor_here(&mut self, values: &[T]) -> Result<(), ZeroPivot> {
        let Self {
            analysis,
            factors,
            stacks,
            ..
        } = self;
        let [even, odd] = stacks;
        let mut tops = [0; 2];
        let mut rest = &mut factors[..];
        for node in &analysis.supernodes {
            let (m, k, r) = (node.size(), node.columns.len(), node.rows.len());
            let block;
            (block, rest) = rest.split_at_mut(node.n_entries());
            block.fill(T::zero());
            for &(index, position) in &node.entries {
                block[position as usize] = values[index as usize];
            }
            let (panel, upper) = block.split_at_mut(m * k);
            let [top_even, top_odd] = &mut tops;
            let (own, top, below, top_below) = match node.is_odd {
                false => (&mut *even, top_even, &*odd, top_odd),
                true => (&mut *odd, top_odd, &*even, top_even),
            };
            let bottom = *top_below - node.n_child_entries();
            let of_children = &below[bottom..*top_below];
            *top_below = bottom;
            let mut updates = of_children;
            for child in &node.children {
                let of_child;
                (of_child, updates) = updates.split_at(child.n_entries());
                child.add_to_pivots(of_child, k, panel, upper);
            }
            if !factor_panel(panel, m) {
                return Err(ZeroPivot);
            }
            if r > 0 {
                eliminate_rows(upper, r, panel, m);
                let update = &mut own[*top..][..r * r];
                minus_outer(update, r, &panel[k..], m, upper);
                let mut updates = of_children;
                for child in &node.children {
                    let of_child;
                    (of_child, updates) = updates.split_at(child.n_entries());
                    child.add_to_update(of_child, k, r, update);
                }
                *top += r * r;
            }
        }
        Ok(())
    }

    /// Solves A x = b in place with the last factors.
    pub fn solve(&mut self, rhs: &mut [T]) {
        let arch = self.arch;
        arch.dispatch(Solve { factors: self, rhs });
    }

    #[inline(always)]
    fn solve_here(&mut self, rhs: &mut [T]) {
        let Self {
            analysis,
            factors,
            x,
            gathered,
            ..
        } = self;
        for (x, &original) in x.iter_mut().zip(&analysis.order) {
            *x = rhs[original];
        }
        let mut start = 0;
        for node in &analysis.supernodes {
            let (m, k) = (node.size(), node.columns.len());
            let y = &mut gathered[..m];
            y[..k].copy_from_slice(&x[node.columns.clone()]);
            y[k..].fill(T::zero());
            solve_lower(y, &factors[start..][..m * k]);
            x[node.columns.clone()].copy_from_slice(&y[..k]);
            for (&row, &update) in node.rows.iter().zip(&y[k..]) {
                x[row as usize] += update;
            }
            start += node.n_entries();
        }
        for node in analysis.supernodes.iter().rev() {
            start -= node.n_entries();
            let (m, k, r) = (node.size(), node.columns.len(), node.rows.len());
            let (panel, upper) = factors[start..][..node.n_entries()].split_at(m * k);
            let right = &mut gathered[..r];
            for (value, &row) in right.iter_mut().zip(&node.rows) {
                *value = x[row as usize];
            }
            let pivots = &mut x[node.columns.clone()];
            if r > 0 {
                for (pivot, row) in pivots.iter_mut().zip(upper.chunks_exact(r)) {
                    *pivot -= dot(row, right);
                }
            }
            solve_upper(pivots, panel, m);
        }
        for (&x, &original) in x.iter().zip(&analysis.order) {
            rhs[original] = x;
        }
    }
}

impl Child {
    /// Adds the `update` of this child to the `k` columns and rows of its parent's pivots.
    #[inline(always)]
    fn add_to_pivots<T: Number>(&self, update: &[T], k: usize, panel: &mut [T], upper: &mut [T]) {
        let n = self.places.len();
        let m = panel.len() / k;
        let r = m - k;
        let (own, beyond) = self.places.split_at(self.n_columns);
        let (of_columns, of_rows) = update.split_at(self.n_columns * n);
        for (&column, update) in own.iter().zip(of_columns.chunks_exact(n)) {
            let (pivots, rows) = panel[column as usize * m..][..m].split_at_mut(k);
            add_runs(&self.column_runs, update, pivots);
            add_runs(&self.row_runs, update, rows);
        }
        for (&column, update) in beyond.iter().zip(of_rows.chunks_exact(n)) {
            let column = column as usize - k;
            for (&row, &update) in own.iter().zip(update) {
                upper[row as usize * r + column] += update;
            }
        }
    }

    /// Adds the rest of it to the update of its parent.
    #[inline(always)]
    fn add_to_update<T: Number>(&self, update: &[T], k: usize, r: usize, above: &mut [T]) {
        let n = self.places.len();
        let columns = self.places[self.n_columns..].iter();
        for (&column, update) in columns.zip(update[self.n_columns * n..].chunks_exact(n)) {
            let column = column as usize - k;
            add_runs(&self.row_runs, update, &mut above[column * r..][..r]);
        }
    }
}

#[inline(always)]
fn add_runs<T: Number>(runs: &[Run], update: &[T], target: &mut [T]) {
    for &Run { from, to, len } in runs {
        for (target, &update) in target[to..to + len]
            .iter_mut()
            .zip(&update[from..from + len])
        {
            *target += update;
        }
    }
}

/// The factorisation, to be run with the processor's vector instructions. A type and not a closure:
/// a closure's call is not inlined into the function that has the instructions.
struct Factor<'a, T: Number> {
    factors: &'a mut Supernodal<T>,
    values: &'a [T],
}

impl<T: Number> WithSimd for Factor<'_, T> {
    type Output = Result<(), ZeroPivot>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Self::Output {
        self.factors.factor_here(self.values)
    }
}

/// The solve, likewise.
struct Solve<'a, T: Number> {
    factors: &'a mut Supernodal<T>,
    rhs: &'a mut [T],
}

impl<T: Number> WithSimd for Solve<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        self.factors.solve_here(self.rhs);
    }
}

/// The most entries that wait for their parents at once, at even depth and at odd.
fn stack_heights(analysis: &Analysis) -> [usize; 2] {
    let (mut tops, mut highest) = ([0; 2], [0; 2]);
    for node in &analysis.supernodes {
        let own = usize::from(node.is_odd);
        tops[own] += node.rows.len().pow(2);
        highest[own] = highest[own].max(tops[own]);
        tops[1 - own] -= node.n_child_entries();
    }
    highest
}
