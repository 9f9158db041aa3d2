//! State of an integration: time, solution, problem, counters.

use myovib_dae::{Problem, Statistics};

use super::IdaSolver;
use crate::ffi::ida::Counter;

impl<P: Problem> IdaSolver<P> {
    /// Returns the time of [`y`](IdaSolver::y) and [`y_dot`](IdaSolver::y_dot).
    pub fn t(&self) -> f64 {
        self.t
    }

    /// Returns the solution at [`t`](IdaSolver::t).
    pub fn y(&self) -> &[f64] {
        self.ida.y()
    }

    /// Returns the derivative ẏ at [`t`](IdaSolver::t).
    pub fn y_dot(&self) -> &[f64] {
        self.ida.y_dot()
    }

    /// Returns the problem.
    pub fn problem(&self) -> &P {
        &self.functions().problem
    }

    /// Returns the problem, for example to change its parameters. Its size and pattern must not change. After a change
    /// that causes a jump of y or ẏ, call [`reinit`](IdaSolver::reinit).
    pub fn problem_mut(&mut self) -> &mut P {
        let functions = self.functions_mut();
        if let Some(sensitivities) = &mut functions.sensitivities {
            sensitivities.forget();
        }
        &mut functions.problem
    }

    /// Ends the integration and returns the problem.
    pub fn into_problem(self) -> P {
        self.ida.into_callbacks().problem
    }

    /// Returns the coefficient of ∂F/∂ẏ in the Newton matrix of the current step.
    pub fn c_j(&self) -> f64 {
        self.ida.c_j()
    }

    /// Returns all counters. During the integration of backward problems, returns the counters of the completed forward
    /// run.
    pub fn statistics(&self) -> Statistics {
        if let Some(left) = self.forward_run.as_ref().and_then(|forward_run| forward_run.left) {
            return left;
        }
        let ida = &self.ida;
        // IDAS treats these queries as errors if there are no quadratures.
        let of_quadratures = |counter| match self.n_quadratures() {
            0 => 0,
            _ => ida.counter(counter),
        };
        let mut statistics = Statistics::default();
        statistics.steps = ida.counter(Counter::Steps);
        statistics.error_test_failures = ida.counter(Counter::ErrorTestFailures);
        statistics.step_solve_failures = ida.counter(Counter::StepSolveFailures);
        statistics.newton_failures = ida.counter(Counter::NewtonFailures);
        statistics.newton_iterations = ida.counter(Counter::NewtonIterations);
        let within = self.functions().within.as_ref().map_or(0, |within| within.evaluations);
        statistics.residual_evaluations = ida.counter(Counter::ResidualEvaluations) + within;
        statistics.difference_evaluations = self.difference_evaluations() - self.differences_before;
        statistics.jacobian_evaluations = ida.counter(Counter::JacobianEvaluations);
        statistics.linear_setups = ida.counter(Counter::LinearSetups);
        statistics.backtracks = ida.counter(Counter::Backtracks);
        statistics.root_evaluations = ida.counter(Counter::RootEvaluations);
        statistics.quadrature_evaluations = of_quadratures(Counter::QuadratureEvaluations);
        statistics.quadrature_error_test_failures =
            of_quadratures(Counter::QuadratureErrorTestFailures);
        statistics.last_order = ida.last_order();
        statistics.current_order = ida.current_order();
        statistics.last_step = ida.last_step();
        statistics.current_step = ida.current_step();
        statistics.initial_step = ida.initial_step();
        statistics.t_reached = ida.internal_time();
        statistics.tolerance_scale_factor = ida.tolerance_scale_factor();
        statistics.last_linear_flag = ida.last_linear_flag();
        statistics.smallest_rcond = self.functions().linear.smallest_rcond();
        statistics
    }

    /// Returns the size of the next step; 0 before the first step.
    pub fn current_step(&self) -> f64 {
        self.ida.current_step()
    }

    /// Returns the interval of the last accepted step, for which dense output is available. Before the first step, both
    /// ends are the initial time.
    pub fn last_step_interval(&self) -> [f64; 2] {
        let to = self.ida.internal_time();
        [to - self.ida.last_step(), to]
    }

    /// Returns the number of quadratures.
    pub fn n_quadratures(&self) -> usize {
        self.ida.n_quadratures()
    }
}

impl<P: Problem> std::fmt::Debug for IdaSolver<P> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("IdaSolver")
            .field("n", &self.n)
            .field("t", &self.t)
            .field("statistics", &self.statistics())
            .finish_non_exhaustive()
    }
}
