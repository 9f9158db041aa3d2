//! Interface of a differential-algebraic system F(t, y, ẏ) = 0 to an integrator.

use std::error::Error;

use nalgebra_sparse::pattern::SparsityPattern;

/// Reason why a residual or a Jacobian could not be evaluated.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StepError {
    /// The arguments are outside the domain of F (an inverted element, a negative concentration).
    /// The integrator may retry with a smaller step.
    #[error("{0}")]
    Recoverable(String),
    /// A smaller step would not help. The integration stops and returns this error.
    #[error(transparent)]
    Fatal(#[from] Box<dyn Error + Send + Sync>),
    /// The problem does not implement a Jacobian. Difference quotients of its residual are used
    /// instead (see [`Jacobian`](crate::Jacobian)).
    #[error("the problem does not implement a Jacobian")]
    NoJacobian,
}

/// Kind of a variable: whether its derivative occurs in F.
///
/// The kinds correspond to the `id` vector of IDAS and are used to compute consistent initial values. They are
/// independent of the indices of the variables and of exclusions from the error test.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum VariableKind {
    /// ẏ_i occurs in F.
    Differential,
    /// ẏ_i does not occur in F.
    Algebraic,
}

/// A fully implicit system of differential-algebraic equations F(t, y, ẏ) = 0. This trait is the interface between
/// models and integrators.
///
/// Only the number of unknowns and the residual are required. Further information makes the integration faster or more
/// reliable: a sparse pattern, a Jacobian, and the kinds and indices of the variables.
///
/// The Jacobian is evaluated as `a ∂F/∂y + b ∂F/∂ẏ`. BDF methods use `a = 1, b = c_j`. An implicit Runge–Kutta method,
/// whose c_j are complex, evaluates `(1, 0)` and `(0, 1)` once and combines the results.
///
/// # Shapes
/// All slices have the length [`n_unknowns`](Problem::n_unknowns), except the `values` of the
/// Jacobian, which has one entry per entry of [`jacobian_pattern`](Problem::jacobian_pattern).
pub trait Problem {
    /// Returns the number of equations and unknowns.
    fn n_unknowns(&self) -> usize;

    /// Evaluates F(t, y, ẏ) and writes it to `residual`.
    ///
    /// # Errors
    /// Returns [`StepError::Recoverable`] if a smaller step may help, otherwise [`StepError::Fatal`]. A NaN in
    /// `residual` is treated as a recoverable error.
    fn residual(
        &mut self,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
        residual: &mut [f64],
    ) -> Result<(), StepError>;

    /// Returns the fixed pattern of `a ∂F/∂y + b ∂F/∂ẏ` in compressed-column form (the major dimension is the column).
    /// The default is a full matrix.
    fn jacobian_pattern(&self) -> SparsityPattern {
        full_pattern(self.n_unknowns())
    }

    /// Evaluates `a ∂F/∂y + b ∂F/∂ẏ` and writes it to `values`, in the order of the pattern.
    ///
    /// By default, the Jacobian is not implemented, and integrators use difference quotients of the residual. Call this
    /// method through a [`Jacobian`](crate::Jacobian), which handles this case.
    ///
    /// # Errors
    /// Returns the same errors as [`residual`](Problem::residual), and [`StepError::NoJacobian`] if it is not
    /// implemented.
    fn jacobian(
        &mut self,
        _t: f64,
        _y: &[f64],
        _y_dot: &[f64],
        _a: f64,
        _b: f64,
        _values: &mut [f64],
    ) -> Result<(), StepError> {
        Err(StepError::NoJacobian)
    }

    /// Evaluates ∂F/∂y and ∂F/∂ẏ and writes them to the two `parts`, in the order of the pattern. The default calls
    /// [`jacobian`](Problem::jacobian) twice. Override this method if one pass can compute the two matrices.
    ///
    /// # Errors
    /// Returns the same errors as [`residual`](Problem::residual).
    fn jacobian_parts(
        &mut self,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
        parts: [&mut [f64]; 2],
    ) -> Result<(), StepError> {
        let [df_dy, df_dyp] = parts;
        self.jacobian(t, y, y_dot, 1.0, 0.0, df_dy)?;
        self.jacobian(t, y, y_dot, 0.0, 1.0, df_dyp)
    }

    /// Returns whether each variable is differential or algebraic (`id` of IDAS). By default, the kinds are determined
    /// numerically at the start; see [`kinds_at`](crate::kinds_at).
    fn kinds(&self) -> Option<Vec<VariableKind>> {
        None
    }

    /// Returns the perturbation index of each variable: 0 for variables of an ODE, and 1 to 3 in constrained mechanics.
    /// Returns `None` (the default) if the index is unknown.
    ///
    /// Integrators treat 0 and 1 in the same way unless [`Suppressed`](crate::Suppressed) excludes the index 1. For
    /// example, in mechanics with constraints on positions, the index is 1 for positions, 2 for velocities, and 3 for
    /// multipliers. In the form of Gear, Gupta and Leimkuhler, it is 1 for positions and velocities, and 2 for the
    /// multipliers of both sets of constraints.
    fn indices(&self) -> Option<Vec<u8>> {
        None
    }

    /// Returns the number of [`constraints`](Problem::constraints); 0 by default.
    fn n_constraints(&self) -> usize {
        0
    }

    /// Writes the constraints c(t, y) on the differential variables to `out`; every solution satisfies c = 0. A system
    /// of index 2 provides its constraints, and a system of index 3 also provides their time derivatives (hidden
    /// constraints). Integrators evaluate c only at the start: to compute consistent initial values
    /// ([`ConsistencyMode::Constraints`](crate::ConsistencyMode::Constraints)) and to reject inconsistent ones.
    ///
    /// # Shapes
    /// `out`: [`n_constraints`](Problem::n_constraints).
    ///
    /// # Errors
    /// Returns the same errors as [`residual`](Problem::residual).
    fn constraints(&mut self, _t: f64, _y: &[f64], _out: &mut [f64]) -> Result<(), StepError> {
        Ok(())
    }

    /// Returns the name of component `i` for messages.
    fn component_name(&self, i: usize) -> String {
        format!("y[{i}]")
    }
}

/// A problem selected at run time. Solvers for this type are compiled only once for all problems.
impl<P: Problem + ?Sized> Problem for Box<P> {
    crate::forward! { P;
        mut residual(t: f64, y: &[f64], y_dot: &[f64], residual: &mut [f64]) -> Result<(), StepError>;
        mut jacobian(
            t: f64, y: &[f64], y_dot: &[f64], a: f64, b: f64, values: &mut [f64]
        ) -> Result<(), StepError>;
        mut jacobian_parts(
            t: f64, y: &[f64], y_dot: &[f64], parts: [&mut [f64]; 2]
        ) -> Result<(), StepError>;
        mut constraints(t: f64, y: &[f64], out: &mut [f64]) -> Result<(), StepError>;
        ref n_unknowns() -> usize;
        ref jacobian_pattern() -> SparsityPattern;
        ref kinds() -> Option<Vec<VariableKind>>;
        ref indices() -> Option<Vec<u8>>;
        ref n_constraints() -> usize;
        ref component_name(i: usize) -> String;
    }
}

/// Returns the pattern of a full n × n matrix.
pub fn full_pattern(n: usize) -> SparsityPattern {
    let offsets = (0..=n).map(|j| j * n).collect();
    let indices = (0..n * n).map(|k| k % n).collect();
    SparsityPattern::try_from_offsets_and_indices(n, n, offsets, indices)
        .expect("the columns of a full matrix are sorted and complete")
}
