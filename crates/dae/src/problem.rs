//! What an integrator asks of a differential-algebraic system F(t, y, ẏ) = 0.

use std::error::Error;

use nalgebra_sparse::pattern::SparsityPattern;

/// Why a residual or a Jacobian could not be evaluated.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StepError {
    /// The arguments lie outside the domain of F (an inverted element, a negative concentration):
    /// the integrator may try again with a smaller step.
    #[error("{0}")]
    Recoverable(String),
    /// No smaller step will help; the integration stops and this error is handed back.
    #[error(transparent)]
    Fatal(#[from] Box<dyn Error + Send + Sync>),
    /// The problem states no Jacobian: difference quotients of its residual take the place (see
    /// [`Jacobian`](crate::Jacobian)).
    #[error("the problem states no Jacobian")]
    NoJacobian,
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
/// The number of unknowns and the residual are all that must be written. What else a problem knows
/// of itself makes it faster or more reliable: a sparse pattern, a Jacobian, the kinds and indices
/// of its variables.
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

    /// The fixed compressed-column pattern of `a ∂F/∂y + b ∂F/∂ẏ` (major dimension: columns); full
    /// by default.
    fn jacobian_pattern(&self) -> SparsityPattern {
        full_pattern(self.n_unknowns())
    }

    /// Evaluates `a ∂F/∂y + b ∂F/∂ẏ` into `values`, in the order of the pattern, overwriting them.
    ///
    /// By default there is none, and integrators take difference quotients of the residual. Call it
    /// through a [`Jacobian`](crate::Jacobian), which knows what to do then.
    ///
    /// # Errors
    /// As for [`residual`](Problem::residual); [`StepError::NoJacobian`] where there is none.
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

    /// How each variable enters F (IDAS' `id`). By default the Jacobian at the start is asked, see
    /// [`kinds_at`](crate::kinds_at).
    fn kinds(&self) -> Option<Vec<VariableKind>> {
        None
    }

    /// The perturbation index of each variable: 0 for variables of an ODE, 1 to 3 for those of
    /// constrained mechanics; `None` (the default) where it is not known.
    fn indices(&self) -> Option<Vec<u8>> {
        None
    }

    /// Number of [`constraints`](Problem::constraints) that the problem states; none by default.
    fn n_constraints(&self) -> usize {
        0
    }

    /// Writes c(t, y), which is zero for every state that a solution can have, to `out`, by differential
    /// variables: for index 2 the constraints, for index 3 those and their derivatives in time, the hidden
    /// ones. Consistent initial values are found with it
    /// ([`ConsistencyMode::Constraints`](crate::ConsistencyMode::Constraints)); integrators ask for nothing.
    ///
    /// # Shapes
    /// `out`: [`n_constraints`](Problem::n_constraints).
    ///
    /// # Errors
    /// As for [`residual`](Problem::residual).
    fn constraints(&mut self, _t: f64, _y: &[f64], _out: &mut [f64]) -> Result<(), StepError> {
        Ok(())
    }

    /// A name for component `i` in messages.
    fn component_name(&self, i: usize) -> String {
        format!("y[{i}]")
    }
}

/// Problems of different types as one: what solves them is compiled once for all.
impl<P: Problem + ?Sized> Problem for Box<P> {
    fn n_unknowns(&self) -> usize {
        (**self).n_unknowns()
    }

    fn residual(
        &mut self,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
        residual: &mut [f64],
    ) -> Result<(), StepError> {
        (**self).residual(t, y, y_dot, residual)
    }

    fn jacobian_pattern(&self) -> SparsityPattern {
        (**self).jacobian_pattern()
    }

    fn jacobian(
        &mut self,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
        a: f64,
        b: f64,
        values: &mut [f64],
    ) -> Result<(), StepError> {
        (**self).jacobian(t, y, y_dot, a, b, values)
    }

    fn jacobian_parts(
        &mut self,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
        parts: [&mut [f64]; 2],
    ) -> Result<(), StepError> {
        (**self).jacobian_parts(t, y, y_dot, parts)
    }

    fn kinds(&self) -> Option<Vec<VariableKind>> {
        (**self).kinds()
    }

    fn indices(&self) -> Option<Vec<u8>> {
        (**self).indices()
    }

    fn n_constraints(&self) -> usize {
        (**self).n_constraints()
    }

    fn constraints(&mut self, t: f64, y: &[f64], out: &mut [f64]) -> Result<(), StepError> {
        (**self).constraints(t, y, out)
    }

    fn component_name(&self, i: usize) -> String {
        (**self).component_name(i)
    }
}

/// The pattern of a full n × n matrix.
pub(crate) fn full_pattern(n: usize) -> SparsityPattern {
    let offsets = (0..=n).map(|j| j * n).collect();
    let indices = (0..n * n).map(|k| k % n).collect();
    SparsityPattern::try_from_offsets_and_indices(n, n, offsets, indices)
        .expect("the columns of a full matrix are sorted and complete")
}
