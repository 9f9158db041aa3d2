//! The numbers of a supernodal factorisation.

use std::sync::Arc;

use pulp::{Arch, Simd, WithSimd};

use super::analysis::{Analysis, Supernode};
use super::dense::{dot, eliminate, subtract, subtract_product};
use crate::linear::Number;

/// A pivot was zero or not finite: another order, or exchanges of pivots, are needed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("a pivot is zero or not finite in the fixed order of elimination")]
pub struct ZeroPivot;

/// The factors of one supernode.
#[derive(Debug, Clone)]
struct Block<T> {
    /// L and U of the pivots, `k × k`, column-major.
    pivots: Vec<T>,
    /// L below the pivots, `rows × k`, column-major.
    lower: Vec<T>,
    /// U right of the pivots, transposed: `rows × k`, column-major.
    upper: Vec<T>,
}

/// LU factors in dense blocks. After construction nothing allocates.
#[derive(Debug, Clone)]
pub struct Supernodal<T: Number> {
    analysis: Arc<Analysis>,
    blocks: Vec<Block<T>>,
    front: Vec<T>,
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
        let blocks = analysis
            .supernodes
            .iter()
            .map(|node| Block {
                pivots: zeros(node.columns.len().pow(2)),
                lower: zeros(node.columns.len() * node.rows.len()),
                upper: zeros(node.columns.len() * node.rows.len()),
            })
            .collect();
        let largest = |f: fn(&Supernode) -> usize| {
            analysis.supernodes.iter().map(f).max().unwrap_or_default()
        };
        Self {
            blocks,
            front: zeros(largest(Supernode::size).pow(2)),
            stack: zeros(stack_height(&analysis)),
            x: zeros(analysis.n()),
            gathered: zeros(largest(|node| node.rows.len())),
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
            blocks,
            front,
            stack,
            ..
        } = self;
        let mut top = 0;
        for (node, block) in analysis.supernodes.iter().zip(blocks) {
            let (m, k) = (node.size(), node.columns.len());
            let front = &mut front[..m * m];
            front.fill(T::zero());
            for &(index, position) in &node.entries {
                front[position as usize] += values[index as usize];
            }
            for (_, places) in node.children.iter().rev() {
                let r = places.len();
                top -= r * r;
                for (&column, update) in places.iter().zip(stack[top..].chunks_exact(r)) {
                    let column = &mut front[column as usize * m..][..m];
                    for (&row, &update) in places.iter().zip(update) {
                        column[row as usize] += update;
                    }
                }
            }
            if !eliminate(front, m, k) {
                return Err(ZeroPivot);
            }
            let r = m - k;
            for (p, column) in front[..k * m].chunks_exact(m).enumerate() {
                block.pivots[p * k..][..k].copy_from_slice(&column[..k]);
                block.lower[p * r..][..r].copy_from_slice(&column[k..]);
            }
            for (j, column) in front[k * m..].chunks_exact(m).enumerate() {
                for (p, &u) in column[..k].iter().enumerate() {
                    block.upper[p * r + j] = u;
                }
                stack[top + j * r..][..r].copy_from_slice(&column[k..]);
            }
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
            blocks,
            x,
            gathered,
            ..
        } = self;
        for (x, &original) in x.iter_mut().zip(&analysis.order) {
            *x = rhs[original];
        }
        for (node, block) in analysis.supernodes.iter().zip(blocks.iter()) {
            let pivots = &mut x[node.columns.clone()];
            for (p, column) in block.pivots.chunks_exact(pivots.len()).enumerate() {
                let (solved, rest) = pivots.split_at_mut(p + 1);
                subtract(rest, &column[p + 1..], solved[p]);
            }
            let below = &mut gathered[..node.rows.len()];
            below.fill(T::zero());
            subtract_product(below, &block.lower, pivots);
            for (&row, &update) in node.rows.iter().zip(below.iter()) {
                x[row as usize] += update;
            }
        }
        for (node, block) in analysis.supernodes.iter().zip(blocks.iter()).rev() {
            let r = node.rows.len();
            let right = &mut gathered[..r];
            for (value, &row) in right.iter_mut().zip(&node.rows) {
                *value = x[row as usize];
            }
            let pivots = &mut x[node.columns.clone()];
            if r > 0 {
                for (pivot, row) in pivots.iter_mut().zip(block.upper.chunks_exact(r)) {
                    *pivot -= dot(row, right);
                }
            }
            let k = pivots.len();
            for (p, column) in block.pivots.chunks_exact(k).enumerate().rev() {
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
        for (_, places) in &node.children {
            top -= places.len().pow(2);
        }
        top += node.rows.len().pow(2);
        highest = highest.max(top);
    }
    highest
}
