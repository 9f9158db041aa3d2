//! Gradients by the adjoint method: backward problems that IDAS integrates along the solution it has kept.
//!
//! Of G(p) = ∫ g(t, y, p) dt from t0 to T along F(t, y, ẏ, p) = 0 the gradient by any number of
//! parameters takes one backward run (Y. Cao, S. Li, L. Petzold, R. Serban, SIAM J. Sci. Comput. 24
//! (2003) 1076):
//!
//! ```text
//! d/dt (∂F/∂ẏᵀ λ) − ∂F/∂yᵀ λ + ∂g/∂yᵀ = 0
//! dG/dp = ∫ (∂g/∂p − λᵀ ∂F/∂p) dt + (λᵀ ∂F/∂ẏ ∂y/∂p)(t0) − (λᵀ ∂F/∂ẏ ∂y/∂p)(T)
//! ```
//!
//! 1. [`IdaBuilder::checkpoints`](crate::IdaBuilder::checkpoints) lets the forward run be kept.
//! 2. [`IdaSolver::add_backward`](crate::IdaSolver::add_backward) adds a [`BackwardProblem`] at T:
//!    [`Adjoint`] is the one above where ∂F/∂ẏ is constant.
//! 3. [`IdaSolver::integrate_back_to`](crate::IdaSolver::integrate_back_to) integrates all of them to t0;
//!    [`IdaSolver::backward`](crate::IdaSolver::backward) tells λ and its quadratures.
//!
//! # Values at T
//! What λ starts from depends on the index.
//! - **Index 0 and 1:** ∂F/∂ẏᵀ λ = 0 at T. The components of λ of equations with derivatives start at
//!   zero, the others where their equations put them, by
//!   [`IdaSolver::correct_backward`](crate::IdaSolver::correct_backward).
//! - **Index 2**, ẋ = f(t, x, z, p) and 0 = c(t, x, p): with A = ∂c/∂x and B = ∂f/∂z the adjoint has the
//!   constraint Bᵀλ_x = −∂g/∂zᵀ of its own (F = (ẋ − f, c)). At T, λ_x = Aᵀξ with (AB)ᵀξ = −∂g/∂zᵀ, and
//!   the last term of dG/dp is +ξᵀ ∂c/∂p, as A ∂x/∂p = −∂c/∂p. Both are zero where g does not depend on
//!   z. λ_z follows from the derivative of the constraint; leave it out of the error test
//!   ([`BackwardOptions::suppress_algebraic`]). It is a derivative of the interpolated solution: ask the
//!   forward run for a hundredth of the backward tolerance.
//! - **Index 3** is refused where the problem states its indices: IDAS controls no error of it. Take a form
//!   of index 2 of the same problem, or the discrete adjoint of Radau IIA (crate `myovib-radau`).

mod transposed;

use nalgebra_sparse::pattern::SparsityPattern;

pub use transposed::Adjoint;

use myovib_dae::{Problem, Statistics, StepError, Tolerances};

/// How the solution is kept for backward problems.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Checkpoints {
    /// Steps from one checkpoint to the next; the solution is kept at so many steps at a time, and the
    /// steps between two checkpoints are repeated when they are needed. 100 by default.
    pub every: usize,
    /// How it is interpolated between the steps.
    pub interpolation: Interpolation,
}

impl Default for Checkpoints {
    fn default() -> Self {
        Self {
            every: 100,
            interpolation: Interpolation::default(),
        }
    }
}

/// How the solution is interpolated between kept steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Interpolation {
    /// Cubic, from y and ẏ at both ends of a step.
    #[default]
    Hermite,
    /// Of the order of the step, from y alone: half the memory.
    Polynomial,
}

/// The forward solution at a time.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ForwardState {
    /// The time.
    pub t: f64,
    /// y.
    pub y: Vec<f64>,
    /// ẏ.
    pub y_dot: Vec<f64>,
    /// S and Ṡ for each parameter that the solver integrates sensitivities to.
    pub s: Vec<[Vec<f64>; 2]>,
}

/// A system R(t, λ, λ̇) = 0 integrated back in time along the solution of the problem `P`.
///
/// # Shapes
/// `values`, `rates`, `residual`: [`n_unknowns`](Self::n_unknowns).
pub trait BackwardProblem<P> {
    /// Number of equations and unknowns λ.
    fn n_unknowns(&self) -> usize;

    /// Evaluates R at λ = `values` and λ̇ = `rates` into `residual`, overwriting it.
    ///
    /// # Errors
    /// As for [`Problem::residual`].
    fn residual(
        &mut self,
        forward: &mut P,
        at: &ForwardState,
        values: &[f64],
        rates: &[f64],
        residual: &mut [f64],
    ) -> Result<(), StepError>;

    /// The pattern of a ∂R/∂λ + b ∂R/∂λ̇ by columns; full by default.
    fn jacobian_pattern(&self) -> SparsityPattern {
        let n = self.n_unknowns();
        let offsets = (0..=n).map(|column| column * n).collect();
        let rows = (0..n * n).map(|entry| entry % n).collect();
        SparsityPattern::try_from_offsets_and_indices(n, n, offsets, rows)
            .expect("columns of ascending rows")
    }

    /// Evaluates a ∂R/∂λ + b ∂R/∂λ̇ into `entries`, in the order of the pattern. By default there is none,
    /// and differences of the residual take the place.
    ///
    /// # Errors
    /// As for [`Problem::jacobian`].
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

    /// Number of quadratures q̇ = r(t, λ, λ̇), which start at zero at T; none by default.
    fn n_quadratures(&self) -> usize {
        0
    }

    /// Evaluates r into `out`.
    ///
    /// # Errors
    /// As for [`residual`](Self::residual).
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
    /// Tolerances; relative 1e-4 and absolute 1e-8 by default.
    pub tolerances: Tolerances,
    /// Whether the components without derivatives are left out of the error test; not by default.
    pub suppress_algebraic: bool,
    /// Relative and absolute tolerance of the quadratures, if they take part in the error test.
    pub quadrature_tolerances: Option<(f64, f64)>,
    /// Most steps between two checkpoints; 500 by default.
    pub max_steps: usize,
    /// Highest order of the BDF, 1 to 5; 5 by default.
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

/// A backward problem of a solver, by its number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Backward(pub(crate) usize);

/// Where a backward problem is.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct BackwardRun {
    /// The time that the values belong to.
    pub t: f64,
    /// λ.
    pub values: Vec<f64>,
    /// λ̇.
    pub rates: Vec<f64>,
    /// The quadratures.
    pub quadratures: Vec<f64>,
    /// Counters of its steps, of Newton's method and of its evaluations.
    pub statistics: Statistics,
}

/// A backward problem at one forward state, as the [`Problem`] in λ that it is.
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
        self.problem
            .residual(self.forward, self.state, values, rates, residual)
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
        self.problem
            .jacobian(self.forward, self.state, lambda, (a, b), entries)
    }
}
