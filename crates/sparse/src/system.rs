//! A sparse linear system. The default backend factorizes in dense blocks with fixed pivots, checks the solution, and
//! switches to pivoting if necessary. Alternatively, an external engine factorizes and the solution is checked.

use std::ops::Range;
use std::sync::Arc;

use nalgebra_sparse::pattern::SparsityPattern;
use rayon::ThreadPool;

use crate::SparseOptions;
use crate::engine::{self, Engine};
use crate::finite::expect_finite;
use crate::pivoting::{Factors, Symbolic};
use crate::product::Product;
use crate::resources;
use crate::supernodal::{Analysis, Supernodal};
use crate::{Factorization, Kind, LinearWork, Prediction, Scalar, SparseError};

/// Solutions with a larger backward error are refined. Good pivots give a few ε times the length of a row. At 1e-12,
/// four digits are lost; one refinement, which costs as much as a solve, recovers them.
const REFINEMENT_THRESHOLD: f64 = 1e-12;

/// Maximum number of refinements of one solution. The first one contracts the error by the previous backward error. If
/// two are not sufficient, more will not help, and pivoting is required.
const MAX_REFINEMENTS: usize = 2;

/// Solutions with a larger backward error after refinement and pivoting are rejected. At √ε, half of the digits are
/// lost.
const REJECTION_THRESHOLD: f64 = 1.490_116_119_384_765_6e-8;

/// Matrices that take more multiplications are not passed to the pivoting solver. Its scalar loops and its order,
/// without nested dissection, take a hundred times as long as the dense blocks: 8 s instead of 0.1 s for a body of 10⁴
/// unknowns (1e9), hours for larger ones.
const MAX_PIVOTING_WORK: f64 = 1e9;

/// Matrices that take more multiplications are factorized by several [threads](resources::use_threads), if enabled.
/// Below a few milliseconds, waking the threads costs more than it saves.
const MIN_THREADED_WORK: f64 = 1e8;

/// Known structure of a matrix beyond its pattern.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Structure {
    /// Whether the matrix is symmetric.
    pub kind: Kind,
    /// Unknowns whose diagonal entries are too small for pivots before other unknowns are eliminated (the pressures of
    /// a nearly incompressible body). Unknowns without a diagonal entry are detected and need not be listed.
    pub constraints: Range<usize>,
}

/// The pattern of a matrix and its order of elimination, shared by real and complex matrices.
#[derive(Debug)]
pub struct Elimination {
    n: usize,
    n_entries: usize,
    product: Product,
    backend: Backend,
}

/// The solver that factorizes.
#[derive(Debug)]
enum Backend {
    Blocks(Box<Blocks>),
    Engine {
        engine: Arc<dyn Engine>,
        pattern: Arc<SparsityPattern>,
        kind: Kind,
    },
}

/// Dense blocks with fixed pivots, and pivoting if they fail.
#[derive(Debug)]
struct Blocks {
    /// The pattern for the pivoting solver; `None` if the matrix is too large for it.
    pattern: Option<SparsityPattern>,
    options: SparseOptions,
    analysis: Arc<Analysis>,
    threads: Option<Arc<ThreadPool>>,
}

impl Elimination {
    /// Analyzes the compressed-column `pattern`, or delegates it to an installed [`engine`]. `options` apply
    /// to factorizations with pivoting.
    ///
    /// # Errors
    /// [`SparseError::NotSquare`], [`SparseError::EmptyColumn`].
    pub fn new(
        pattern: &SparsityPattern,
        structure: Structure,
        options: SparseOptions,
    ) -> Result<Self, SparseError> {
        if let Some(engine) = engine::installed() {
            return Ok(Self::with_engine(engine, pattern, structure.kind));
        }
        let analysis = Analysis::new(pattern, structure.kind, structure.constraints)?;
        let work = analysis.n_multiplications();
        let blocks = Blocks {
            pattern: (work <= MAX_PIVOTING_WORK).then(|| pattern.clone()),
            options,
            analysis: Arc::new(analysis),
            threads: resources::threads().filter(|_| work > MIN_THREADED_WORK),
        };
        Ok(Self::of(pattern, Backend::Blocks(Box::new(blocks))))
    }

    /// Delegates matrices with this compressed-column `pattern` to an `engine`.
    pub fn with_engine(engine: Arc<dyn Engine>, pattern: &SparsityPattern, kind: Kind) -> Self {
        let backend = Backend::Engine {
            engine,
            pattern: Arc::new(pattern.clone()),
            kind,
        };
        Self::of(pattern, backend)
    }

    fn of(pattern: &SparsityPattern, backend: Backend) -> Self {
        Self {
            n: pattern.major_dim(),
            n_entries: pattern.nnz(),
            product: Product::new(pattern),
            backend,
        }
    }

    /// Uses `threads` threads for factorizations; has no effect on an engine. Results do not depend on the number.
    ///
    /// # Errors
    /// [`SparseError::Threads`].
    pub fn in_threads(mut self, threads: usize) -> Result<Self, SparseError> {
        if let Backend::Blocks(blocks) = &mut self.backend {
            blocks.threads = match threads {
                0 | 1 => None,
                _ => Some(resources::pool_of(threads)?),
            };
        }
        Ok(self)
    }

    /// Allocates a matrix and its factors.
    fn factors<T: Scalar>(&self) -> Box<dyn Factorization<T>> {
        match &self.backend {
            Backend::Blocks(blocks) => {
                let (analysis, threads) = (blocks.analysis.clone(), blocks.threads.clone());
                Box::new(Supernodal::in_threads(analysis, threads))
            }
            Backend::Engine {
                engine,
                pattern,
                kind,
            } => T::factors_of(&**engine, pattern, *kind),
        }
    }

    /// Allocates factors with pivoting; `None` if an engine factorizes.
    fn pivoting<T: Scalar>(&self) -> Result<Option<Factors<T>>, SparseError> {
        let Backend::Blocks(blocks) = &self.backend else {
            return Ok(None);
        };
        let pattern = blocks.pattern.as_ref();
        let pattern = pattern.ok_or(SparseError::TooLargeToPivot { n: self.n })?;
        let symbolic = Symbolic::analyze(pattern, blocks.options)?;
        Ok(Some(Factors::new(symbolic)))
    }

    /// Returns the analysis; `None` if an engine factorizes.
    pub fn analysis(&self) -> Option<&Arc<Analysis>> {
        match &self.backend {
            Backend::Blocks(blocks) => Some(&blocks.analysis),
            Backend::Engine { .. } => None,
        }
    }

    /// Checks that the factors of a real matrix fit into memory.
    ///
    /// # Errors
    /// [`SparseError::Memory`].
    pub fn expect_memory(&self) -> Result<(), SparseError> {
        let needed = self.prediction::<f64>().map_or(0, |needs| needs.bytes);
        resources::expect_memory(needed, 0)
    }

    /// Predicts the cost of one matrix of type `T` and its factors; `None` if an engine factorizes. The analysis is
    /// counted for each matrix, although matrices with the same pattern share it.
    pub fn prediction<T: Scalar>(&self) -> Option<Prediction> {
        let Backend::Blocks(blocks) = &self.backend else {
            return None;
        };
        let analysis = &blocks.analysis;
        let threads = blocks.threads.as_ref();
        let n_threads = threads.map_or(1, |pool| pool.current_num_threads());
        let beside = self.n_entries + 2 * self.n;
        let entries = Supernodal::<T>::n_kept(analysis, n_threads) + beside;
        let kept = blocks.pattern.iter();
        let pattern: usize = kept.map(|p| size_of_val(p.minor_indices())).sum();
        let indices = pattern + self.product.n_bytes();
        let per_multiplication = if size_of::<T>() == size_of::<f64>() {
            2.0
        } else {
            8.0
        };
        Some(Prediction {
            entries: analysis.n_entries(),
            bytes: entries * size_of::<T>() + analysis.n_bytes() + indices,
            flops: per_multiplication * analysis.n_multiplications(),
        })
    }
}

/// A matrix with a fixed pattern, its factors and workspace.
#[derive(Debug)]
pub struct SparseSystem<T: Scalar> {
    elimination: Arc<Elimination>,
    values: Vec<T>,
    /// Factors by dense blocks or by an engine.
    direct: Box<dyn Factorization<T>>,
    /// Factors with pivoting, once the fixed pivots have failed.
    pivoting: Option<Factors<T>>,
    /// Whether the next matrix is factorized with pivoting.
    pivots_next: bool,
    /// Whether the current factors are those with pivoting.
    is_pivoted: bool,
    check: bool,
    rhs: Vec<T>,
    residual: Vec<T>,
    scale: Vec<f64>,
}

impl<T: Scalar> SparseSystem<T> {
    /// Allocates a matrix and its factors.
    pub fn new(elimination: Arc<Elimination>) -> Self {
        let n = elimination.n;
        Self {
            direct: elimination.factors(),
            pivoting: None,
            pivots_next: false,
            is_pivoted: false,
            values: vec![T::zero(); elimination.n_entries],
            check: true,
            rhs: vec![T::zero(); n],
            residual: vec![T::zero(); n],
            scale: vec![0.0; n],
            elimination,
        }
    }

    /// Returns the values in the order of the pattern, to be set before [`renew`](Self::renew).
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
    /// [`SparseError::Singular`] and other errors of the factorization.
    pub fn renew(&mut self, work: &mut LinearWork) -> Result<(), SparseError> {
        self.check = true;
        if self.pivots_next {
            return self.pivot(work).map(drop);
        }
        let Err(failure) = self.direct.renew(&self.values) else {
            self.is_pivoted = false;
            self.count(work);
            return Ok(());
        };
        if self.pivot(work)? {
            Ok(())
        } else {
            Err(failure)
        }
    }

    /// Switches to pivoting permanently and factorizes. Returns `false` if an engine factorizes, which handles pivoting
    /// itself.
    fn pivot(&mut self, work: &mut LinearWork) -> Result<bool, SparseError> {
        if self.pivoting.is_none() {
            self.pivoting = self.elimination.pivoting()?;
        }
        let Some(factors) = &mut self.pivoting else {
            return Ok(false);
        };
        if !self.pivots_next {
            // Pivots chosen before a history was set do not belong to it.
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
        work.factor_entries = self.factors().n_entries().unwrap_or(0) as u64;
    }

    /// Returns the [pivots](Factorization::pivots) of the last matrix by unknown; `None` after a factorization with
    /// pivoting.
    pub fn pivots(&self) -> Option<Vec<T>> {
        match self.is_pivoted {
            true => None,
            false => self.direct.pivots(),
        }
    }

    /// Number of pivot choices that later matrices keep.
    pub fn pivot_choices(&self) -> u64 {
        self.pivoting.as_ref().map_or(0, Factors::pivot_choices)
    }

    /// Makes the next matrix choose new pivots, if pivoting is active.
    pub fn forget_pivots(&mut self) {
        if let Some(factors) = &mut self.pivoting {
            factors.forget_pivots();
        }
    }

    /// Returns whether the next matrix is factorized with pivoting and whether the next solution is checked.
    pub fn history(&self) -> [bool; 2] {
        [self.pivots_next, self.check]
    }

    /// Continues with a [`history`](Self::history). The current factors stay in use until the next
    /// [`renew`](Self::renew).
    ///
    /// # Errors
    /// Errors of the analysis.
    pub fn set_history(&mut self, [pivoting, check]: [bool; 2]) -> Result<(), SparseError> {
        (self.pivots_next, self.check) = (pivoting, check);
        if pivoting && self.pivoting.is_none() {
            self.pivoting = self.elimination.pivoting()?;
        }
        Ok(())
    }

    /// The factors in use.
    fn factors(&mut self) -> &mut dyn Factorization<T> {
        match &mut self.pivoting {
            Some(factors) if self.is_pivoted => factors,
            _ => &mut *self.direct,
        }
    }

    /// Solves in place.
    ///
    /// The first solution after a factorization is checked. If it needs refinement, so do all others with these
    /// factors; if refinement does not help, the matrix is factorized with pivoting. A zero right-hand side cannot be
    /// checked, so the check is deferred to the next one.
    ///
    /// # Errors
    /// [`SparseError::Inaccurate`] if the backward error stays large, [`SparseError::NotFinite`] for a right-hand side
    /// that is not finite, and errors of the solve.
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
        if error > REFINEMENT_THRESHOLD && !self.is_pivoted && self.pivot(work)? {
            x.copy_from_slice(&self.rhs);
            error = self.solve_and_refine(x, work)?;
        }
        if error.is_infinite()
            || (error > REJECTION_THRESHOLD && self.normwise_error() > REJECTION_THRESHOLD)
        {
            let n = x.len();
            return Err(SparseError::Inaccurate {
                n,
                backward_error: error,
            });
        }
        work.largest_backward_error = work.largest_backward_error.max(error);
        Ok(())
    }

    /// Solves in place for several right-hand sides, stored by rows. Solutions are not checked: the caller is expected
    /// to iterate and to check the residual.
    ///
    /// # Errors
    /// Errors of the solve.
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
    /// Errors of the solve.
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
        self.check = error > REFINEMENT_THRESHOLD;
        for _ in 0..MAX_REFINEMENTS {
            if error <= REFINEMENT_THRESHOLD {
                break;
            }
            work.refinements += 1;
            let mut correction = std::mem::take(&mut self.residual);
            let solved = self.factors().solve(&mut correction);
            self.residual = correction;
            solved?;
            for (x, &correction) in x.iter_mut().zip(&self.residual) {
                *x += correction;
            }
            error = self.backward_error(x);
        }
        Ok(error)
    }

    /// Returns max_i |b − A x|_i / max_i (|A||x| + |b|)_i of the last checked solution. The right-hand sides of a body at
    /// rest consist of rounding errors, with some rows far smaller than others; the componentwise error is meaningless
    /// there.
    fn normwise_error(&self) -> f64 {
        let largest = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, f64::max);
        let residual = largest(&mut self.residual.iter().map(|r| r.abs()));
        let scale = largest(&mut self.scale.iter().copied());
        match residual.is_finite() && scale >= f64::MIN_POSITIVE / f64::EPSILON {
            true => residual / scale,
            false if scale.is_finite() && residual.is_finite() => 0.0,
            false => f64::INFINITY,
        }
    }

    /// Returns max_i |b − A x|_i / (|A||x| + |b|)_i, infinite if it is NaN, and stores b − A x in `residual`. The error
    /// does not depend on the scaling of rows and columns, which differs by many orders of magnitude here.
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
