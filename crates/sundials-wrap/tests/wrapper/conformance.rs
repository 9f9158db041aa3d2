//! Runs the conformance tests for integrators with IDAS.

use myovib_conformance::{AnyProblem, Method, Request};
use sundials_wrap::{IdaOptions, IdaSolver};

struct Ida;

impl Method for Ida {
    type Integrator = IdaSolver<AnyProblem>;

    fn build(&self, request: Request) -> IdaSolver<AnyProblem> {
        let (t, y, y_dot) = request.start;
        let mut builder = IdaSolver::builder(request.problem).options(IdaOptions {
            tolerances: request.tolerances,
            suppressed: request.suppressed,
            stop_time: request.stop_time,
            max_steps: request.max_steps,
            initial_step: request.initial_step,
            min_step: request.min_step,
            max_step: request.max_step,
            ..IdaOptions::default()
        });
        if let Some(weights) = request.weights {
            builder = builder.error_weights(weights);
        }
        if let Some((directions, functions)) = request.roots {
            builder = builder.roots(directions, functions);
        }
        if let Some((start, rates)) = request.quadrature {
            builder = builder.quadrature(start, None, rates);
        }
        builder.build(t, &y, &y_dot).unwrap()
    }
}

myovib_conformance::conformance_tests!(Ida);
