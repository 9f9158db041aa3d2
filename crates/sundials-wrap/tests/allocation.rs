//! Checks that a step does not allocate memory in Rust code.
#![allow(clippy::unwrap_used)] // a test may panic

use myovib_conformance::{AnyProblem, Method, Request, steps_allocate_nothing};
use sundials_wrap::IdaSolver;

/// Builds IDAS solvers with default settings.
struct Ida;

impl Method for Ida {
    type Integrator = IdaSolver<AnyProblem>;

    fn build(&self, request: Request) -> IdaSolver<AnyProblem> {
        let (t, y, y_dot) = request.start;
        IdaSolver::builder(request.problem)
            .tolerances(request.tolerances)
            .build(t, &y, &y_dot)
            .unwrap()
    }
}

#[test]
fn steps_of_small_problems_allocate_nothing() {
    steps_allocate_nothing(&Ida, |call| allocation_counter::measure(call).count_total);
}
