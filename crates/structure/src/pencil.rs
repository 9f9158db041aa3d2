//! Linearization of a differential-algebraic system at a state.

use myovib_dae::Problem;
use nalgebra::DMatrix;

use crate::error::StructureError;

/// The matrix pencil of E ẋ + A x = f.
///
/// For a system F(t, y, ẏ) = 0, the matrices E = ∂F/∂ẏ and A = ∂F/∂y are evaluated at a state. The index of this
/// frozen pencil is equal to the index of the system in two cases: if the system is linear with constant
/// coefficients, and for the semi-explicit (Hessenberg) forms of constrained mechanics at a consistent state. If
/// the matrices of another system vary along the solution, the two indices may differ (Griepentrog and März,
/// section 1.3).
#[derive(Debug, Clone, PartialEq)]
pub struct Pencil {
    e: DMatrix<f64>,
    a: DMatrix<f64>,
}

impl Pencil {
    /// Creates the pencil of two square matrices of equal size.
    ///
    /// # Errors
    /// Returns [`StructureError::Shape`] if the matrices are not square or differ in size, or
    /// [`StructureError::NotFinite`] with the first non-finite entry.
    pub fn new(e: DMatrix<f64>, a: DMatrix<f64>) -> Result<Self, StructureError> {
        if !e.is_square() || e.shape() != a.shape() {
            return Err(StructureError::Shape { e: e.shape(), a: a.shape() });
        }
        for (matrix, name) in [(&e, "E"), (&a, "A")] {
            if let Some(at) = matrix.iter().position(|value| !value.is_finite()) {
                let (row, column) = matrix.vector_to_matrix_index(at);
                let value = matrix[(row, column)];
                return Err(StructureError::NotFinite { matrix: name, row, column, value });
            }
        }
        Ok(Self { e, a })
    }

    /// Linearizes `problem` at (t, y, ẏ).
    ///
    /// # Errors
    /// Returns [`StructureError::Linearize`] if a Jacobian cannot be evaluated, and the errors of
    /// [`new`](Self::new).
    pub fn linearize(
        problem: &mut dyn Problem,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
    ) -> Result<Self, StructureError> {
        let pattern = problem.jacobian_pattern();
        let n = problem.n_unknowns();
        let mut values = vec![0.0; pattern.nnz()];
        let mut dense = |a: f64, b: f64| -> Result<DMatrix<f64>, StructureError> {
            problem
                .jacobian(t, y, y_dot, a, b, &mut values)
                .map_err(|source| StructureError::Linearize { t, source })?;
            let mut matrix = DMatrix::zeros(n, n);
            for ((column, row), value) in pattern.entries().zip(&values) {
                matrix[(row, column)] += value;
            }
            Ok(matrix)
        };
        let e = dense(0.0, 1.0)?;
        let a = dense(1.0, 0.0)?;
        Self::new(e, a)
    }

    /// Returns the number of equations, which equals the number of unknowns.
    pub fn size(&self) -> usize {
        self.e.nrows()
    }

    /// Returns E, the coefficient matrix of ẋ.
    pub fn e(&self) -> &DMatrix<f64> {
        &self.e
    }

    /// Returns A, the coefficient matrix of x.
    pub fn a(&self) -> &DMatrix<f64> {
        &self.a
    }
}
