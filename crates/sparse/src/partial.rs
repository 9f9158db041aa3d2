//! LU with partial pivoting, by faer: for any sparse matrix, without a C library.

use std::sync::Arc;

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::sparse::linalg::lu::{
    LuRef, LuSymbolicParams, NumericLu, SymbolicLu, factorize_symbolic_lu,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par};
use nalgebra_sparse::pattern::SparsityPattern;

use crate::error::expect_length;
use crate::finite::expect_finite;
use crate::klu::KluOptions;
use crate::{Factorization, Number, SparseError};

/// The analysis of a pattern.
#[derive(Debug, Clone)]
pub struct Symbolic {
    pattern: Arc<SparsityPattern>,
    lu: Arc<SymbolicLu<usize>>,
}

impl Symbolic {
    /// Analyses the compressed-column `pattern`. The order is COLAMD's; the `options`, which are
    /// KLU's, are not needed.
    ///
    /// # Errors
    /// [`SparseError::NotSquare`].
    pub fn analyze(pattern: &SparsityPattern, _options: KluOptions) -> Result<Self, SparseError> {
        let (rows, columns) = (pattern.minor_dim(), pattern.major_dim());
        if rows != columns || rows == 0 {
            return Err(SparseError::NotSquare { rows, columns });
        }
        let lu =
            factorize_symbolic_lu(view(pattern), LuSymbolicParams::default()).map_err(|_| {
                SparseError::Singular {
                    n: rows,
                    column: None,
                }
            })?;
        let pattern = Arc::new(pattern.clone());
        Ok(Self {
            pattern,
            lu: Arc::new(lu),
        })
    }

    /// Order of the matrix.
    pub fn n(&self) -> usize {
        self.pattern.major_dim()
    }

    /// Entries of the pattern.
    pub fn nnz(&self) -> usize {
        self.pattern.nnz()
    }
}

fn view(pattern: &SparsityPattern) -> SymbolicSparseColMatRef<'_, usize> {
    let (n, offsets) = (pattern.major_dim(), pattern.major_offsets());
    SymbolicSparseColMatRef::new_checked(n, n, offsets, None, pattern.minor_indices())
}

/// The factors of matrices with one pattern; pivots are chosen anew for each.
pub struct Factors<T: Number> {
    symbolic: Symbolic,
    numeric: NumericLu<usize, T>,
    buffer: MemBuffer,
    probe: Vec<T>,
    /// Whether the factors are those of the last matrix.
    current: bool,
}

impl<T: Number> Factors<T> {
    /// No factors yet, of matrices with the pattern analysed.
    pub fn new(symbolic: Symbolic) -> Self {
        Self {
            buffer: T::room_for_lu(&symbolic),
            numeric: NumericLu::new(),
            probe: vec![T::zero(); symbolic.n()],
            current: false,
            symbolic,
        }
    }

    /// Room for all that the factors of such matrices are asked for.
    pub(crate) fn room(symbolic: &Symbolic) -> MemBuffer {
        let lu = &symbolic.lu;
        MemBuffer::new(StackReq::any_of(&[
            lu.factorize_numeric_lu_scratch::<T>(Par::Seq, Default::default()),
            lu.solve_in_place_scratch::<T>(1, Par::Seq),
            lu.solve_transpose_in_place_scratch::<T>(1, Par::Seq),
        ]))
    }

    /// How often pivots were chosen that later matrices keep: never.
    pub fn pivot_choices(&self) -> u64 {
        0
    }

    /// Nothing: each matrix chooses its own.
    pub fn forget_pivots(&mut self) {}

    /// Factorises the matrix with these `values`.
    ///
    /// # Errors
    /// [`SparseError::WrongLength`], [`SparseError::NotFinite`], [`SparseError::Singular`].
    pub fn renew(&mut self, values: &[T]) -> Result<(), SparseError> {
        self.current = false;
        let (n, nnz) = (self.symbolic.n(), self.symbolic.nnz());
        expect_length("values of the matrix", nnz, values.len())?;
        expect_finite(values, "matrix")?;
        let singular = SparseError::Singular { n, column: None };
        T::factor_lu(self, values).ok_or(singular.clone())?;
        // A pivot of zero is not said: it leaves infinities.
        self.current = true;
        let mut probe = std::mem::take(&mut self.probe);
        probe.fill(T::one());
        let solved = self.solve(&mut probe);
        self.current = solved.is_ok() && expect_finite(&probe, "solution").is_ok();
        self.probe = probe;
        if self.current { Ok(()) } else { Err(singular) }
    }

    /// An estimate of the reciprocal condition number: faer gives none.
    pub fn rcond(&self) -> Option<f64> {
        None
    }

    /// Solves A x = b in place.
    ///
    /// # Errors
    /// [`SparseError::NoFactors`], [`SparseError::WrongLength`].
    pub fn solve(&mut self, x: &mut [T]) -> Result<(), SparseError> {
        self.check(x)?;
        T::solve_lu(self, x, false);
        Ok(())
    }

    /// Solves Aᵀ x = b in place (transposed, not conjugated).
    ///
    /// # Errors
    /// As for [`solve`](Self::solve).
    pub fn solve_transposed(&mut self, x: &mut [T]) -> Result<(), SparseError> {
        self.check(x)?;
        T::solve_lu(self, x, true);
        Ok(())
    }

    /// The factors of the matrix with these `values`, if it is not seen to be singular.
    pub(crate) fn factor(&mut self, values: &[T]) -> Option<()> {
        let matrix = SparseColMatRef::new(view(&self.symbolic.pattern), values);
        let stack = MemStack::new(&mut self.buffer);
        let (lu, numeric) = (&self.symbolic.lu, &mut self.numeric);
        lu.factorize_numeric_lu(numeric, matrix, Par::Seq, stack, Default::default())
            .ok()
            .map(drop)
    }

    /// Solves in place with the last factors.
    pub(crate) fn solve_with(&mut self, x: &mut [T], is_transposed: bool) {
        let x = MatMut::from_column_major_slice_mut(x, self.symbolic.n(), 1);
        let lu = LuRef::new_unchecked(&self.symbolic.lu, &self.numeric);
        let stack = MemStack::new(&mut self.buffer);
        match is_transposed {
            false => lu.solve_in_place_with_conj(Conj::No, x, Par::Seq, stack),
            true => lu.solve_transpose_in_place_with_conj(Conj::No, x, Par::Seq, stack),
        }
    }

    /// Whether there is something to solve `x` with.
    fn check(&self, x: &[T]) -> Result<(), SparseError> {
        expect_length("right-hand side", self.symbolic.n(), x.len())?;
        match self.current {
            true => Ok(()),
            false => Err(SparseError::NoFactors),
        }
    }
}

impl<T: Number> std::fmt::Debug for Factors<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Factors")
            .field("n", &self.symbolic.n())
            .field("current", &self.current)
            .finish_non_exhaustive()
    }
}

impl<T: Number> Factorization<T> for Factors<T> {
    fn renew(&mut self, values: &[T]) -> Result<(), SparseError> {
        Self::renew(self, values)
    }

    fn solve(&mut self, x: &mut [T]) -> Result<(), SparseError> {
        Self::solve(self, x)
    }

    fn solve_transposed(&mut self, x: &mut [T]) -> Result<(), SparseError> {
        Self::solve_transposed(self, x)
    }

    fn n_entries(&self) -> Option<usize> {
        None
    }
}
