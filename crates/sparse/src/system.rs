//! A sparse linear system: factorised by dense blocks, checked, and by KLU where that is not
//! enough.

use std::sync::Arc;

use crate::klu::{Factors, KluError, KluOptions, Symbolic};
use nalgebra_sparse::pattern::SparsityPattern;

use crate::product::Product;
use crate::supernodal::{Analysis, Supernodal};
use crate::{LinearWork, Number};

/// Solutions with a larger backward error are refined. Good pivots leave a few ε times the length
/// of a row; at 1e-12 four digits are gone, and a refinement, which costs as much as a solve,
/// brings them back.
const REFINE_ABOVE: f64 = 1e-12;

/// Refinements of one solution. The first contracts the error by the backward error before it;
/// if two do not do, more will not, and pivots must be exchanged.
const MAX_REFINEMENTS: usize = 2;

/// Neighbours to be eliminated before an unknown without a diagonal entry (a pressure for κ = ∞).
/// One is enough for a pivot that is not zero; measured on the muscle from 1 to all, the backward
/// error stays at 1e-15 throughout, and up to twelve the fill does not grow.
const NEIGHBOURS_BEFORE: usize = 12;

/// The pattern of a matrix and the order in which it is eliminated: all that real and complex
/// matrices with that pattern share.
#[derive(Debug)]
pub struct Elimination {
    n_entries: usize,
    product: Product,
    symbolic: Symbolic,
    blocks: Arc<Analysis>,
}

impl Elimination {
    /// Analyses the compressed-column `pattern`.
    ///
    /// # Errors
    /// Those of KLU's analysis, whose order of elimination is used.
    pub fn new(pattern: &SparsityPattern, options: KluOptions) -> Result<Self, KluError> {
        let symbolic = Symbolic::analyze(pattern, options)?;
        let blocks = Analysis::new(pattern, &symbolic.column_order(), NEIGHBOURS_BEFORE);
        Ok(Self {
            n_entries: pattern.nnz(),
            product: Product::new(pattern),
            symbolic,
            blocks: Arc::new(blocks),
        })
    }

    /// The supernodes.
    pub fn analysis(&self) -> &Arc<Analysis> {
        &self.blocks
    }
}

/// A matrix with a fixed pattern, its factors and workspace.
#[derive(Debug)]
pub struct SparseSystem<T: Number> {
    elimination: Arc<Elimination>,
    values: Vec<T>,
    blocks: Supernodal<T>,
    /// KLU, once fixed pivots have failed.
    pivoting: Option<Factors<T>>,
    n_block_entries: u64,
    check: bool,
    rhs: Vec<T>,
    residual: Vec<T>,
    scale: Vec<f64>,
}

impl<T: Number> SparseSystem<T> {
    /// Room for a matrix and its factors.
    pub fn new(elimination: Arc<Elimination>) -> Self {
        let blocks = &elimination.blocks;
        let n = blocks.n();
        Self {
            n_block_entries: blocks.n_entries() as u64,
            blocks: Supernodal::new(blocks.clone()),
            pivoting: None,
            values: vec![T::zero(); elimination.n_entries],
            check: true,
            rhs: vec![T::zero(); n],
            residual: vec![T::zero(); n],
            scale: vec![0.0; n],
            elimination,
        }
    }

    /// The values in the order of the pattern, to be filled before [`renew`](Self::renew).
    pub fn values_mut(&mut self) -> &mut [T] {
        &mut self.values
    }

    /// The values in the order of the pattern.
    pub fn values(&self) -> &[T] {
        &self.values
    }

    /// Factorises the matrix with the present values.
    ///
    /// # Errors
    /// [`KluError::Singular`] and others of the factorisation.
    pub fn renew(&mut self, work: &mut LinearWork) -> Result<(), KluError> {
        self.check = true;
        if self.pivoting.is_none() && self.blocks.factor(&self.values).is_ok() {
            work.factorizations += 1;
            work.factor_entries = self.n_block_entries;
            return Ok(());
        }
        self.pivot(work)
    }

    /// Factorises with exchange of pivots, now and from now on.
    fn pivot(&mut self, work: &mut LinearWork) -> Result<(), KluError> {
        let factors = self
            .pivoting
            .get_or_insert_with(|| Factors::new(self.elimination.symbolic.clone()));
        factors.renew(&self.values)?;
        let (lower, upper) = factors.current()?.nnz_factors();
        work.factorizations += 1;
        work.pivoted += 1;
        work.factor_entries = (lower + upper) as u64;
        Ok(())
    }

    /// Solves in place. The first solution with new factors is checked; if it needs refinement,
    /// so do all others with these factors; if refinement does not help, pivots are exchanged.
    ///
    /// # Errors
    /// Those of the solve.
    pub fn solve(&mut self, x: &mut [T], work: &mut LinearWork) -> Result<(), KluError> {
        work.solves += 1;
        if !self.check {
            return self.apply_factors(x);
        }
        self.rhs.copy_from_slice(x);
        let mut error = self.solve_and_refine(x, work)?;
        if error > REFINE_ABOVE && self.pivoting.is_none() {
            self.pivot(work)?;
            x.copy_from_slice(&self.rhs);
            error = self.solve_and_refine(x, work)?;
        }
        work.largest_backward_error = work.largest_backward_error.max(error);
        Ok(())
    }

    /// Solves for `x` = b, a copy of which is in `rhs`, and returns the backward error.
    fn solve_and_refine(&mut self, x: &mut [T], work: &mut LinearWork) -> Result<f64, KluError> {
        self.apply_factors(x)?;
        let mut error = self.backward_error(x);
        self.check = error > REFINE_ABOVE;
        for _ in 0..MAX_REFINEMENTS {
            if error <= REFINE_ABOVE {
                break;
            }
            work.refinements += 1;
            let mut correction = std::mem::take(&mut self.residual);
            let solved = self.apply_factors(&mut correction);
            self.residual = correction;
            solved?;
            for (x, &correction) in x.iter_mut().zip(&self.residual) {
                *x += correction;
            }
            error = self.backward_error(x);
        }
        Ok(error)
    }

    fn apply_factors(&mut self, x: &mut [T]) -> Result<(), KluError> {
        match &self.pivoting {
            Some(factors) => factors.solve(x),
            None => {
                self.blocks.solve(x);
                Ok(())
            }
        }
    }

    /// max_i |b - A x|_i / (|A||x| + |b|)_i, infinite where it is not a number; leaves b - A x in
    /// `residual`. It does not depend on the scaling of rows and columns, which here differ by many
    /// powers of ten.
    fn backward_error(&mut self, x: &[T]) -> f64 {
        self.residual.copy_from_slice(&self.rhs);
        for (scale, b) in self.scale.iter_mut().zip(&self.rhs) {
            *scale = b.abs();
        }
        let product = &self.elimination.product;
        product.subtract(&self.values, x, &mut self.residual);
        product.add_magnitudes(&self.values, x, &mut self.scale);
        let ratios = self.residual.iter().zip(&self.scale);
        ratios
            .filter(|(_, scale)| **scale != 0.0)
            .map(|(residual, scale)| residual.abs() / scale)
            .fold(0.0, |max, ratio| {
                if ratio.is_nan() {
                    f64::INFINITY
                } else {
                    f64::max(max, ratio)
                }
            })
    }
}
