//! Pattern of a matrix, order of elimination, and the backend that factorizes.

use std::ops::Range;
use std::sync::Arc;

use nalgebra_sparse::pattern::SparsityPattern;
use rayon::ThreadPool;

use crate::engine::{self, Engine};
use crate::options::{Precision, SparseOptions};
use crate::pivoting::{Factors, Symbolic};
use crate::product::Product;
use crate::resources;
use crate::single::SingleFactors;
use crate::supernodal::{Analysis, Supernodal};
use crate::{Factorization, Kind, Prediction, Scalar, SparseError};

/// Maximum number of multiplications for the pivoting solver. It uses scalar loops and an ordering without nested
/// dissection, so it takes a hundred times as long as the dense blocks: 8 s instead of 0.1 s for a body with 10⁴
/// unknowns (1e9 multiplications), and hours for larger bodies.
const MAX_PIVOTING_WORK: f64 = 1e9;

/// Number of multiplications above which a matrix is factorized by several [threads](resources::use_threads), if
/// enabled. If the work takes less than a few milliseconds, waking the threads costs more than it saves.
const MIN_THREADED_WORK: f64 = 1e8;

/// Number of multiplications above which [`Precision::Auto`] selects factors in single precision. For smaller matrices,
/// scaling and refinement cost about as much time as the factorization saves.
const MIN_MIXED_WORK: f64 = 1e9;

/// Known structure of a matrix beyond its pattern.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Structure {
    /// Whether the matrix is symmetric.
    pub kind: Kind,
    /// Unknowns whose diagonal entries are too small to be pivots before other unknowns are eliminated, for example the
    /// pressures of a nearly incompressible body. Unknowns without a diagonal entry are detected and need not be
    /// listed.
    pub constraints: Range<usize>,
}

/// Pattern and order of elimination of a matrix, shared by real and complex matrices.
#[derive(Debug)]
pub struct Elimination {
    n: usize,
    n_entries: usize,
    /// See [`Structure::constraints`].
    constraints: Range<usize>,
    product: Arc<Product>,
    precision: Precision,
    backend: Backend,
}

/// Solver that factorizes the matrix.
#[derive(Debug)]
enum Backend {
    Blocks(Box<Blocks>),
    Engine { engine: Arc<dyn Engine>, pattern: Arc<SparsityPattern>, kind: Kind },
}

/// Dense blocks with fixed pivots, with a fallback to pivoting.
#[derive(Debug)]
struct Blocks {
    /// Pattern for the pivoting solver; `None` if the matrix is too large for it.
    pattern: Option<SparsityPattern>,
    options: SparseOptions,
    analysis: Arc<Analysis>,
    threads: Option<Arc<ThreadPool>>,
}

impl Elimination {
    /// Analyzes the compressed-column `pattern`. If an [`engine`] is installed, delegates the pattern to it and ignores
    /// the `options`.
    ///
    /// # Errors
    /// Returns [`SparseError::NotSquare`] or [`SparseError::EmptyColumn`].
    pub fn new(
        pattern: &SparsityPattern,
        structure: Structure,
        options: SparseOptions,
    ) -> Result<Self, SparseError> {
        if let Some(engine) = engine::installed() {
            return Ok(Self::with_engine(engine, pattern, structure.kind));
        }
        let constraints = structure.constraints.clone();
        let analysis = Analysis::new(pattern, structure.kind, structure.constraints)?;
        let work = analysis.n_multiplications();
        let blocks = Blocks {
            pattern: (work <= MAX_PIVOTING_WORK).then(|| pattern.clone()),
            options,
            analysis: Arc::new(analysis),
            threads: resources::threads().filter(|_| work > MIN_THREADED_WORK),
        };
        let backend = Backend::Blocks(Box::new(blocks));
        Ok(Self::of(pattern, constraints, options.precision, backend))
    }

    /// Delegates matrices with this compressed-column `pattern` to an `engine`.
    pub fn with_engine(engine: Arc<dyn Engine>, pattern: &SparsityPattern, kind: Kind) -> Self {
        let backend = Backend::Engine { engine, pattern: Arc::new(pattern.clone()), kind };
        Self::of(pattern, 0..0, Precision::Double, backend)
    }

    fn of(
        pattern: &SparsityPattern,
        constraints: Range<usize>,
        precision: Precision,
        backend: Backend,
    ) -> Self {
        Self {
            constraints,
            n: pattern.major_dim(),
            n_entries: pattern.nnz(),
            product: Arc::new(Product::new(pattern)),
            precision,
            backend,
        }
    }

    /// Uses `threads` threads for factorizations; has no effect on an engine. Results do not depend on the number of
    /// threads.
    ///
    /// # Errors
    /// Returns [`SparseError::Threads`] if the thread pool cannot be created.
    pub fn in_threads(mut self, threads: usize) -> Result<Self, SparseError> {
        if let Backend::Blocks(blocks) = &mut self.backend {
            blocks.threads = match threads {
                0 | 1 => None,
                _ => Some(resources::pool_of(threads)?),
            };
        }
        Ok(self)
    }

    /// Returns whether factors are computed in single precision first, with double precision as the fallback.
    pub(crate) fn is_mixed(&self) -> bool {
        match (&self.backend, self.precision) {
            (Backend::Engine { .. }, _) | (_, Precision::Double) => false,
            (_, Precision::Mixed) => true,
            (Backend::Blocks(blocks), Precision::Auto) => {
                blocks.analysis.n_multiplications() > MIN_MIXED_WORK
            }
        }
    }

    pub(crate) fn n(&self) -> usize {
        self.n
    }

    pub(crate) fn n_entries(&self) -> usize {
        self.n_entries
    }

    /// Returns [`Structure::constraints`].
    pub(crate) fn constraints(&self) -> &Range<usize> {
        &self.constraints
    }

    pub(crate) fn product(&self) -> &Product {
        &self.product
    }

    /// Allocates factors, in single precision if `is_single`.
    pub(crate) fn factors<T: Scalar>(&self, is_single: bool) -> Box<dyn Factorization<T>> {
        match &self.backend {
            Backend::Blocks(blocks) => {
                let (analysis, threads) = (blocks.analysis.clone(), blocks.threads.clone());
                match is_single {
                    true => {
                        let factors = Supernodal::in_threads(analysis, threads);
                        let product = self.product.clone();
                        Box::new(SingleFactors::new(product, self.n, self.n_entries, factors))
                    }
                    false => Box::new(Supernodal::in_threads(analysis, threads)),
                }
            }
            Backend::Engine { engine, pattern, kind } => T::factors_of(&**engine, pattern, *kind),
        }
    }

    /// Allocates factors with pivoting. Returns `None` if an engine factorizes.
    pub(crate) fn pivoting<T: Scalar>(&self) -> Result<Option<Factors<T>>, SparseError> {
        let Backend::Blocks(blocks) = &self.backend else {
            return Ok(None);
        };
        let pattern = blocks.pattern.as_ref();
        let pattern = pattern.ok_or(SparseError::TooLargeToPivot { n: self.n })?;
        let symbolic = Symbolic::analyze(pattern, blocks.options)?;
        Ok(Some(Factors::new(symbolic)))
    }

    /// Returns the analysis, or `None` if an engine factorizes.
    pub fn analysis(&self) -> Option<&Arc<Analysis>> {
        match &self.backend {
            Backend::Blocks(blocks) => Some(&blocks.analysis),
            Backend::Engine { .. } => None,
        }
    }

    /// Checks that the factors of a real matrix fit into memory.
    ///
    /// # Errors
    /// Returns [`SparseError::Memory`] if they do not fit.
    pub fn expect_memory(&self) -> Result<(), SparseError> {
        let needed = self.prediction::<f64>().map_or(0, |needs| needs.bytes);
        resources::expect_memory(needed, 0)
    }

    /// Predicts the cost of one matrix of type `T` and its factors. Returns `None` if an engine factorizes. Each
    /// prediction includes the analysis, although matrices with the same pattern share it.
    pub fn prediction<T: Scalar>(&self) -> Option<Prediction> {
        self.prediction_in::<T>(self.is_mixed())
    }

    /// Predicts the cost of one matrix and its factors, which are in single precision if `is_single`.
    pub(crate) fn prediction_in<T: Scalar>(&self, is_single: bool) -> Option<Prediction> {
        let Backend::Blocks(blocks) = &self.backend else {
            return None;
        };
        let analysis = &blocks.analysis;
        let threads = blocks.threads.as_ref();
        let n_threads = threads.map_or(1, |pool| pool.current_num_threads());
        let kept = Supernodal::<T>::n_kept(analysis, n_threads);
        let of_factors = match is_single {
            true => {
                // The matrix and the right-hand side are copied, and each row has a scaling factor.
                let single = kept + self.n_entries + self.n;
                single * size_of::<T::Single>() + 2 * self.n * size_of::<f64>()
            }
            false => kept * size_of::<T>(),
        };
        let values = (self.n_entries + 2 * self.n) * size_of::<T>();
        let patterns = blocks.pattern.iter();
        let pattern: usize = patterns.map(|p| size_of_val(p.minor_indices())).sum();
        let indices = pattern + self.product.n_bytes();
        let per_multiplication = if T::IS_REAL { 2.0 } else { 8.0 };
        Some(Prediction {
            entries: analysis.n_entries(),
            bytes: of_factors + values + analysis.n_bytes() + indices,
            flops: per_multiplication * analysis.n_multiplications(),
        })
    }
}
