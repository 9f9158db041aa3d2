//! Checks that a step does not allocate memory, including the search for events.
#![allow(clippy::unwrap_used)] // a test may panic

use myovib_conformance::samples::{Heat2d, Sample};
use myovib_conformance::{AnyProblem, Method, Request};
use myovib_dae::{Direction, Outcome, Tolerances};
use myovib_radau::{RadauOptions, RadauSolver};

#[test]
fn steps_allocate_nothing() {
    let heat = Heat2d::new(20);
    let start = heat.start();
    let options = RadauOptions {
        tolerances: Tolerances::scalar(1e-6, 1e-6),
        // A new Jacobian and new factors are computed in every step.
        jacobian_reuse: 0.0,
        step_window: (1.0, 1.0),
        ..RadauOptions::default()
    };
    let mut solver = RadauSolver::builder(heat)
        .options(options)
        .roots([Direction::Both], |_, _, y, _, g| {
            // The root function never becomes zero, because the temperature remains positive.
            g[0] = 1.0 + y[0];
            Ok(())
        })
        .build(0.0, &start.y, &start.y_dot)
        .unwrap();
    // Pivots are selected in the first steps.
    solver.step(0.3).unwrap();
    let before = solver.statistics();
    let allocations = allocation_counter::measure(|| {
        while solver.t() < 0.3 {
            assert!(matches!(solver.step(0.3).unwrap(), Outcome::StepTaken { .. }));
        }
    });
    let after = solver.statistics();
    assert!(after.steps > before.steps + 5 && after.linear_setups > before.linear_setups + 5);
    assert_eq!(allocations.count_total, 0);
}

/// Builds Radau IIA solvers with default settings.
struct Radau {
    stages: usize,
}

impl Method for Radau {
    type Integrator = RadauSolver<AnyProblem>;

    fn build(&self, request: Request) -> RadauSolver<AnyProblem> {
        let (t, y, y_dot) = request.start;
        RadauSolver::builder(request.problem)
            .options(RadauOptions {
                stages: self.stages,
                tolerances: request.tolerances,
                ..RadauOptions::default()
            })
            .build(t, &y, &y_dot)
            .unwrap()
    }
}

#[test]
fn steps_of_small_problems_allocate_nothing() {
    for stages in [3, 5, 7] {
        let count = |call: &mut dyn FnMut()| allocation_counter::measure(call).count_total;
        myovib_conformance::steps_allocate_nothing(&Radau { stages }, count);
    }
}
