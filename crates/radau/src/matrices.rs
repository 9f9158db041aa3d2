//! The matrices of Newton's method: a trait, so that structure can be used, and KLU on the whole.

use myovib_dae::{Problem, StepError};
use myovib_sparse::klu::{Factors, KluError, KluOptions, Symbolic};
use nalgebra_sparse::pattern::SparsityPattern;
use num_complex::Complex64;

use crate::method::Method;

/// The Newton matrices J_y + c J_ẏ of a problem: evaluated, set up for some c, solved with.
///
/// The integrator asks for one real c and (s − 1)/2 complex ones at a time. An implementation may
/// use structure that the sparse matrix of the whole does not show (blocks that are diagonal,
/// unknowns that can be eliminated).
///
/// All errors mean what they do for a residual: after a recoverable one (a singular matrix) the
/// step is tried with a smaller h.
pub trait NewtonMatrices<P> {
    /// Evaluates J_y = ∂F/∂y and J_ẏ = ∂F/∂ẏ at (t, y, ẏ) and keeps them.
    ///
    /// # Errors
    /// Those of the problem.
    fn evaluate(
        &mut self,
        problem: &mut P,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
    ) -> Result<(), StepError>;

    /// Prepares solves with J_y + c J_ẏ for the real c and for each of the complex ones.
    ///
    /// # Errors
    /// [`StepError::Recoverable`] if a matrix is singular.
    fn set_up(
        &mut self,
        problem: &mut P,
        real: f64,
        complex: &[Complex64],
    ) -> Result<(), StepError>;

    /// Solves in place with the real matrix.
    ///
    /// # Errors
    /// [`StepError::Fatal`] if the solve itself fails.
    fn solve_real(&mut self, problem: &mut P, rhs: &mut [f64]) -> Result<(), StepError>;

    /// Solves in place with complex matrix `k`, counted from 0.
    ///
    /// # Errors
    /// [`StepError::Fatal`] if the solve itself fails.
    fn solve_complex(
        &mut self,
        problem: &mut P,
        k: usize,
        rhs: &mut [Complex64],
    ) -> Result<(), StepError>;
}

/// The default: KLU on the whole matrix, real and complex factors over one symbolic analysis.
#[derive(Debug)]
pub struct KluMatrices {
    jacobian_y: Vec<f64>,
    jacobian_y_dot: Vec<f64>,
    values: Vec<f64>,
    complex_values: Vec<Complex64>,
    real: Factors<f64>,
    complex: Vec<Factors<Complex64>>,
}

impl KluMatrices {
    /// Analyses the pattern for `method`, which must be that of the solver's options.
    ///
    /// # Errors
    /// Those of the analysis, see [`Symbolic::analyze`].
    pub fn new(
        pattern: &SparsityPattern,
        options: KluOptions,
        method: &Method,
    ) -> Result<Self, KluError> {
        let symbolic = Symbolic::analyze(pattern, options)?;
        let nnz = symbolic.nnz();
        Ok(Self {
            jacobian_y: vec![0.0; nnz],
            jacobian_y_dot: vec![0.0; nnz],
            values: vec![0.0; nnz],
            complex_values: vec![Complex64::ZERO; nnz],
            complex: method
                .complex_modes()
                .iter()
                .map(|_| Factors::new(symbolic.clone()))
                .collect(),
            real: Factors::new(symbolic),
        })
    }
}

impl<P: Problem> NewtonMatrices<P> for KluMatrices {
    fn evaluate(
        &mut self,
        problem: &mut P,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
    ) -> Result<(), StepError> {
        let parts = [&mut self.jacobian_y[..], &mut self.jacobian_y_dot];
        problem.jacobian_parts(t, y, y_dot, parts)
    }

    fn set_up(
        &mut self,
        _problem: &mut P,
        real: f64,
        complex: &[Complex64],
    ) -> Result<(), StepError> {
        let modes = self.complex.len();
        assert_eq!(complex.len(), modes, "the complex modes of one method");
        let blocks = || self.jacobian_y.iter().zip(&self.jacobian_y_dot);
        for (value, (j, m)) in self.values.iter_mut().zip(blocks()) {
            *value = j + real * m;
        }
        self.real.renew(&self.values)?;
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
}

/// A choice made at run time.
impl<P, M: NewtonMatrices<P> + ?Sized> NewtonMatrices<P> for Box<M> {
    fn evaluate(
        &mut self,
        problem: &mut P,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
    ) -> Result<(), StepError> {
        (**self).evaluate(problem, t, y, y_dot)
    }

    fn set_up(
        &mut self,
        problem: &mut P,
        real: f64,
        complex: &[Complex64],
    ) -> Result<(), StepError> {
        (**self).set_up(problem, real, complex)
    }

    fn solve_real(&mut self, problem: &mut P, rhs: &mut [f64]) -> Result<(), StepError> {
        (**self).solve_real(problem, rhs)
    }

    fn solve_complex(
        &mut self,
        problem: &mut P,
        k: usize,
        rhs: &mut [Complex64],
    ) -> Result<(), StepError> {
        (**self).solve_complex(problem, k, rhs)
    }
}
