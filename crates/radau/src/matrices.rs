//! The matrices of Newton's method: a trait, so that structure can be used, and KLU on the whole.

use nalgebra_sparse::pattern::SparsityPattern;
use num_complex::Complex64;
use sundials_wrap::klu::{KluError, KluOptions, Numeric, Scalar, Symbolic};
use sundials_wrap::{DaeProblem, StepError};

use crate::Method;

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
    fn set_up(&mut self, real: f64, complex: &[Complex64]) -> Result<(), StepError>;

    /// Solves in place with the real matrix.
    ///
    /// # Errors
    /// [`StepError::Fatal`] if the solve itself fails.
    fn solve_real(&mut self, rhs: &mut [f64]) -> Result<(), StepError>;

    /// Solves in place with complex matrix `k`, counted from 0.
    ///
    /// # Errors
    /// [`StepError::Fatal`] if the solve itself fails.
    fn solve_complex(&mut self, k: usize, rhs: &mut [Complex64]) -> Result<(), StepError>;
}

/// The default: KLU on the whole matrix, real and complex factors over one symbolic analysis.
#[derive(Debug)]
pub struct KluMatrices {
    symbolic: Symbolic,
    jacobian_y: Vec<f64>,
    jacobian_y_dot: Vec<f64>,
    real: Factors<f64>,
    complex: Vec<Factors<Complex64>>,
}

impl KluMatrices {
    /// Analyses the pattern for the `method`.
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
            symbolic,
            jacobian_y: vec![0.0; nnz],
            jacobian_y_dot: vec![0.0; nnz],
            real: Factors::new(nnz),
            complex: method
                .complex_modes()
                .iter()
                .map(|_| Factors::new(nnz))
                .collect(),
        })
    }
}

impl<P: DaeProblem> NewtonMatrices<P> for KluMatrices {
    fn evaluate(
        &mut self,
        problem: &mut P,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
    ) -> Result<(), StepError> {
        problem.jacobian(t, y, y_dot, 1.0, 0.0, &mut self.jacobian_y)?;
        problem.jacobian(t, y, y_dot, 0.0, 1.0, &mut self.jacobian_y_dot)
    }

    fn set_up(&mut self, real: f64, complex: &[Complex64]) -> Result<(), StepError> {
        let Self {
            symbolic,
            jacobian_y,
            jacobian_y_dot,
            ..
        } = self;
        let blocks = || jacobian_y.iter().zip(jacobian_y_dot.iter());
        self.real
            .set_up(symbolic, blocks().map(|(j, m)| j + real * m))?;
        for (factors, c) in self.complex.iter_mut().zip(complex) {
            factors.set_up(symbolic, blocks().map(|(j, m)| j + c * m))?;
        }
        Ok(())
    }

    fn solve_real(&mut self, rhs: &mut [f64]) -> Result<(), StepError> {
        self.real.solve(rhs)
    }

    fn solve_complex(&mut self, k: usize, rhs: &mut [Complex64]) -> Result<(), StepError> {
        self.complex[k].solve(rhs)
    }
}

/// A reciprocal pivot growth this much below that of fresh pivots calls for fresh ones: three of
/// the digits that fresh pivots would give are lost then.
const GROWTH_LOSS: f64 = 1e-3;

/// One matrix and its factors, whose pivots are kept as long as they serve.
#[derive(Debug)]
struct Factors<T: Scalar> {
    values: Vec<T>,
    /// The factors, and the reciprocal pivot growth when the pivots were chosen.
    numeric: Option<(Numeric<T>, f64)>,
}

impl<T: Scalar + num_complex::ComplexFloat> Factors<T> {
    fn new(nnz: usize) -> Self {
        Self {
            values: vec![T::zero(); nnz],
            numeric: None,
        }
    }

    fn set_up(
        &mut self,
        symbolic: &Symbolic,
        values: impl Iterator<Item = T>,
    ) -> Result<(), StepError> {
        self.values
            .iter_mut()
            .zip(values)
            .for_each(|(slot, value)| *slot = value);
        if !self.refactor() {
            let numeric = Numeric::factor(symbolic, &self.values).map_err(step_error)?;
            let growth = numeric.rgrowth(&self.values).map_err(step_error)?;
            self.numeric = Some((numeric, growth));
        }
        Ok(())
    }

    /// Refactorises with the pivots kept; false if there are none or they no longer serve.
    fn refactor(&mut self) -> bool {
        let Some((numeric, fresh_growth)) = &mut self.numeric else {
            return false;
        };
        numeric.refactor(&self.values).is_ok()
            && numeric
                .rgrowth(&self.values)
                .is_ok_and(|growth| growth >= GROWTH_LOSS * *fresh_growth)
    }

    fn solve(&self, rhs: &mut [T]) -> Result<(), StepError> {
        let (numeric, _) = self
            .numeric
            .as_ref()
            .ok_or_else(|| StepError::Fatal("a solve before any set-up".into()))?;
        numeric.solve(rhs).map_err(step_error)
    }
}

/// A singular or infinite matrix may become a good one with a smaller step; nothing else may.
fn step_error(error: KluError) -> StepError {
    match error {
        KluError::Singular { .. } | KluError::NotFinite { .. } => {
            StepError::Recoverable(error.to_string())
        }
        other => StepError::Fatal(Box::new(other)),
    }
}
