//! What an integrator asks of a differential-algebraic system F(t, y, ẏ) = 0.

use std::error::Error;

use nalgebra_sparse::pattern::SparsityPattern;

/// Why a residual or a Jacobian could not be evaluated.
#[derive(Debug, thiserror::Error)]
pub enum StepError {
    /// The arguments lie outside the domain of F (an inverted element, a negative concentration):
    /// the integrator may try again with a smaller step.
    #[error("{0}")]
    Recoverable(String),
    /// No smaller step will help; the integration stops and this error is handed back.
    #[error(transparent)]
    Fatal(#[from] Box<dyn Error + Send + Sync>),
}

/// How a variable enters F: with its derivative or without.
///
/// This is the `id` vector of IDAS, used by the calculation of consistent initial values. It is a
/// different thing from the variable's index and from its place in the error test.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum VariableKind {
    /// ẏ_i occurs in F.
    Differential,
    /// ẏ_i does not occur in F.
    Algebraic,
}

/// A fully implicit system of differential-algebraic equations F(t, y, ẏ) = 0: the one interface
/// between models and integrators.
///
/// Its Jacobian is asked for as `a ∂F/∂y + b ∂F/∂ẏ`: BDF codes take `a = 1, b = c_j`; an implicit
/// Runge–Kutta method, whose c_j are complex, evaluates `(1, 0)` and `(0, 1)` once and combines them.
///
/// # Shapes
/// All slices have the length [`n_unknowns`](Problem::n_unknowns), except the `values` of the
/// Jacobian, which has one entry per entry of [`jacobian_pattern`](Problem::jacobian_pattern).
pub trait Problem {
    /// Number of equations and unknowns.
    fn n_unknowns(&self) -> usize;

    /// Evaluates F(t, y, ẏ) into `residual`, overwriting it.
    ///
    /// # Errors
    /// [`StepError::Recoverable`] when a smaller step may help, [`StepError::Fatal`] otherwise.
    /// A NaN left in `residual` counts as recoverable.
    fn residual(
        &mut self,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
        residual: &mut [f64],
    ) -> Result<(), StepError>;

    /// The fixed compressed-column pattern of `a ∂F/∂y + b ∂F/∂ẏ` (major dimension: columns).
    fn jacobian_pattern(&self) -> SparsityPattern;

    /// Evaluates `a ∂F/∂y + b ∂F/∂ẏ` into `values`, in the order of the pattern, overwriting them.
    ///
    /// # Errors
    /// As for [`residual`](Problem::residual).
    fn jacobian(
        &mut self,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
        a: f64,
        b: f64,
        values: &mut [f64],
    ) -> Result<(), StepError>;

    /// Evaluates ∂F/∂y and ∂F/∂ẏ into the two `parts`, in the order of the pattern: by two calls of
    /// [`jacobian`](Problem::jacobian), unless the problem knows how to do it in one pass.
    ///
    /// # Errors
    /// As for [`residual`](Problem::residual).
    fn jacobian_parts(
        &mut self,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
        parts: [&mut [f64]; 2],
    ) -> Result<(), StepError> {
        let [of_value, of_rate] = parts;
        self.jacobian(t, y, y_dot, 1.0, 0.0, of_value)?;
        self.jacobian(t, y, y_dot, 0.0, 1.0, of_rate)
    }

    /// How each variable enters F (IDAS' `id`).
    fn kinds(&self) -> Vec<VariableKind>;

    /// The perturbation index of each variable: 0 for variables of an ODE, 1 to 3 for those of
    /// constrained mechanics.
    fn indices(&self) -> Vec<u8>;

    /// A name for component `i` in messages.
    fn component_name(&self, i: usize) -> String {
        format!("y[{i}]")
    }
}
