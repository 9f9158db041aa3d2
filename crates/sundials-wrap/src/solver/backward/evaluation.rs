//! Functions that IDAS calls during the integration of backward problems.

use super::super::callbacks::UserFunctions;
use crate::adjoint::{At, ForwardState};
use crate::ffi::callbacks::{Answer, BackwardCallbacks, ForwardView};
use myovib_dae::{Linearization, Problem};

impl ForwardState {
    fn set(&mut self, view: &ForwardView<'_>) {
        self.t = view.t;
        self.y.copy_from_slice(view.y);
        self.y_dot.copy_from_slice(view.y_dot);
        for (pair, values) in self.s.iter_mut().zip(&view.s) {
            pair[0].copy_from_slice(values[0]);
            pair[1].copy_from_slice(values[1]);
        }
    }

    pub(super) fn view(&self) -> ForwardView<'_> {
        let pairs = self.s.iter().map(|[s, s_dot]| [s.as_slice(), s_dot.as_slice()]);
        ForwardView { t: self.t, y: &self.y, y_dot: &self.y_dot, s: pairs.collect() }
    }
}

impl<P: Problem> BackwardCallbacks for UserFunctions<P> {
    fn backward_residual(
        &mut self,
        which: usize,
        forward: &ForwardView<'_>,
        [values, rates]: [&[f64]; 2],
        residual: &mut [f64],
    ) -> Answer {
        self.t_called = forward.t;
        self.repeating.weights = 0;
        let registered = &mut self.backward[which];
        registered.state.set(forward);
        let problem = &mut self.problem;
        let result =
            (registered.problem).residual(problem, &registered.state, values, rates, residual);
        self.failures.answer("residual of a backward problem", forward.t, result, residual)
    }

    fn backward_setup(
        &mut self,
        which: usize,
        forward: &ForwardView<'_>,
        [values, rates]: [&[f64]; 2],
        c_j: f64,
    ) -> Answer {
        let registered = &mut self.backward[which];
        registered.state.set(forward);
        registered.tolerances.write_weights(values, &mut registered.weights);
        let at = Linearization {
            t: forward.t,
            y: values,
            y_dot: rates,
            step: 1.0 / c_j,
            weights: &registered.weights,
        };
        let mut problem = At {
            problem: registered.problem.as_mut(),
            forward: &mut self.problem,
            state: &registered.state,
        };
        let (evaluated, entries) = registered.lu.evaluate(&mut problem, &at, c_j);
        match self.failures.answer("Jacobian", forward.t, evaluated, entries) {
            Answer::Success => {}
            failed => return failed,
        }
        let result = registered.lu.factorize();
        self.failures.answer("linear setup", forward.t, result, &[])
    }

    fn backward_solve(&mut self, which: usize, rhs: &mut [f64]) -> Answer {
        let result = self.backward[which].lu.solve(rhs);
        self.failures.answer("linear solve", self.t_called, result, rhs)
    }

    fn backward_quadrature(
        &mut self,
        which: usize,
        forward: &ForwardView<'_>,
        [values, rates]: [&[f64]; 2],
        out: &mut [f64],
    ) -> Answer {
        let registered = &mut self.backward[which];
        registered.state.set(forward);
        let problem = &mut self.problem;
        let result =
            (registered.problem).quadrature(problem, &registered.state, values, rates, out);
        self.failures.answer("quadrature of a backward problem", forward.t, result, out)
    }
}
