//! The numbers of a supernodal factorisation.

use std::sync::Arc;

use pulp::{Arch, Simd, WithSimd};

use super::analysis::{Analysis, Child, Run, Supernode};
use super::dense::{dot, eliminate_rows, factor_panel, solve_lower, subtract, subtract_outer};
use crate::linear::Number;

/// A pivot was zero or not finite: another order, or exchanges of pivots, are needed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("a pivot is zero or not finite in the fixed order of elimination")]
pub struct ZeroPivot;

/// LU factors in dense blocks. After construction nothing allocates.
///
/// For a supernode of k columns and r rows below them: L and U of its columns, (k + r) × k, and
/// then its rows of U, transposed, r × k; all column-major, one supernode after the other.
#[derive(Debug, Clone)]
pub struct Supernodal<T: Number> {
    analysis: Arc<Analysis>,
    factors: Vec<T>,
    /// What a supernode subtracts from those above it.
    update: Vec<T>,
    /// Updates waiting for their parents, the youngest on top.
    stack: Vec<T>,
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
            update: zeros(largest(|node| node.rows.len()).pow(2)),
            stack: zeros(stack_height(&analysis)),
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
            update,
            stack,
            ..
        } = self;
        let mut top = 0;
        let mut rest = &mut factors[..];
        for node in &analysis.supernodes {
            let (m, k, r) = (node.size(), node.columns.len(), node.rows.len());
            let block;
            (block, rest) = rest.split_at_mut(node.n_entries());
            let update = &mut update[..r * r];
            block.fill(T::zero());
            update.fill(T::zero());
            for &(index, position) in &node.entries {
                block[position as usize] += values[index as usize];
            }
            let (panel, upper) = block.split_at_mut(m * k);
            for child in node.children.iter().rev() {
                let n = child.places.len();
                top -= n * n;
                child.add(&stack[top..][..n * n], k, panel, upper, update);
            }
            if !factor_panel(panel, m) {
                return Err(ZeroPivot);
            }
            if r > 0 {
                eliminate_rows(upper, r, panel, m);
                subtract_outer(update, r, &panel[k..], m, upper);
            }
            stack[top..][..r * r].copy_from_slice(update);
            top += r * r;
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
            for (p, column) in panel.chunks_exact(m).enumerate().rev() {
                let (above, rest) = pivots.split_at_mut(p);
                rest[0] = rest[0] / column[p];
                subtract(above, &column[..p], rest[0]);
            }
        }
        for (&x, &original) in x.iter().zip(&analysis.order) {
            rhs[original] = x;
        }
    }
}

impl Child {
    /// Adds the `update` of this child to the columns, rows and update of its parent, which has
    /// `k` columns.
    #[inline(always)]
    fn add<T: Number>(
        &self,
        update: &[T],
        k: usize,
        panel: &mut [T],
        upper: &mut [T],
        above: &mut [T],
    ) {
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

/// The most entries that wait for their parents at once.
fn stack_height(analysis: &Analysis) -> usize {
    let (mut top, mut highest) = (0_usize, 0);
    for node in &analysis.supernodes {
        for child in &node.children {
            top -= child.places.len().pow(2);
        }
        top += node.rows.len().pow(2);
        highest = highest.max(top);
    }
    highest
}
