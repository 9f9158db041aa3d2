//! What can be asked of the integrator between steps.

use myovib_dae::{LinearSolver, Problem, Statistics, covers};

use super::state::RadauSolver;
use crate::error::{RadauError, expect_finite, expect_length};
use crate::memory::Memory;
use crate::method::Method;
use crate::options::StepSize;
use crate::quadrature::Quadrature;

impl<P: Problem, M: LinearSolver<P>> RadauSolver<P, M> {
    /// Evaluates the solution, or its derivative, at a time within the last step.
    ///
    /// The polynomial of degree s + 1 through the stages, with the derivative of the step before at
    /// its beginning. Its error is O(h^(s+2)), that of its derivative O(h^(s+1)). In the first step
    /// that takes the right ẏ_0. In algebraic variables it is the polynomial of degree s, and one
    /// order less. [`RadauOptions::dense_output`](crate::RadauOptions::dense_output) limits its error. Variables of index 2 and 3 have that of the
    /// ends, O(h^s) and O(h^(s−1)).
    ///
    /// # Shapes
    /// `out`: the number of unknowns.
    ///
    /// # Errors
    /// [`RadauError::NoDenseOutput`] outside of the last step or for a `derivative` above 1,
    /// [`RadauError::WrongLength`].
    pub fn dense_output(
        &self,
        t: f64,
        derivative: usize,
        out: &mut [f64],
    ) -> Result<(), RadauError> {
        expect_length("dense output", self.y.len(), out.len())?;
        self.expect_within_reach(t, derivative)?;
        self.collocation.evaluate(&self.method, t, derivative, out);
        Ok(())
    }

    /// Number of quadratures.
    pub fn n_quadratures(&self) -> usize {
        self.quadrature.as_ref().map_or(0, Quadrature::len)
    }

    /// Writes the quadratures at [`t`](RadauSolver::t) to `out`.
    ///
    /// # Errors
    /// [`RadauError::NoQuadrature`], [`RadauError::WrongLength`].
    pub fn quadrature(&self, out: &mut [f64]) -> Result<(), RadauError> {
        self.quadrature_dense_output(self.t(), 0, out)
    }

    /// As [`dense_output`](RadauSolver::dense_output), for the quadratures and, as the first derivative,
    /// for what they integrate.
    ///
    /// # Errors
    /// [`RadauError::NoQuadrature`], and as there.
    pub fn quadrature_dense_output(
        &self,
        t: f64,
        derivative: usize,
        out: &mut [f64],
    ) -> Result<(), RadauError> {
        let Some(quadrature) = &self.quadrature else {
            return Err(RadauError::NoQuadrature);
        };
        expect_length("quadratures", quadrature.len(), out.len())?;
        self.expect_within_reach(t, derivative)?;
        quadrature.last().evaluate(&self.method, t, derivative, out);
        Ok(())
    }

    /// Number of states of the fading memory.
    pub fn n_memory(&self) -> usize {
        self.memory.as_ref().map_or(0, Memory::n_states)
    }

    /// That all states are unknowns.
    pub(crate) fn expect_no_memory(&self) -> Result<(), RadauError> {
        match self.memory {
            None => Ok(()),
            Some(_) => Err(RadauError::Fading),
        }
    }

    /// As [`dense_output`](RadauSolver::dense_output), for the states of the fading memory.
    ///
    /// # Errors
    /// As there.
    pub fn memory_dense_output(
        &self,
        t: f64,
        derivative: usize,
        out: &mut [f64],
    ) -> Result<(), RadauError> {
        expect_length("memory", self.n_memory(), out.len())?;
        self.expect_within_reach(t, derivative)?;
        if let Some(memory) = &self.memory {
            memory.evaluate(&self.method, &self.collocation, t, derivative, out);
        }
        Ok(())
    }

    /// As [`estimated_local_errors`](RadauSolver::estimated_local_errors), for the states of the fading
    /// memory.
    ///
    /// # Errors
    /// As there.
    pub fn estimated_memory_errors(&self, out: &mut [f64]) -> Result<(), RadauError> {
        expect_length("memory's errors", self.n_memory(), out.len())?;
        let tested = matches!(self.options.step_size, StepSize::Adaptive);
        match &self.memory {
            Some(memory) if tested && self.counters.statistics.steps > 0 => {
                memory.write_estimates((&self.method, self.collocation.h), out);
            }
            _ => out.fill(0.0),
        }
        Ok(())
    }

    /// That the last step has this derivative at `t`.
    fn expect_within_reach(&self, t: f64, derivative: usize) -> Result<(), RadauError> {
        let [from, to] = self.last_step_interval();
        match derivative <= 1 && covers([from, to], t) {
            true => Ok(()),
            false => Err(RadauError::NoDenseOutput {
                t,
                derivative,
                from,
                to,
            }),
        }
    }

    /// Writes the error test's estimate of the last step to `out`, zeros before the first and at fixed
    /// steps. It costs no evaluation of the problem. Components left out of the test have theirs too.
    ///
    /// The estimate has the order s + 1; what the step adds to the error is less, see
    /// [`errors_per_estimate`](RadauSolver::errors_per_estimate).
    ///
    /// # Shapes
    /// `out`: the number of unknowns.
    ///
    /// # Errors
    /// [`RadauError::WrongLength`].
    pub fn estimated_local_errors(&self, out: &mut [f64]) -> Result<(), RadauError> {
        expect_length("local errors", self.y.len(), out.len())?;
        let tested = matches!(self.options.step_size, StepSize::Adaptive);
        match tested && self.counters.statistics.steps > 0 {
            true => out.copy_from_slice(self.error_test.estimates()),
            false => out.fill(0.0),
        }
        Ok(())
    }

    /// What a quantity that vibrates errs by, per what is estimated of it, where the estimate is
    /// `relative` times the size of its vibration: what the step adds to the error at its end, and the
    /// error of dense output within it.
    pub fn errors_per_estimate(&self, relative: f64) -> [f64; 2] {
        self.method.errors_per_estimate(relative)
    }

    /// The ends of the last step accepted, which dense output covers; both are the initial time
    /// before the first step.
    pub fn last_step_interval(&self) -> [f64; 2] {
        match self.counters.statistics.steps {
            0 => [self.t, self.t],
            _ => [self.collocation.t0, self.t],
        }
    }

    /// Sets the time not to step over, until it is reached.
    ///
    /// # Errors
    /// [`RadauError::NotFinite`], [`RadauError::TimeBehind`].
    pub fn set_stop_time(&mut self, t: f64) -> Result<(), RadauError> {
        expect_finite("stop_time", &[t])?;
        if t < self.t() {
            return Err(RadauError::TimeBehind {
                t_out: t,
                t: self.t(),
            });
        }
        self.options.stop_time = Some(t);
        Ok(())
    }

    /// The time reached.
    pub fn t(&self) -> f64 {
        self.pause.as_ref().map_or(self.t, |pause| pause.t)
    }

    /// The solution there.
    pub fn y(&self) -> &[f64] {
        self.pause.as_ref().map_or(&self.y, |pause| &pause.y)
    }

    /// Its derivative there: that of the collocation polynomial, at the start ẏ_0.
    pub fn y_dot(&self) -> &[f64] {
        self.pause
            .as_ref()
            .map_or(&self.y_dot, |pause| &pause.y_dot)
    }

    /// The problem.
    pub fn problem(&self) -> &P {
        &self.problem
    }

    /// The problem, to be changed with care: the solution so far was that of the old one.
    pub fn problem_mut(&mut self) -> &mut P {
        &mut self.problem
    }

    /// Gives the problem back.
    pub fn into_problem(self) -> P {
        self.problem
    }

    /// The method in use.
    pub fn method(&self) -> &Method {
        &self.method
    }

    /// All counters.
    pub fn statistics(&self) -> Statistics {
        let mut statistics = self.counters.statistics;
        statistics.current_order = self.method.order();
        statistics.current_step = self.h.unwrap_or(0.0);
        statistics.t_reached = self.t();
        statistics.difference_evaluations = self
            .matrices
            .difference_evaluations()
            .wrapping_sub(self.differences_before);
        statistics.work = Some(self.counters.work);
        statistics
    }
}
