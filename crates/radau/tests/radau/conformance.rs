//! Runs the conformance tests for integrators with Radau IIA.

use myovib_conformance::{AnyProblem, Method, Request};
use myovib_radau::{RadauOptions, RadauSolver};

pub(crate) struct Radau {
    pub(crate) stages: usize,
}

impl Method for Radau {
    type Integrator = RadauSolver<AnyProblem>;

    fn weight_factor(&self, relative: f64) -> f64 {
        let options = RadauOptions { stages: self.stages, ..RadauOptions::default() };
        options.internal_factor(relative)
    }

    fn build(&self, request: Request) -> RadauSolver<AnyProblem> {
        let (t, y, y_dot) = request.start;
        let mut builder = RadauSolver::builder(request.problem).options(RadauOptions {
            stages: self.stages,
            tolerances: request.tolerances,
            suppressed: request.suppressed,
            stop_time: request.stop_time,
            max_steps: request.max_steps,
            initial_step: request.initial_step,
            min_step: request.min_step,
            max_step: request.max_step,
            ..RadauOptions::default()
        });
        if let Some(weights) = request.weights {
            builder = builder.error_weights(weights);
        }
        if let Some((directions, functions)) = request.roots {
            builder = builder.roots(directions, functions);
        }
        if let Some((start, rates)) = request.quadrature {
            builder = builder.quadrature(start, rates);
        }
        builder.build(t, &y, &y_dot).unwrap()
    }
}

mod order_5 {
    myovib_conformance::conformance_tests!(super::Radau { stages: 3 });
}

mod order_9 {
    myovib_conformance::conformance_tests!(super::Radau { stages: 5 });
}

mod order_13 {
    myovib_conformance::conformance_tests!(super::Radau { stages: 7 });
}
