//! Settings of factorizations.

/// Fill-reducing ordering of the columns (with AMD also of the rows).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Ordering {
    /// Approximate minimum degree on the pattern of A + Aᵀ, for nearly symmetric patterns.
    #[default]
    Amd,
    /// Approximate minimum degree on the pattern of AᵀA, which is not formed.
    Colamd,
    /// The given order.
    Natural,
}

impl Ordering {
    /// KLU's code of this ordering.
    #[cfg(klu)]
    fn code(self) -> i64 {
        match self {
            Self::Amd => 0,
            Self::Colamd => 1,
            Self::Natural => 2,
        }
    }
}

/// Scaling of the rows before factorization.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Scaling {
    /// No scaling.
    None,
    /// Scaling by the sum of the absolute values of the row.
    Sum,
    /// Scaling by the largest absolute value of the row.
    #[default]
    Max,
}

#[cfg(klu)]
impl Scaling {
    fn code(self) -> i64 {
        match self {
            Self::None => 0,
            Self::Sum => 1,
            Self::Max => 2,
        }
    }
}

/// Precision of factors. Matrices and solutions are always in double precision.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Precision {
    /// Double precision.
    #[default]
    Double,
    /// Single precision with iterative refinement, and double precision if the refinement does not converge. For
    /// Newton's method: after a factorization, only the first solution is refined if its error was small.
    Mixed,
    /// [`Mixed`](Self::Mixed) for large matrices.
    Auto,
}

/// Settings of factorizations. Except for `precision`, they apply to factorizations with pivoting; the defaults are KLU's.
/// faer, which replaces KLU in builds without it, ignores them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SparseOptions {
    /// Precision of factors without pivoting; [`Precision::Double`] by default.
    pub precision: Precision,
    /// Fill-reducing ordering; [`Ordering::Amd`] by default.
    pub ordering: Ordering,
    /// Whether to permute to block triangular form first; on by default. The permutation starts from a maximum
    /// transversal, which may move the pivots off a good diagonal.
    pub btf: bool,
    /// Scaling of the rows; [`Scaling::Max`] by default.
    pub scaling: Scaling,
    /// The diagonal entry is the pivot if it is at least this fraction of the largest entry of its column; 0.001 by
    /// default.
    pub pivot_tolerance: f64,
}

/// The settings in KLU's coding, as in its control block.
#[cfg(klu)]
#[derive(Debug, Clone, Copy)]
pub(crate) struct RawOptions {
    /// 0: AMD; 1: COLAMD; 2: natural.
    pub(crate) ordering: i64,
    /// Whether to permute to block triangular form: 0 or 1.
    pub(crate) btf: i64,
    /// 0: no scaling; 1: by the sum, 2: by the largest entry of each row.
    pub(crate) scale: i64,
    /// The diagonal pivot is preferred above this fraction of the largest entry.
    pub(crate) pivot_tolerance: f64,
}

impl Default for SparseOptions {
    fn default() -> Self {
        Self {
            precision: Precision::default(),
            ordering: Ordering::default(),
            btf: true,
            scaling: Scaling::default(),
            pivot_tolerance: 0.001,
        }
    }
}

#[cfg(klu)]
impl SparseOptions {
    /// Converts the settings to KLU's coding.
    pub(crate) fn raw(self) -> RawOptions {
        RawOptions {
            ordering: self.ordering.code(),
            btf: i64::from(self.btf),
            scale: self.scaling.code(),
            pivot_tolerance: self.pivot_tolerance,
        }
    }
}
