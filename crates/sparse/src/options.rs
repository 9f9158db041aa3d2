//! Settings of factorizations.

/// Fill-reducing ordering of the columns (and, with AMD, also of the rows).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Ordering {
    /// Approximate minimum degree on the pattern of A + Aᵀ, for nearly symmetric patterns.
    #[default]
    Amd,
    /// Approximate minimum degree on the pattern of AᵀA, which is not formed.
    Colamd,
    /// The given order, unchanged.
    Natural,
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

/// Precision of factors. Matrices and solutions are always in double precision.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Precision {
    /// Double precision.
    #[default]
    Double,
    /// Single precision with iterative refinement, and double precision if the refinement does not converge. Intended
    /// for Newton's method: if the first solution after a factorization has a small error, later solutions are not
    /// refined.
    Mixed,
    /// [`Mixed`](Self::Mixed) for large matrices.
    Auto,
}

/// Settings of factorizations. All of them except `precision` apply only to factorizations with pivoting. The defaults
/// are the defaults of KLU. In builds without KLU, faer is used instead and ignores these settings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SparseOptions {
    /// Precision of factors with fixed pivots; [`Precision::Double`] by default.
    pub precision: Precision,
    /// Fill-reducing ordering; [`Ordering::Amd`] by default.
    pub ordering: Ordering,
    /// Whether to permute the matrix to block triangular form first; on by default. The permutation starts from a
    /// maximum transversal, which may replace good diagonal pivots by other entries.
    pub btf: bool,
    /// Scaling of the rows; [`Scaling::Max`] by default.
    pub scaling: Scaling,
    /// The diagonal entry is selected as the pivot if it is at least this fraction of the largest entry of its column;
    /// 0.001 by default.
    pub pivot_tolerance: f64,
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
