//! A sparse linear system: factorised by dense blocks, checked, and with exchange of pivots where that is
//! not enough; or factorised by an engine from outside, and checked.

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

/// Solutions with a larger backward error are refined. Good pivots leave a few ε times the length
/// of a row; at 1e-12 four digits are gone, and a refinement, which costs as much as a solve,
/// brings them back.
const REFINE_ABOVE: f64 = 1e-12;

/// Refinements of one solution. The first contracts the error by the backward error before it;
/// if two do not do, more will not, and pivots must be exchanged.
const MAX_REFINEMENTS: usize = 2;

/// Solutions with a larger backward error, refined and with exchange of pivots, are refused: half
/// of the digits of the matrix are lost, √ε.
const REFUSE_ABOVE: f64 = 1.490_116_119_384_765_6e-8;

/// Matrices that take more multiplications are not given to a solver that exchanges pivots. Its
/// scalar loops and its order, which ignores dissection, take a hundred times the time of dense
/// blocks there: 8 s instead of 0.1 s for a body of 10⁴ unknowns (1e9), hours beyond.
const EXCHANGE_UP_TO: f64 = 1e9;

/// Matrices that take more multiplications are factorised in threads, if there are
/// [some](resources::use_threads): below some milliseconds waking them is not worth it.
const THREADS_FROM: f64 = 1e8;

/// What is known of a matrix beyond its pattern.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Structure {
    /// Whether it is symmetric.
    pub kind: Kind,
    /// Unknowns whose own entries on the diagonal are no pivots to begin with, because they are
    /// small (the pressures of a nearly incompressible body); those without entry need not be named.
    pub constraints: Range<usize>,
}

/// The pattern of a matrix and the order in which it is eliminated: all that real and complex
/// matrices with that pattern share.
#[derive(Debug)]
pub struct Elimination {
    n: usize,
    n_entries: usize,
    product: Product,
    way: Way,
}

/// Who factorises.
#[derive(Debug)]
enum Way {
    Blocks(Box<Blocks>),
    Engine {
        engine: Arc<dyn Engine>,
        pattern: Arc<SparsityPattern>,
        kind: Kind,
    },
}

/// By dense blocks, and with exchange of pivots where they do not do.
#[derive(Debug)]
struct Blocks {
    /// For exchange of pivots, of a matrix that is not too large for that.
    pattern: Option<SparsityPattern>,
    options: SparseOptions,
    analysis: Arc<Analysis>,
    threads: Option<Arc<ThreadPool>>,
}

impl Elimination {
    /// Analyses the compressed-column `pattern`, or leaves it to the [`engine`] if one is installed; the
    /// `options` are for KLU, should pivots have to be exchanged.
    ///
    /// # Errors
    /// [`SparseError::NotSquare`], [`SparseError::EmptyColumn`].
    pub fn new(
        pattern: &SparsityPattern,
        structure: Structure,
        options: SparseOptions,
    ) -> Result<Self, SparseError> {
        if let Some(engine) = engine::installed() {
            return Ok(Self::by(engine, pattern, structure.kind));
        }
        let analysis = Analysis::new(pattern, structure.kind, structure.constraints)?;
        let work = analysis.n_multiplications();
        let blocks = Blocks {
            pattern: (work <= EXCHANGE_UP_TO).then(|| pattern.clone()),
            options,
            analysis: Arc::new(analysis),
            threads: resources::threads().filter(|_| work > THREADS_FROM),
        };
        Ok(Self::of(pattern, Way::Blocks(Box::new(blocks))))
    }

    /// Leaves matrices with this compressed-column `pattern` to an `engine`.
    pub fn by(engine: Arc<dyn Engine>, pattern: &SparsityPattern, kind: Kind) -> Self {
        let way = Way::Engine {
            engine,
            pattern: Arc::new(pattern.clone()),
            kind,
        };
        Self::of(pattern, way)
    }

    fn of(pattern: &SparsityPattern, way: Way) -> Self {
        Self {
            n: pattern.major_dim(),
            n_entries: pattern.nnz(),
            product: Product::new(pattern),
            way,
        }
    }

    /// Factorises in this many threads; an engine has its own. Results do not depend on the number.
    ///
    /// # Errors
    /// [`SparseError::Threads`].
    pub fn in_threads(mut self, threads: usize) -> Result<Self, SparseError> {
        if let Way::Blocks(blocks) = &mut self.way {
            blocks.threads = match threads {
                0 | 1 => None,
                _ => Some(resources::pool_of(threads)?),
            };
        }
        Ok(self)
    }

    /// Room for a matrix and its factors.
    fn factors<T: Scalar>(&self) -> Box<dyn Factorization<T>> {
        match &self.way {
            Way::Blocks(blocks) => {
                let (analysis, threads) = (blocks.analysis.clone(), blocks.threads.clone());
                Box::new(Supernodal::in_threads(analysis, threads))
            }
            Way::Engine {
                engine,
                pattern,
                kind,
            } => T::factors_of(&**engine, pattern, *kind),
        }
    }

    /// Room for factors with exchange of pivots; none where an engine exchanges them.
    fn pivoting<T: Scalar>(&self) -> Result<Option<Factors<T>>, SparseError> {
        let Way::Blocks(blocks) = &self.way else {
            return Ok(None);
        };
        let pattern = blocks.pattern.as_ref();
        let pattern = pattern.ok_or(SparseError::TooLargeToPivot { n: self.n })?;
        let symbolic = Symbolic::analyze(pattern, blocks.options)?;
        Ok(Some(Factors::new(symbolic)))
    }

    /// The supernodes; none if an engine factorises.
    pub fn analysis(&self) -> Option<&Arc<Analysis>> {
        match &self.way {
            Way::Blocks(blocks) => Some(&blocks.analysis),
            Way::Engine { .. } => None,
        }
    }

    /// Refuses a real matrix whose factors will not fit into the memory.
    ///
    /// # Errors
    /// [`SparseError::Memory`].
    pub fn expect_room(&self) -> Result<(), SparseError> {
        let needed = self.prediction::<f64>().map_or(0, |needs| needs.bytes);
        resources::expect_room(needed, 0)
    }

    /// What one matrix of numbers `T` and its factors will need; unknown if an engine factorises.
    /// Matrices with one pattern share the analysis, which is counted in each.
    pub fn prediction<T: Scalar>(&self) -> Option<Prediction> {
        let Way::Blocks(blocks) = &self.way else {
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
    /// By dense blocks or by an engine.
    direct: Box<dyn Factorization<T>>,
    /// With exchange of pivots, once the blocks' fixed pivots have failed.
    pivoting: Option<Factors<T>>,
    check: bool,
    rhs: Vec<T>,
    residual: Vec<T>,
    scale: Vec<f64>,
}

impl<T: Scalar> SparseSystem<T> {
    /// Room for a matrix and its factors.
    pub fn new(elimination: Arc<Elimination>) -> Self {
        let n = elimination.n;
        Self {
            direct: elimination.factors(),
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
    /// [`SparseError::Singular`] and others of the factorisation.
    pub fn renew(&mut self, work: &mut LinearWork) -> Result<(), SparseError> {
        self.check = true;
        if self.pivoting.is_some() {
            return self.pivot(work).map(drop);
        }
        let Err(failure) = self.direct.renew(&self.values) else {
            self.count(work);
            return Ok(());
        };
        if self.pivot(work)? {
            Ok(())
        } else {
            Err(failure)
        }
    }

    /// Factorises with exchange of pivots, now and from now on; `false` where an engine does that
    /// already.
    fn pivot(&mut self, work: &mut LinearWork) -> Result<bool, SparseError> {
        if self.pivoting.is_none() {
            self.pivoting = self.elimination.pivoting()?;
        }
        let Some(factors) = &mut self.pivoting else {
            return Ok(false);
        };
        factors.renew(&self.values)?;
        work.pivoted += 1;
        self.count(work);
        Ok(true)
    }

    fn count(&mut self, work: &mut LinearWork) {
        work.factorizations += 1;
        work.factor_entries = self.factors().n_entries().unwrap_or(0) as u64;
    }

    /// The [pivots](Factorization::pivots) of the last matrix by unknown; none if they were exchanged.
    pub fn pivots(&self) -> Option<Vec<T>> {
        match self.pivoting {
            Some(_) => None,
            None => self.direct.pivots(),
        }
    }

    /// How often pivots were chosen that later matrices keep.
    pub fn pivot_choices(&self) -> u64 {
        self.pivoting.as_ref().map_or(0, Factors::pivot_choices)
    }

    /// Makes the next matrix choose its pivots anew, where they are exchanged.
    pub fn forget_pivots(&mut self) {
        if let Some(factors) = &mut self.pivoting {
            factors.forget_pivots();
        }
    }

    /// Whether pivots are exchanged, and whether the next solution is checked.
    pub fn history(&self) -> [bool; 2] {
        [self.pivoting.is_some(), self.check]
    }

    /// Goes on with a [`history`](Self::history).
    ///
    /// # Errors
    /// Those of the analysis.
    pub fn set_history(&mut self, [pivoting, check]: [bool; 2]) -> Result<(), SparseError> {
        self.check = check;
        if pivoting && self.pivoting.is_none() {
            self.pivoting = self.elimination.pivoting()?;
        }
        Ok(())
    }

    /// The factors in use.
    fn factors(&mut self) -> &mut dyn Factorization<T> {
        match &mut self.pivoting {
            Some(factors) => factors,
            None => &mut *self.direct,
        }
    }

    /// Solves in place. The first solution with new factors is checked; if it needs refinement,
    /// so do all others with these factors; if refinement does not help, pivots are exchanged. A
    /// right-hand side of zeros checks nothing, so the next is checked.
    ///
    /// # Errors
    /// [`SparseError::Inaccurate`] if all that does not help, [`SparseError::NotFinite`] for such
    /// a right-hand side, and those of the solve.
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
        if error > REFINE_ABOVE && self.pivoting.is_none() && self.pivot(work)? {
            x.copy_from_slice(&self.rhs);
            error = self.solve_and_refine(x, work)?;
        }
        work.largest_backward_error = work.largest_backward_error.max(error);
        if error.is_infinite() || (error > REFUSE_ABOVE && self.normwise_error() > REFUSE_ABOVE) {
            let n = x.len();
            return Err(SparseError::Inaccurate {
                n,
                backward_error: error,
            });
        }
        Ok(())
    }

    /// Solves in place for several right-hand sides, the numbers of a row side by side. Solutions are not
    /// checked: they are meant for those who iterate, and see what is left.
    ///
    /// # Errors
    /// Those of the solve.
    pub fn solve_columns(
        &mut self,
        x: &mut [T],
        n_columns: usize,
        work: &mut LinearWork,
    ) -> Result<(), SparseError> {
        work.solves += n_columns as u64;
        self.factors().solve_columns(x, n_columns)
    }

    /// Solves with the transpose (not conjugated) in place. The solution is not checked: it is meant
    /// for those who iterate, and see what is left.
    ///
    /// # Errors
    /// Those of the solve.
    pub fn solve_transposed(
        &mut self,
        x: &mut [T],
        work: &mut LinearWork,
    ) -> Result<(), SparseError> {
        work.solves += 1;
        self.factors().solve_transposed(x)
    }

    /// Solves for `x` = b, a copy of which is in `rhs`, and returns the backward error.
    fn solve_and_refine(&mut self, x: &mut [T], work: &mut LinearWork) -> Result<f64, SparseError> {
        self.factors().solve(x)?;
        let mut error = self.backward_error(x);
        self.check = error > REFINE_ABOVE;
        for _ in 0..MAX_REFINEMENTS {
            if error <= REFINE_ABOVE {
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

    /// max_i |b − A x|_i / max_i (|A||x| + |b|)_i of the solution checked last. A body at rest has
    /// right-hand sides of rounding alone, some rows far smaller than others: there the
    /// componentwise error says nothing of the solution.
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
