//! Gradients by the adjoint method: IDAS integrates backward problems along the stored solution.
//!
//! For G(p) = ∫ g(t, y, p) dt from t0 to T along F(t, y, ẏ, p) = 0, one backward run computes the gradient with respect
//! to any number of parameters (Y. Cao, S. Li, L. Petzold, R. Serban, SIAM J. Sci. Comput. 24 (2003) 1076):
//!
//! ```text
//! d/dt (∂F/∂ẏᵀ λ) − ∂F/∂yᵀ λ + ∂g/∂yᵀ = 0
//! dG/dp = ∫ (∂g/∂p − λᵀ ∂F/∂p) dt + (λᵀ ∂F/∂ẏ ∂y/∂p)(t0) − (λᵀ ∂F/∂ẏ ∂y/∂p)(T)
//! ```
//!
//! 1. [`IdaBuilder::checkpoints`](crate::IdaBuilder::checkpoints) enables storage of the forward run.
//! 2. [`IdaSolver::add_backward`](crate::IdaSolver::add_backward) adds a [`BackwardProblem`] at T. [`AdjointProblem`]
//!    implements the problem above for constant ∂F/∂ẏ.
//! 3. [`IdaSolver::integrate_back_to`](crate::IdaSolver::integrate_back_to) integrates all backward problems to t0.
//!    [`IdaSolver::backward`](crate::IdaSolver::backward) returns λ and its quadratures.
//!
//! # Values at T
//! The final values of λ depend on the index.
//! - **Index 0 and 1:** ∂F/∂ẏᵀ λ = 0 at T. The components of λ that belong to equations with derivatives start at zero.
//!   The other components are determined by their equations with
//!   [`IdaSolver::correct_backward`](crate::IdaSolver::correct_backward).
//! - **Index 2**, ẋ = f(t, x, z, p) and 0 = c(t, x, p) with F = (ẋ − f, c): let A = ∂c/∂x and B = ∂f/∂z. The adjoint
//!   has the additional constraint Bᵀλ_x = −∂g/∂zᵀ. At T, λ_x = Aᵀξ with (AB)ᵀξ = −∂g/∂zᵀ, and the last term of dG/dp
//!   is +ξᵀ ∂c/∂p, since A ∂x/∂p = −∂c/∂p. λ_x(T) and this term are zero if g does not depend on z. λ_z follows from
//!   the derivative of the constraint; exclude it from the error test ([`BackwardOptions::suppress_algebraic`]). It is
//!   a derivative of the interpolated solution, so the tolerance of the forward run must be a hundredth of the backward
//!   tolerance.
//! - **Index 3** is rejected if the problem states its indices, because IDAS does not control the error of λ. Use a
//!   formulation of index 2, or the discrete adjoint of Radau IIA (crate `myovib-radau`).

mod transposed;

use nalgebra_sparse::pattern::SparsityPattern;

pub use transposed::AdjointProblem;

use myovib_dae::{Problem, Statistics, StepError, Tolerances, full_pattern};

/// Storage of the solution for backward problems.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Checkpoints {
    /// Number of steps between checkpoints. Only this many steps are stored at a time. The steps between other
    /// checkpoints are repeated when they are needed. Default: 100.
    pub every: usize,
    /// Method of interpolation between the steps.
    pub interpolation: Interpolation,
}

impl Default for Checkpoints {
    fn default() -> Self {
        Self { every: 100, interpolation: Interpolation::default() }
    }
}

/// Method of interpolation of the solution between stored steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Interpolation {
    /// Cubic polynomial, from y and ẏ at both ends of a step.
    #[default]
    Hermite,
    /// A polynomial of the order of the step, from y alone. It requires half the memory.
    Polynomial,
}

/// Forward solution at one point in time.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ForwardState {
    /// Time.
    pub t: f64,
    /// y.
    pub y: Vec<f64>,
    /// ẏ.
    pub y_dot: Vec<f64>,
    /// S and Ṡ for each parameter whose sensitivities the solver computes.
    pub s: Vec<[Vec<f64>; 2]>,
}

/// A system R(t, λ, λ̇) = 0 integrated backward in time along the solution of the problem `P`.
///
/// # Shapes
/// `values`, `rates`, `residual`: [`n_unknowns`](Self::n_unknowns).
pub trait BackwardProblem<P> {
    /// Returns the number of equations and unknowns λ.
    fn n_unknowns(&self) -> usize;

    /// Evaluates R at λ = `values` and λ̇ = `rates` and writes it to `residual`.
    ///
    /// # Errors
    /// Returns the same errors as [`Problem::residual`].
    fn residual(
        &mut self,
        forward: &mut P,
        at: &ForwardState,
        values: &[f64],
        rates: &[f64],
        residual: &mut [f64],
    ) -> Result<(), StepError>;

    /// Returns the compressed-column pattern of a ∂R/∂λ + b ∂R/∂λ̇. The default is a full matrix.
    fn jacobian_pattern(&self) -> SparsityPattern {
        full_pattern(self.n_unknowns())
    }

    /// Evaluates a ∂R/∂λ + b ∂R/∂λ̇ and writes it to `entries`, in the order of the pattern. By default, the Jacobian
    /// is not implemented, and difference quotients of the residual are used instead.
    ///
    /// # Errors
    /// Returns the same errors as [`Problem::jacobian`].
    fn jacobian(
        &mut self,
        _forward: &mut P,
        _at: &ForwardState,
        _lambda: [&[f64]; 2],
        _coefficients: (f64, f64),
        _entries: &mut [f64],
    ) -> Result<(), StepError> {
        Err(StepError::NoJacobian)
    }

    /// Returns the number of quadratures q̇ = r(t, λ, λ̇) with q(T) = 0; 0 by default.
    fn n_quadratures(&self) -> usize {
        0
    }

    /// Evaluates r and writes it to `out`.
    ///
    /// # Errors
    /// Returns the same errors as [`residual`](Self::residual).
    fn quadrature(
        &mut self,
        _forward: &mut P,
        _at: &ForwardState,
        _values: &[f64],
        _rates: &[f64],
        _out: &mut [f64],
    ) -> Result<(), StepError> {
        Ok(())
    }
}

/// Settings of a backward problem.
#[derive(Debug, Clone, PartialEq)]
pub struct BackwardOptions {
    /// Relative and absolute tolerances. Default: 1e-4 and 1e-8.
    pub tolerances: Tolerances,
    /// Whether components without derivatives are excluded from the error test. Default: false.
    pub suppress_algebraic: bool,
    /// Relative and absolute tolerances of the quadratures, if they are included in the error test.
    pub quadrature_tolerances: Option<(f64, f64)>,
    /// Maximum number of steps between two checkpoints. Default: 500.
    pub max_steps: usize,
    /// Maximum BDF order, 1 to 5. Default: 5.
    pub max_order: usize,
}

impl Default for BackwardOptions {
    fn default() -> Self {
        Self {
            tolerances: Tolerances::scalar(1e-4, 1e-8),
            suppress_algebraic: false,
            quadrature_tolerances: None,
            max_steps: 500,
            max_order: 5,
        }
    }
}

/// Handle of a backward problem.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Backward(pub(crate) usize);

/// State of a backward problem.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct BackwardRun {
    /// Time of the values.
    pub t: f64,
    /// λ.
    pub values: Vec<f64>,
    /// λ̇.
    pub rates: Vec<f64>,
    /// The quadratures.
    pub quadratures: Vec<f64>,
    /// Counters of steps, Newton iterations and evaluations.
    pub statistics: Statistics,
}

/// A backward problem at one forward state, viewed as a [`Problem`] in λ.
pub(crate) struct At<'a, P> {
    pub(crate) problem: &'a mut (dyn BackwardProblem<P> + Send),
    pub(crate) forward: &'a mut P,
    pub(crate) state: &'a ForwardState,
}

impl<P> Problem for At<'_, P> {
    fn n_unknowns(&self) -> usize {
        self.problem.n_unknowns()
    }

    fn residual(
        &mut self,
        _: f64,
        values: &[f64],
        rates: &[f64],
        residual: &mut [f64],
    ) -> Result<(), StepError> {
        self.problem.residual(self.forward, self.state, values, rates, residual)
    }

    fn jacobian_pattern(&self) -> SparsityPattern {
        self.problem.jacobian_pattern()
    }

    fn jacobian(
        &mut self,
        _: f64,
        values: &[f64],
        rates: &[f64],
        a: f64,
        b: f64,
        entries: &mut [f64],
    ) -> Result<(), StepError> {
        let lambda = [values, rates];
        self.problem.jacobian(self.forward, self.state, lambda, (a, b), entries)
    }
}
