//! Solves with supernodal factors.

use pulp::{Simd, WithSimd};

use super::factors::Supernodal;
use super::small::{dot, solve_lower, solve_transposed, solve_upper};
use crate::{Factorization, Kind, Number, SparseError};

impl<T: Number> Supernodal<T> {
    /// Solves A x = b in place with the last factors.
    pub fn solve(&mut self, rhs: &mut [T]) {
        let arch = self.arch;
        let is_transposed = false;
        arch.dispatch(Solve {
            factors: self,
            rhs,
            is_transposed,
        });
    }

    /// Solves Aᵀ x = b in place (transposed, not conjugated) with the last factors.
    pub fn solve_transposed(&mut self, rhs: &mut [T]) {
        let arch = self.arch;
        let is_transposed = true;
        arch.dispatch(Solve {
            factors: self,
            rhs,
            is_transposed,
        });
    }

    #[inline(always)]
    fn solve_here(&mut self, rhs: &mut [T], is_transposed: bool) {
        for (x, &original) in self.x.iter_mut().zip(&self.analysis.order) {
            *x = rhs[original as usize];
        }
        match (self.analysis.kind, is_transposed) {
            (Kind::Symmetric, _) => {
                self.forward();
                self.backward_transposed::<true>();
            }
            (Kind::General, false) => {
                self.forward();
                self.backward();
            }
            (Kind::General, true) => {
                self.forward_transposed();
                self.backward_transposed::<false>();
            }
        }
        for (&x, &original) in self.x.iter().zip(&self.analysis.order) {
            rhs[original as usize] = x;
        }
    }

    /// x ← L⁻¹ x.
    #[inline(always)]
    fn forward(&mut self) {
        let Self {
            analysis,
            factors,
            x,
            gathered,
            ..
        } = self;
        for node in &analysis.supernodes {
            let (m, k) = (node.size(), node.n_columns());
            let y = &mut gathered[..m];
            y[..k].copy_from_slice(&x[node.shape.columns.clone()]);
            y[k..].fill(T::zero());
            solve_lower(y, &factors[node.start..][..m * k], m);
            x[node.shape.columns.clone()].copy_from_slice(&y[..k]);
            for (&row, &update) in node.shape.rows.iter().zip(&y[k..]) {
                x[row as usize] += update;
            }
        }
    }

    /// x ← U⁻¹ x.
    #[inline(always)]
    fn backward(&mut self) {
        let Self {
            analysis,
            factors,
            x,
            gathered,
            ..
        } = self;
        for node in analysis.supernodes.iter().rev() {
            let (m, k, r) = (node.size(), node.n_columns(), node.n_rows());
            let (panel, upper) = factors[node.start..][..k * (m + r)].split_at(m * k);
            let right = &mut gathered[..r];
            for (value, &row) in right.iter_mut().zip(&node.shape.rows) {
                *value = x[row as usize];
            }
            let pivots = &mut x[node.shape.columns.clone()];
            if r > 0 {
                for (pivot, row) in pivots.iter_mut().zip(upper.chunks_exact(r)) {
                    *pivot -= dot(row, right);
                }
            }
            solve_upper(pivots, panel, m);
        }
    }

    /// x ← (Uᵀ)⁻¹ x.
    #[inline(always)]
    fn forward_transposed(&mut self) {
        let Self {
            analysis,
            factors,
            x,
            ..
        } = self;
        for node in &analysis.supernodes {
            let (m, k, r) = (node.size(), node.n_columns(), node.n_rows());
            let (panel, upper) = factors[node.start..][..k * (m + r)].split_at(m * k);
            let first = node.shape.columns.start;
            for p in 0..k {
                let (done, rest) = x[first..].split_at_mut(p);
                let column = &panel[p * m..];
                rest[0] = (rest[0] - dot(&column[..p], done)) * column[p];
                let pivot = rest[0];
                for (&row, &entry) in node.shape.rows.iter().zip(&upper[p * r..]) {
                    let x = &mut x[row as usize];
                    *x = x.plus_product(entry, -pivot);
                }
            }
        }
    }

    /// x ← (Lᵀ)⁻¹ x, or (D Lᵀ)⁻¹ x.
    #[inline(always)]
    fn backward_transposed<const WITH_PIVOTS: bool>(&mut self) {
        let Self {
            analysis,
            factors,
            x,
            gathered,
            ..
        } = self;
        for node in analysis.supernodes.iter().rev() {
            let (m, k) = (node.size(), node.n_columns());
            let panel = &factors[node.start..][..m * k];
            let y = &mut gathered[..m];
            let pivots = &mut x[node.shape.columns.clone()];
            for (p, (y, &x)) in y.iter_mut().zip(&*pivots).enumerate() {
                *y = if WITH_PIVOTS { x * panel[p * m + p] } else { x };
            }
            for (value, &row) in y[k..].iter_mut().zip(&node.shape.rows) {
                *value = x[row as usize];
            }
            solve_transposed(y, panel);
            x[node.shape.columns.clone()].copy_from_slice(&y[..k]);
        }
    }
}

impl<T: Number> Factorization<T> for Supernodal<T> {
    fn renew(&mut self, values: &[T]) -> Result<(), SparseError> {
        self.factor(values)
    }

    fn solve(&mut self, x: &mut [T]) -> Result<(), SparseError> {
        Self::solve(self, x);
        Ok(())
    }

    fn solve_transposed(&mut self, x: &mut [T]) -> Result<(), SparseError> {
        Self::solve_transposed(self, x);
        Ok(())
    }

    fn n_entries(&self) -> Option<usize> {
        Some(self.factors.len())
    }
}

/// The solve, to be run with the processor's vector instructions.
struct Solve<'a, T: Number> {
    factors: &'a mut Supernodal<T>,
    rhs: &'a mut [T],
    is_transposed: bool,
}

impl<T: Number> WithSimd for Solve<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        self.factors.solve_here(self.rhs, self.is_transposed);
    }
}
