//! KLU, the sparse direct solver for unsymmetric systems that are nearly block triangular.
//!
//! A pattern is analysed once ([`Symbolic`]: ordering and block triangular form); matrices with
//! that pattern are then factorised ([`Numeric::factor`]), refactorised with the pivots kept
//! ([`Numeric::refactor`], several times cheaper) and solved with ([`Numeric::solve`]). Real and
//! complex matrices with the same pattern share one analysis. Neither a refactorisation nor a
//! solve allocates.
//!
//! # Examples
//! ```
//! use nalgebra_sparse::pattern::SparsityPattern;
//! use sundials_wrap::klu::{KluOptions, RealNumeric, Symbolic};
//!
//! // A = [2 1; 0 4], stored by columns.
//! let pattern = SparsityPattern::try_from_offsets_and_indices(2, 2, vec![0, 1, 3], vec![0, 0, 1])?;
//! let symbolic = Symbolic::analyze(&pattern, KluOptions::default())?;
//! let lu = RealNumeric::factor(&symbolic, &[2.0, 1.0, 4.0])?;
//! let mut x = [4.0, 8.0];
//! lu.solve(&mut x)?;
//! assert_eq!(x, [1.0, 2.0]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # References
//! - T. A. Davis, E. Palamadai Natarajan, Algorithm 907: KLU, a direct sparse solver for circuit
//!   simulation problems, ACM Trans. Math. Softw. 37 (2010) 36.

use std::sync::Arc;

use nalgebra_sparse::pattern::SparsityPattern;
use num_complex::Complex64;

pub use crate::factors::{Factors, Pivots};
use crate::ffi;
use crate::ffi::klu::{RawNumeric, RawOptions, RawSymbolic};
use crate::problem::StepError;

/// What can go wrong with a factorisation.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum KluError {
    /// The pattern is not square, or empty.
    #[error("a {rows} × {columns} pattern cannot be factorised: it must be square and not empty")]
    NotSquare {
        /// Number of rows.
        rows: usize,
        /// Number of columns.
        columns: usize,
    },
    /// The matrix is singular, by its pattern or by its values.
    #[error("the {n} × {n} matrix is singular{}", at_column(*column))]
    Singular {
        /// Order of the matrix.
        n: usize,
        /// The column in which no pivot was left, if KLU names one.
        column: Option<usize>,
    },
    /// An array has the wrong length.
    #[error("{what}: expected {expected}, got {got}")]
    WrongLength {
        /// Which array.
        what: &'static str,
        /// The length it should have.
        expected: usize,
        /// The length it has.
        got: usize,
    },
    /// A value of the matrix is infinite or not a number.
    #[error("value {position} of the matrix is not finite")]
    NotFinite {
        /// Position in the array of values.
        position: usize,
    },
    /// The last refactorisation failed; there are no factors to solve with.
    #[error("no factors to use: the last refactorisation failed")]
    NoFactors,
    /// KLU itself gave up: out of memory, or the problem is too large.
    #[error("KLU failed with status {status} ({})", status_name(*status))]
    Failed {
        /// KLU's status code.
        status: i64,
    },
}

fn at_column(column: Option<usize>) -> String {
    column
        .map(|c| format!(" (no pivot in column {c})"))
        .unwrap_or_default()
}

fn status_name(status: i64) -> &'static str {
    match status {
        -2 => "out of memory",
        -3 => "invalid matrix",
        -4 => "too large",
        _ => "unknown",
    }
}

/// How the columns (and with AMD also the rows) are ordered to keep the factors sparse.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Ordering {
    /// Approximate minimum degree on the pattern of A + Aᵀ: for nearly symmetric patterns.
    #[default]
    Amd,
    /// Approximate minimum degree on the pattern of AᵀA, without forming it.
    Colamd,
    /// The order given.
    Natural,
}

impl Ordering {
    /// The number KLU uses for this ordering.
    fn code(self) -> i64 {
        match self {
            Self::Amd => 0,
            Self::Colamd => 1,
            Self::Natural => 2,
        }
    }
}

/// How the rows are scaled before factorisation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Scaling {
    /// Not at all.
    None,
    /// By the sum of the absolute values of the row.
    Sum,
    /// By the largest absolute value of the row.
    #[default]
    Max,
}

impl Scaling {
    fn code(self) -> i64 {
        match self {
            Self::None => 0,
            Self::Sum => 1,
            Self::Max => 2,
        }
    }
}

/// The settings of KLU. The defaults are KLU's own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KluOptions {
    /// Fill-reducing ordering; [`Ordering::Amd`] by default.
    pub ordering: Ordering,
    /// Whether to permute to block triangular form first; on by default. This starts from a
    /// maximum transversal, which may move the pivots off a good natural diagonal.
    pub btf: bool,
    /// Scaling of the rows; [`Scaling::Max`] by default.
    pub scaling: Scaling,
    /// The diagonal is the pivot if it is at least this fraction of the largest entry of its
    /// column; 0.001 by default.
    pub pivot_tolerance: f64,
}

impl Default for KluOptions {
    fn default() -> Self {
        Self {
            ordering: Ordering::default(),
            btf: true,
            scaling: Scaling::default(),
            pivot_tolerance: 0.001,
        }
    }
}

impl KluOptions {
    pub(crate) fn raw(self) -> RawOptions {
        RawOptions {
            ordering: self.ordering.code(),
            btf: i64::from(self.btf),
            scale: self.scaling.code(),
            pivot_tolerance: self.pivot_tolerance,
        }
    }
}

/// The analysis of a sparsity pattern: orderings and block triangular form.
///
/// A handle: clones share one analysis, so a real and a complex factorisation of matrices with the
/// same pattern analyse it once.
#[derive(Clone)]
pub struct Symbolic {
    raw: Arc<RawSymbolic>,
}

impl Symbolic {
    /// Analyses the compressed-column `pattern` (major dimension: columns).
    ///
    /// # Errors
    /// [`KluError::NotSquare`], or [`KluError::Failed`] when memory runs out. A structurally
    /// singular pattern is found at the factorisation.
    pub fn analyze(pattern: &SparsityPattern, options: KluOptions) -> Result<Self, KluError> {
        let (rows, columns) = (pattern.minor_dim(), pattern.major_dim());
        if rows != columns || rows == 0 {
            return Err(KluError::NotSquare { rows, columns });
        }
        let raw = RawSymbolic::analyze(
            widened(pattern.major_offsets()),
            widened(pattern.minor_indices()),
            options.raw(),
        )
        .map_err(|failure| KluError::from_failure(rows, failure))?;
        Ok(Self { raw: Arc::new(raw) })
    }

    /// Order of the matrix.
    pub fn n(&self) -> usize {
        self.raw.n()
    }

    /// Entries of the pattern.
    pub fn nnz(&self) -> usize {
        self.raw.nnz()
    }

    /// The columns in the order of elimination.
    pub fn column_order(&self) -> Vec<usize> {
        self.raw.column_order()
    }

    /// The largest rank a matrix with this pattern can have; `None` when it was not looked for:
    /// without block triangular form, and with [`Ordering::Natural`].
    pub fn structural_rank(&self) -> Option<usize> {
        usize::try_from(self.raw.structural_rank()).ok()
    }
}

impl std::fmt::Debug for Symbolic {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Symbolic")
            .field("n", &self.n())
            .field("nnz", &self.nnz())
            .finish()
    }
}

/// The 64-bit indices of the C libraries; a length in memory always fits.
pub(crate) fn widened(indices: &[usize]) -> Box<[i64]> {
    indices.iter().map(|&i| i as i64).collect()
}

mod sealed {
    pub trait Sealed {}
    impl Sealed for f64 {}
    impl Sealed for super::Complex64 {}
}

/// A number KLU factorises with: `f64` or `Complex64`.
pub trait Scalar: sealed::Sealed + ffi::klu::Entry {
    /// Whether all parts of the number are finite.
    fn is_finite(self) -> bool;
}

impl Scalar for f64 {
    fn is_finite(self) -> bool {
        self.is_finite()
    }
}

impl Scalar for Complex64 {
    fn is_finite(self) -> bool {
        Complex64::is_finite(self)
    }
}

/// LU factors of a real matrix.
pub type RealNumeric = Numeric<f64>;
/// LU factors of a complex matrix.
pub type ComplexNumeric = Numeric<Complex64>;

/// The LU factors of a matrix, of real or complex numbers.
///
/// `Send`, but not `Sync`: a solve uses workspace inside.
pub struct Numeric<T: Scalar> {
    symbolic: Symbolic,
    raw: RawNumeric<T>,
    usable: bool,
}

impl<T: Scalar> Numeric<T> {
    /// Factorises the matrix with the analysed pattern and these `values`, choosing pivots.
    ///
    /// # Shapes
    /// `values`: one per entry of the pattern, in its order.
    ///
    /// # Errors
    /// [`KluError::Singular`], [`KluError::NotFinite`], [`KluError::WrongLength`] or
    /// [`KluError::Failed`].
    pub fn factor(symbolic: &Symbolic, values: &[T]) -> Result<Self, KluError> {
        check_values(symbolic, values)?;
        let raw = RawNumeric::factor(Arc::clone(&symbolic.raw), values)
            .map_err(|failure| KluError::from_failure(symbolic.n(), failure))?;
        Ok(Self {
            symbolic: symbolic.clone(),
            raw,
            usable: true,
        })
    }

    /// Recomputes the factors for new `values`, keeping the pivots chosen by
    /// [`factor`](Numeric::factor). Watch [`rcond`](Numeric::rcond): when the values have changed
    /// much, the old pivots may be poor and a fresh `factor` is due.
    ///
    /// # Errors
    /// As for [`factor`](Numeric::factor). After [`KluError::Singular`] there are no factors until
    /// another refactorisation succeeds; the other errors leave the old ones in place.
    pub fn refactor(&mut self, values: &[T]) -> Result<(), KluError> {
        check_values(&self.symbolic, values)?;
        let outcome = self.raw.refactor(values);
        self.usable = outcome.is_ok();
        outcome.map_err(|failure| KluError::from_failure(self.symbolic.n(), failure))
    }

    /// Solves A x = b in place.
    ///
    /// # Shapes
    /// `rhs`: one right-hand side of length [`n`](Symbolic::n), or several, one after the other.
    ///
    /// # Errors
    /// [`KluError::WrongLength`] for a length that is no multiple of n, [`KluError::NoFactors`]
    /// after a failed refactorisation.
    pub fn solve(&self, rhs: &mut [T]) -> Result<(), KluError> {
        self.solve_either(rhs, false)
    }

    /// Solves Aᵀ x = b in place (transposed, not conjugated); otherwise as
    /// [`solve`](Numeric::solve).
    ///
    /// # Errors
    /// As for [`solve`](Numeric::solve).
    pub fn solve_transposed(&self, rhs: &mut [T]) -> Result<(), KluError> {
        self.solve_either(rhs, true)
    }

    fn solve_either(&self, rhs: &mut [T], transposed: bool) -> Result<(), KluError> {
        let n = self.symbolic.n();
        if !rhs.len().is_multiple_of(n) {
            let what = "right-hand sides (a multiple of the order)";
            return Err(KluError::WrongLength {
                what,
                expected: n,
                got: rhs.len(),
            });
        }
        self.usable()?;
        self.checked(self.raw.solve(rhs, transposed))
    }

    /// Cheap estimate of the reciprocal condition number: min |u_kk| / max |u_kk|.
    ///
    /// # Errors
    /// [`KluError::NoFactors`] after a failed refactorisation.
    pub fn rcond(&self) -> Result<f64, KluError> {
        self.usable()?;
        self.checked(self.raw.rcond())
    }

    /// Estimate of the condition number in the 1-norm (Hager, Higham): a few solves.
    ///
    /// # Errors
    /// [`KluError::WrongLength`] for the `values` of another pattern, [`KluError::NoFactors`].
    pub fn condest(&self, values: &[T]) -> Result<f64, KluError> {
        check_values(&self.symbolic, values)?;
        self.usable()?;
        self.checked(self.raw.condest(values))
    }

    /// Reciprocal pivot growth, min over the columns j of max |a_ij| / max |u_ij|: near 1 when the
    /// elimination was stable, tiny when it was not.
    ///
    /// # Errors
    /// As for [`condest`](Numeric::condest).
    pub fn rgrowth(&self, values: &[T]) -> Result<f64, KluError> {
        check_values(&self.symbolic, values)?;
        self.usable()?;
        self.checked(self.raw.rgrowth(values))
    }

    /// Entries of L and of U (the diagonal of each included), off-diagonal blocks left out.
    pub fn nnz_factors(&self) -> (usize, usize) {
        self.raw.nnz_factors()
    }

    /// Floating-point operations of one factorisation.
    ///
    /// # Errors
    /// [`KluError::NoFactors`] after a failed refactorisation.
    pub fn flops(&self) -> Result<f64, KluError> {
        self.usable()?;
        self.checked(self.raw.flops())
    }

    /// The analysis these factors belong to.
    pub fn symbolic(&self) -> &Symbolic {
        &self.symbolic
    }

    fn usable(&self) -> Result<(), KluError> {
        if self.usable {
            Ok(())
        } else {
            Err(KluError::NoFactors)
        }
    }

    fn checked<R>(&self, result: Result<R, ffi::klu::Failure>) -> Result<R, KluError> {
        result.map_err(|failure| KluError::from_failure(self.symbolic.n(), failure))
    }
}

impl<T: Scalar> std::fmt::Debug for Numeric<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Numeric")
            .field("symbolic", &self.symbolic)
            .field("nnz_factors", &self.nnz_factors())
            .field("usable", &self.usable)
            .finish()
    }
}

/// A singular or infinite matrix may become a good one with a smaller step; nothing else may.
impl From<KluError> for StepError {
    fn from(error: KluError) -> Self {
        match error {
            KluError::Singular { .. } | KluError::NotFinite { .. } => {
                Self::Recoverable(error.to_string())
            }
            other => Self::Fatal(Box::new(other)),
        }
    }
}

impl KluError {
    fn from_failure(n: usize, failure: ffi::klu::Failure) -> Self {
        if failure.is_singular() {
            // KLU counts columns from 0 and says n for "none".
            let column = usize::try_from(failure.singular_column)
                .ok()
                .filter(|&c| c < n);
            Self::Singular { n, column }
        } else {
            Self::Failed {
                status: failure.status,
            }
        }
    }
}

fn check_values<T: Scalar>(symbolic: &Symbolic, values: &[T]) -> Result<(), KluError> {
    if values.len() != symbolic.nnz() {
        let what = "values of the matrix";
        return Err(KluError::WrongLength {
            what,
            expected: symbolic.nnz(),
            got: values.len(),
        });
    }
    match values.iter().position(|&v| !Scalar::is_finite(v)) {
        Some(position) => Err(KluError::NotFinite { position }),
        None => Ok(()),
    }
}
