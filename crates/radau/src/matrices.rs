//! Default linear solver: LU of the full matrix with partial pivoting. Uses KLU if the feature `klu` of `myovib-sparse`
//! is enabled, otherwise pure Rust.

use myovib_dae::{Jacobian, LinearSolver, Linearization, Problem, StepError};
use myovib_sparse::SparseError;
use myovib_sparse::SparseOptions;
use myovib_sparse::pivoting::{Factors, Symbolic};
use nalgebra_sparse::pattern::SparsityPattern;
use num_complex::Complex64;

/// [Sparse LU](myovib_sparse::pivoting) of the full matrix. Real and complex factors share one symbolic analysis.
///
/// Complex factors are allocated at the first setup with complex matrices.
#[derive(Debug)]
pub struct SparseDirectSolver {
    jacobian: Jacobian,
    jacobian_y: Vec<f64>,
    jacobian_y_dot: Vec<f64>,
    values: Vec<f64>,
    complex_values: Vec<Complex64>,
    symbolic: Symbolic,
    real: Factors<f64>,
    complex: Vec<Factors<Complex64>>,
}

impl SparseDirectSolver {
    /// Analyzes the pattern.
    ///
    /// # Errors
    /// Returns errors of the analysis, see [`Symbolic::analyze`].
    pub fn new(pattern: &SparsityPattern, options: SparseOptions) -> Result<Self, SparseError> {
        let symbolic = Symbolic::analyze(pattern, options)?;
        let nnz = symbolic.nnz();
        Ok(Self {
            jacobian: Jacobian::with_pattern(pattern.clone()),
            jacobian_y: vec![0.0; nnz],
            jacobian_y_dot: vec![0.0; nnz],
            values: vec![0.0; nnz],
            complex_values: vec![Complex64::ZERO; nnz],
            real: Factors::new(symbolic.clone()),
            complex: Vec::new(),
            symbolic,
        })
    }
}

impl<P: Problem> LinearSolver<P> for SparseDirectSolver {
    fn evaluate(&mut self, problem: &mut P, at: &Linearization<'_>) -> Result<(), StepError> {
        let parts = [&mut self.jacobian_y[..], &mut self.jacobian_y_dot];
        self.jacobian.parts(problem, at, parts)?;
        let both = self.jacobian_y.iter().zip(&self.jacobian_y_dot);
        match both.map(|(j, m)| j + m).position(|sum| !sum.is_finite()) {
            None => Ok(()),
            Some(k) => {
                let value = self.jacobian_y[k] + self.jacobian_y_dot[k];
                let message = format!("Jacobian[{k}] = {value} at t = {}", at.t);
                Err(StepError::Recoverable(message))
            }
        }
    }

    fn set_up(
        &mut self,
        _problem: &mut P,
        real: f64,
        complex: &[Complex64],
    ) -> Result<(), StepError> {
        let blocks = || self.jacobian_y.iter().zip(&self.jacobian_y_dot);
        for (value, (j, m)) in self.values.iter_mut().zip(blocks()) {
            *value = j + real * m;
        }
        self.real.renew(&self.values)?;
        let fresh = || Factors::new(self.symbolic.clone());
        self.complex.resize_with(complex.len(), fresh);
        for (factors, c) in self.complex.iter_mut().zip(complex) {
            for (value, (j, m)) in self.complex_values.iter_mut().zip(blocks()) {
                *value = j + c * m;
            }
            factors.renew(&self.complex_values)?;
        }
        Ok(())
    }

    fn solve_real(&mut self, _problem: &mut P, rhs: &mut [f64]) -> Result<(), StepError> {
        Ok(self.real.solve(rhs)?)
    }

    fn solve_complex(
        &mut self,
        _problem: &mut P,
        k: usize,
        rhs: &mut [Complex64],
    ) -> Result<(), StepError> {
        Ok(self.complex[k].solve(rhs)?)
    }

    fn solve_real_transposed(
        &mut self,
        _problem: &mut P,
        rhs: &mut [f64],
    ) -> Result<(), StepError> {
        Ok(self.real.solve_transposed(rhs)?)
    }

    fn solve_complex_transposed(
        &mut self,
        _problem: &mut P,
        k: usize,
        rhs: &mut [Complex64],
    ) -> Result<(), StepError> {
        Ok(self.complex[k].solve_transposed(rhs)?)
    }

    fn difference_evaluations(&self) -> u64 {
        self.jacobian.residual_evaluations()
    }

    fn pivot_choices(&self) -> u64 {
        let complex = self.complex.iter().map(Factors::pivot_choices);
        self.real.pivot_choices() + complex.sum::<u64>()
    }

    fn forget_pivots(&mut self) {
        self.real.forget_pivots();
        self.complex.iter_mut().for_each(Factors::forget_pivots);
    }
}
