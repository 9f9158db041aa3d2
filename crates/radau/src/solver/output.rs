//! Results and settings available between steps.

use myovib_dae::checks::{expect_dense_output, expect_finite_value, expect_length};
use myovib_dae::{IntegratorError, LinearSolver, Problem, Statistics};

use super::state::RadauSolver;
use crate::error::RadauError;
use crate::internal_variables::EliminatedVariables;
use crate::method::Method;
use crate::quadrature::Quadrature;

impl<P: Problem, M: LinearSolver<P>> RadauSolver<P, M> {
    /// Writes the solution or its first derivative at a time within the last step to `out`.
    ///
    /// Dense output is the polynomial of degree s + 1 through the stages whose initial derivative equals the derivative
    /// at the end of the previous step. The error of the polynomial is O(h^(s+2)), and the error of its derivative is
    /// O(h^(s+1)). In the first step, this requires a correct ẏ_0. For algebraic variables, the polynomial has degree
    /// s, and its order is lower by one. [`RadauOptions::dense_output`](crate::RadauOptions::dense_output) limits the
    /// error. For variables of index 2 and 3, the errors have the same orders as at the ends of the step, O(h^s) and
    /// O(h^(s−1)).
    ///
    /// # Shapes
    /// `out`: the number of unknowns.
    ///
    /// # Errors
    /// Returns [`IntegratorError::NoDenseOutput`] if `t` is outside the last step or if `derivative` is above 1, and
    /// [`IntegratorError::WrongLength`].
    pub fn dense_output(
        &self,
        t: f64,
        derivative: usize,
        out: &mut [f64],
    ) -> Result<(), RadauError> {
        expect_length("dense output", self.y.len(), out.len())?;
        expect_dense_output(t, derivative, 1, self.last_step_interval())?;
        self.collocation.evaluate(&self.method, t, derivative, out);
        Ok(())
    }

    /// Returns the number of quadratures.
    pub fn n_quadratures(&self) -> usize {
        self.quadrature.as_ref().map_or(0, Quadrature::len)
    }

    /// Writes the quadratures at [`t`](RadauSolver::t) to `out`.
    ///
    /// # Errors
    /// Returns [`IntegratorError::NoQuadrature`] or [`IntegratorError::WrongLength`].
    pub fn quadrature(&self, out: &mut [f64]) -> Result<(), RadauError> {
        self.quadrature_dense_output(self.t(), 0, out)
    }

    /// Evaluates the quadratures, or their integrands if `derivative` is 1, as
    /// [`dense_output`](RadauSolver::dense_output) evaluates the solution.
    ///
    /// # Errors
    /// Returns [`IntegratorError::NoQuadrature`], and the errors of [`dense_output`](RadauSolver::dense_output).
    pub fn quadrature_dense_output(
        &self,
        t: f64,
        derivative: usize,
        out: &mut [f64],
    ) -> Result<(), RadauError> {
        let Some(quadrature) = &self.quadrature else {
            return Err(IntegratorError::NoQuadrature.into());
        };
        expect_length("quadratures", quadrature.len(), out.len())?;
        expect_dense_output(t, derivative, 1, self.last_step_interval())?;
        quadrature.last().evaluate(&self.method, t, derivative, out);
        Ok(())
    }

    /// Returns the number of states of the internal variables.
    pub fn n_internal_variables(&self) -> usize {
        self.internal.as_ref().map_or(0, EliminatedVariables::n_states)
    }

    /// Fails if there are internal variables.
    pub(crate) fn expect_no_internal_variables(&self) -> Result<(), RadauError> {
        match self.internal {
            None => Ok(()),
            Some(_) => Err(RadauError::InternalVariables),
        }
    }

    /// Evaluates the states of the internal variables as [`dense_output`](RadauSolver::dense_output) evaluates the
    /// solution.
    ///
    /// # Errors
    /// Returns the same errors as [`dense_output`](RadauSolver::dense_output).
    pub fn internal_variables_dense_output(
        &self,
        t: f64,
        derivative: usize,
        out: &mut [f64],
    ) -> Result<(), RadauError> {
        expect_length("internal variables", self.n_internal_variables(), out.len())?;
        expect_dense_output(t, derivative, 1, self.last_step_interval())?;
        if let Some(internal) = &self.internal {
            internal.evaluate(&self.method, &self.collocation, t, derivative, out);
        }
        Ok(())
    }

    /// Returns the start and end of the last accepted step, for which dense output is available. Before the first step,
    /// both are the initial time.
    pub fn last_step_interval(&self) -> [f64; 2] {
        match self.counters.statistics.steps {
            0 => [self.t, self.t],
            _ => [self.collocation.t0, self.t],
        }
    }

    /// Sets a stop time. No step passes this time, and the stop time is removed when it is reached.
    ///
    /// # Errors
    /// Returns [`IntegratorError::NotFinite`] or [`IntegratorError::TimeBehind`].
    pub fn set_stop_time(&mut self, t: f64) -> Result<(), RadauError> {
        expect_finite_value("stop_time", t)?;
        if t < self.t() {
            return Err(IntegratorError::TimeBehind { t_out: t, t: self.t() }.into());
        }
        self.options.stop_time = Some(t);
        Ok(())
    }

    /// Sets whether the next steps detect inputs between their stages; see
    /// [`RadauOptions::detect_inputs`](crate::RadauOptions::detect_inputs).
    pub fn detect_inputs(&mut self, detect: bool) {
        self.options.detect_inputs = detect;
    }

    /// Returns the current time.
    pub fn t(&self) -> f64 {
        self.pause.as_ref().map_or(self.t, |pause| pause.t)
    }

    /// Returns the solution at the current time.
    pub fn y(&self) -> &[f64] {
        self.pause.as_ref().map_or(&self.y, |pause| &pause.y)
    }

    /// Returns the derivative of the collocation polynomial at the current time, or ẏ_0 at the start.
    pub fn y_dot(&self) -> &[f64] {
        self.pause.as_ref().map_or(&self.y_dot, |pause| &pause.y_dot)
    }

    /// Returns the problem.
    pub fn problem(&self) -> &P {
        &self.problem
    }

    /// Returns the problem for modification. Use this method with care: the previous solution belongs to the unmodified
    /// problem.
    pub fn problem_mut(&mut self) -> &mut P {
        &mut self.problem
    }

    /// Returns the problem and drops the solver.
    pub fn into_problem(self) -> P {
        self.problem
    }

    /// Returns the method.
    pub fn method(&self) -> &Method {
        &self.method
    }

    /// Returns all counters.
    pub fn statistics(&self) -> Statistics {
        let mut statistics = self.counters.statistics;
        statistics.current_order = self.method.order();
        statistics.current_step = self.h.unwrap_or(0.0);
        statistics.t_reached = self.t();
        statistics.difference_evaluations =
            self.matrices.difference_evaluations().wrapping_sub(self.differences_before);
        statistics.work = Some(self.counters.work);
        statistics
    }
}
