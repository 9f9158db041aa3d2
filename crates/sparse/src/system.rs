//! A sparse linear system. The default backend factorizes in dense blocks with fixed pivots, checks the solution, and
//! switches to pivoting if necessary. If an external engine factorizes instead, its solution is checked.

use std::ops::Range;
use std::sync::Arc;

use crate::elimination::Elimination;
use crate::finite::expect_finite;
use crate::pivoting::Factors;
use crate::resources;
use crate::{Factorization, LinearWork, Scalar, SparseError};

/// Solutions with a larger backward error are refined. With good pivots, the backward error is a few ε times the length
/// of a row. At 1e-12, four digits are lost. One refinement, which costs as much as a solve, recovers them.
const REFINEMENT_THRESHOLD: f64 = 1e-12;

/// Maximum number of refinements of one solution. The first refinement multiplies the error by about the previous
/// backward error. If two refinements are not sufficient, more will not help, and pivoting is required.
const MAX_REFINEMENTS: usize = 2;

/// Solutions with a larger backward error after refinement and pivoting are rejected. At √ε, half of the digits are
/// lost.
const REJECTION_THRESHOLD: f64 = 1.490_116_119_384_765_6e-8;

/// The refinement of a solution from factors in single precision ends at this backward error.
const MIXED_THRESHOLD: f64 = 1e-10;

/// Maximum number of refinements of a solution from factors in single precision. The first solutions have errors of
/// 1e-7 to 1e-3, and each refinement reduces the error by the same factor.
const MAX_MIXED_REFINEMENTS: usize = 4;

/// Solutions from factors in single precision are used without refinement if a refinement would change them by less
/// than this fraction. The convergence rate of a simplified Newton iteration changes by the same amount.
const MIXED_ACCURACY: f64 = 1e-3;

/// A matrix with a fixed pattern, its factors and workspace.
#[derive(Debug)]
pub struct SparseSystem<T: Scalar> {
    elimination: Arc<Elimination>,
    values: Vec<T>,
    /// Factors by dense blocks or by an engine.
    direct: Box<dyn Factorization<T>>,
    /// Factors with pivoting, available after the fixed pivots have failed.
    pivoting: Option<Factors<T>>,
    /// Whether the next matrix is factorized with pivoting.
    pivots_next: bool,
    /// Whether the current factors were computed with pivoting.
    is_pivoted: bool,
    check: bool,
    /// Whether `direct` is in single precision.
    is_single: bool,
    /// Whether the next matrix is factorized in single precision.
    is_single_next: bool,
    rhs: Vec<T>,
    residual: Vec<T>,
    scale: Vec<f64>,
}

impl<T: Scalar> SparseSystem<T> {
    /// Allocates a matrix and its factors.
    pub fn new(elimination: Arc<Elimination>) -> Self {
        let (n, is_single) = (elimination.n(), elimination.is_mixed());
        Self {
            direct: elimination.factors(is_single),
            is_single,
            is_single_next: is_single,
            pivoting: None,
            pivots_next: false,
            is_pivoted: false,
            values: vec![T::zero(); elimination.n_entries()],
            check: true,
            rhs: vec![T::zero(); n],
            residual: vec![T::zero(); n],
            scale: vec![0.0; n],
            elimination,
        }
    }

    /// Returns the values in the order of the pattern. Set them before calling [`renew`](Self::renew).
    pub fn values_mut(&mut self) -> &mut [T] {
        &mut self.values
    }

    /// Returns the values in the order of the pattern.
    pub fn values(&self) -> &[T] {
        &self.values
    }

    /// Factorizes the matrix with the current values.
    ///
    /// # Errors
    /// Returns [`SparseError::Singular`] or other errors of the factorization.
    pub fn renew(&mut self, work: &mut LinearWork) -> Result<(), SparseError> {
        self.check = true;
        if let Err(error) = expect_finite(&self.values, "matrix") {
            // Earlier factors are discarded. This matrix does not make later matrices require pivoting or double
            // precision.
            self.is_pivoted = false;
            self.set_precision(self.is_single)?;
            return Err(error);
        }
        if self.pivots_next {
            return self.pivot(work).map(drop);
        }
        if self.is_single != self.is_single_next {
            self.set_precision(self.is_single_next)?;
        }
        self.is_pivoted = false;
        let mut result = self.direct.renew(&self.values);
        if result.is_ok() {
            self.count(work);
        } else if self.is_single {
            result = self.factorize_in_double(work);
        }
        let Err(failure) = result else {
            return Ok(());
        };
        if self.pivot(work)? { Ok(()) } else { Err(failure) }
    }

    /// Switches to factors in double precision permanently and factorizes.
    fn factorize_in_double(&mut self, work: &mut LinearWork) -> Result<(), SparseError> {
        self.is_single_next = false;
        self.set_precision(false)?;
        self.direct.renew(&self.values)?;
        self.count(work);
        Ok(())
    }

    /// Replaces the factors by factors of the given precision, which contain no values yet.
    fn set_precision(&mut self, is_single: bool) -> Result<(), SparseError> {
        if let Some(needs) = self.elimination.prediction_in::<T>(is_single) {
            resources::expect_memory(needs.bytes, 0)?;
        }
        self.direct = self.elimination.factors(is_single);
        self.is_single = is_single;
        Ok(())
    }

    /// Switches to pivoting permanently and factorizes. Returns `false` if an engine factorizes, because the engine
    /// performs its own pivoting.
    fn pivot(&mut self, work: &mut LinearWork) -> Result<bool, SparseError> {
        expect_finite(&self.values, "matrix")?;
        if self.pivoting.is_none() {
            self.pivoting = self.elimination.pivoting()?;
        }
        let Some(factors) = &mut self.pivoting else {
            return Ok(false);
        };
        if !self.pivots_next {
            // Pivots selected before a history was set do not belong to that history.
            factors.forget_pivots();
        }
        self.pivots_next = true;
        factors.renew(&self.values)?;
        self.is_pivoted = true;
        work.pivoted += 1;
        self.count(work);
        Ok(true)
    }

    fn count(&mut self, work: &mut LinearWork) {
        work.factorizations += 1;
        work.in_single_precision += u64::from(self.is_single && !self.is_pivoted);
        work.factor_entries = self.factors().n_entries().unwrap_or(0) as u64;
    }

    /// Returns the [pivots](Factorization::pivots) of the last matrix by unknown, or `None` after a factorization with
    /// pivoting.
    pub fn pivots(&self) -> Option<Vec<T>> {
        match self.is_pivoted {
            true => None,
            false => self.direct.pivots(),
        }
    }

    /// Returns the number of pivot selections so far. Later matrices reuse selected pivots.
    pub fn pivot_choices(&self) -> u64 {
        self.pivoting.as_ref().map_or(0, Factors::pivot_choices)
    }

    /// Makes the next matrix select new pivots, if pivoting is active.
    pub fn forget_pivots(&mut self) {
        if let Some(factors) = &mut self.pivoting {
            factors.forget_pivots();
        }
    }

    /// Tries fixed pivots again for the next matrix.
    pub fn retry_fixed_pivots(&mut self) {
        self.pivots_next = false;
    }

    /// Returns whether the next matrix is factorized with pivoting, whether the next solution is checked, and whether the
    /// next factors are in single precision.
    pub fn history(&self) -> [bool; 3] {
        [self.pivots_next, self.check, self.is_single_next]
    }

    /// Continues with a [`history`](Self::history). The current factors remain in use until the next call of
    /// [`renew`](Self::renew).
    ///
    /// # Errors
    /// Returns errors of the analysis.
    pub fn set_history(
        &mut self,
        [pivoting, check, is_single]: [bool; 3],
    ) -> Result<(), SparseError> {
        (self.pivots_next, self.check, self.is_single_next) = (pivoting, check, is_single);
        if pivoting && self.pivoting.is_none() {
            self.pivoting = self.elimination.pivoting()?;
        }
        Ok(())
    }

    /// Returns the factors in use.
    fn factors(&mut self) -> &mut dyn Factorization<T> {
        match &mut self.pivoting {
            Some(factors) if self.is_pivoted => factors,
            _ => &mut *self.direct,
        }
    }

    /// Solves in place.
    ///
    /// The first solution after a factorization is checked. If it needs refinement, all other solutions with these
    /// factors are also refined. If refinement does not help, the matrix is factorized with pivoting. A zero right-hand
    /// side cannot be checked, so the check is deferred to the next right-hand side.
    ///
    /// # Errors
    /// Returns [`SparseError::Inaccurate`] if the backward error remains large, [`SparseError::NotFinite`] if the
    /// right-hand side is not finite, and other errors of the solve.
    pub fn solve(&mut self, x: &mut [T], work: &mut LinearWork) -> Result<(), SparseError> {
        work.solves += 1;
        if !self.check {
            return self.factors().solve(x);
        }
        expect_finite(x, "right-hand side")?;
        if x.iter().all(|b| b.is_zero()) {
            return Ok(());
        }
        self.rhs.copy_from_slice(x);
        let mut error = self.solve_and_refine(x, work)?;
        if self.is_mixed() && error > MIXED_THRESHOLD {
            self.factorize_in_double(work)?;
            x.copy_from_slice(&self.rhs);
            error = self.solve_and_refine(x, work)?;
        }
        if !self.is_mixed()
            && error > REFINEMENT_THRESHOLD
            && !self.is_pivoted
            && self.pivot(work)?
        {
            x.copy_from_slice(&self.rhs);
            error = self.solve_and_refine(x, work)?;
        }
        if error.is_infinite()
            || (error > REJECTION_THRESHOLD && self.normwise_error() > REJECTION_THRESHOLD)
        {
            let n = x.len();
            return Err(SparseError::Inaccurate { n, backward_error: error });
        }
        work.largest_backward_error = work.largest_backward_error.max(error);
        Ok(())
    }

    /// Solves in place for several right-hand sides stored by rows. The solutions are not checked: the caller is
    /// expected to iterate and to check the residual.
    ///
    /// # Errors
    /// Fails if the system cannot be solved.
    pub fn solve_columns(
        &mut self,
        x: &mut [T],
        n_columns: usize,
        work: &mut LinearWork,
    ) -> Result<(), SparseError> {
        work.solves += n_columns as u64;
        self.factors().solve_columns(x, n_columns)
    }

    /// Solves with the transpose (not conjugated) in place. The solution is not checked: the caller is expected to
    /// iterate and to check the residual.
    ///
    /// # Errors
    /// Fails if the system cannot be solved.
    pub fn solve_transposed(
        &mut self,
        x: &mut [T],
        work: &mut LinearWork,
    ) -> Result<(), SparseError> {
        work.solves += 1;
        self.factors().solve_transposed(x)
    }

    /// Solves for `x`, refines the solution and returns its backward error. `x` and `rhs` contain b on entry.
    fn solve_and_refine(&mut self, x: &mut [T], work: &mut LinearWork) -> Result<f64, SparseError> {
        self.factors().solve(x)?;
        let mut error = self.backward_error(x);
        let (threshold, most) = match self.is_mixed() {
            true => (MIXED_THRESHOLD, MAX_MIXED_REFINEMENTS),
            false => (REFINEMENT_THRESHOLD, MAX_REFINEMENTS),
        };
        self.check = error > threshold;
        for k in 0..most {
            if error <= threshold {
                break;
            }
            work.refinements += 1;
            let mut correction = std::mem::take(&mut self.residual);
            let solved = self.factors().solve(&mut correction);
            self.residual = correction;
            solved?;
            if k == 0 && self.is_mixed() {
                self.check = self.relative_correction(x) > MIXED_ACCURACY;
            }
            for (x, &correction) in x.iter_mut().zip(&self.residual) {
                *x += correction;
            }
            error = self.backward_error(x);
        }
        Ok(error)
    }

    /// Returns whether factors in single precision are in use.
    fn is_mixed(&self) -> bool {
        self.is_single && !self.is_pivoted
    }

    /// Returns the size of the correction in `residual` relative to `x` in the maximum norm. The constraints and the
    /// other unknowns have different units. Therefore, the ratio is computed separately for each of them, and the
    /// larger ratio is returned.
    fn relative_correction(&self, x: &[T]) -> f64 {
        let constraints = self.elimination.constraints();
        let parts = [0..constraints.start, constraints.clone(), constraints.end..x.len()];
        let largest = |values: &[T]| values.iter().fold(0.0, |max, v| f64::max(max, v.abs()));
        let ratio = |part: Range<usize>| {
            let [correction, size] = [largest(&self.residual[part.clone()]), largest(&x[part])];
            if correction > 0.0 { correction / size } else { 0.0 }
        };
        parts.into_iter().map(ratio).fold(0.0, f64::max)
    }

    /// Returns max_i |b − A x|_i / max_i (|A||x| + |b|)_i of the last checked solution. The right-hand side of a body
    /// at rest consists of rounding errors, and some rows are far smaller than others. The componentwise error is then
    /// meaningless.
    fn normwise_error(&self) -> f64 {
        let largest = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, f64::max);
        let residual = largest(&mut self.residual.iter().map(|r| r.l1_norm()));
        let scale = largest(&mut self.scale.iter().copied());
        match residual.is_finite() && scale >= f64::MIN_POSITIVE / f64::EPSILON {
            true => residual / scale,
            false if scale.is_finite() && residual.is_finite() => 0.0,
            false => f64::INFINITY,
        }
    }

    /// Returns max_i |b − A x|_i / (|A||x| + |b|)_i, or infinity if it is NaN. Stores b − A x in `residual`. The error
    /// does not depend on the scaling of rows and columns, which differs by many orders of magnitude here. As in
    /// LAPACK's ZGERFS, |z| is |Re z| + |Im z|, which is much cheaper than the modulus.
    fn backward_error(&mut self, x: &[T]) -> f64 {
        self.residual.copy_from_slice(&self.rhs);
        for (scale, b) in self.scale.iter_mut().zip(&self.rhs) {
            *scale = b.l1_norm();
        }
        let product = self.elimination.product();
        product.subtract(&self.values, x, &mut self.residual);
        product.add_magnitudes(&self.values, x, &mut self.scale);
        let ratios = self.residual.iter().zip(&self.scale);
        ratios
            .filter(|(_, scale)| **scale != 0.0)
            .map(|(residual, scale)| residual.l1_norm() / scale)
            .fold(
                0.0,
                |max, ratio| {
                    if ratio.is_nan() { f64::INFINITY } else { f64::max(max, ratio) }
                },
            )
    }
}
