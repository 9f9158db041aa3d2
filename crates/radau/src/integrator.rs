//! Radau IIA as an [`Integrator`].

use myovib_dae::{ConsistencyMode, Integrator, LinearSolver, Outcome, Problem, Statistics};

use crate::error::RadauError;
use crate::solver::RadauSolver;

impl<P: Problem, M: LinearSolver<P>> Integrator<P> for RadauSolver<P, M> {
    type Error = RadauError;

    fn step(&mut self, t_out: f64) -> Result<Outcome, RadauError> {
        self.step(t_out)
    }

    fn integrate_to(&mut self, t_out: f64) -> Result<Outcome, RadauError> {
        self.integrate_to(t_out)
    }

    fn set_stop_time(&mut self, t: f64) -> Result<(), RadauError> {
        self.set_stop_time(t)
    }

    fn reinit(
        &mut self,
        t0: f64,
        y0: &[f64],
        y_dot0: &[f64],
        q0: &[f64],
    ) -> Result<(), RadauError> {
        self.reinit_with(t0, y0, y_dot0, q0)
    }

    fn correct_initial_values(
        &mut self,
        mode: ConsistencyMode,
        t_first: f64,
    ) -> Result<(), RadauError> {
        self.correct_initial_values(mode, t_first)
    }

    fn t(&self) -> f64 {
        self.t()
    }

    fn y(&self) -> &[f64] {
        self.y()
    }

    fn y_dot(&self) -> &[f64] {
        self.y_dot()
    }

    fn last_step_interval(&self) -> [f64; 2] {
        self.last_step_interval()
    }

    fn dense_output(
        &mut self,
        t: f64,
        derivative: usize,
        out: &mut [f64],
    ) -> Result<(), RadauError> {
        (*self).dense_output(t, derivative, out)
    }

    fn n_quadratures(&self) -> usize {
        self.n_quadratures()
    }

    fn quadrature_dense_output(
        &mut self,
        t: f64,
        derivative: usize,
        out: &mut [f64],
    ) -> Result<(), RadauError> {
        (*self).quadrature_dense_output(t, derivative, out)
    }

    fn statistics(&self) -> Statistics {
        self.statistics()
    }

    fn problem(&self) -> &P {
        self.problem()
    }

    fn problem_mut(&mut self) -> &mut P {
        self.problem_mut()
    }
}
