//! The search for consistent initial values.

use myovib_dae::samples::{Heat2d, Robertson, Sample};
use myovib_dae::{Outcome, Problem, StepError, Suppressed, VariableKind};
use sundials_wrap::{ConsistencyMode, IdaOptions, IdaSolver, InitialValueOptions};

use crate::common::tolerance;

/// SUNDIALS' example repairs a boundary value of 0.1: the corrected one must be 0, and the
/// derivatives inside must follow it.
#[test]
fn wrong_algebraic_values_are_repaired() {
    let sample = Heat2d::new(10);
    let start = sample.start();
    let mut wrong = start.y.clone();
    for (value, kind) in wrong.iter_mut().zip(sample.kinds().unwrap()) {
        if kind == VariableKind::Algebraic {
            *value = 0.1;
        }
    }
    // The components excluded from the error test differ from the algebraic components.
    let mut left_out = vec![false; 100];
    left_out[55] = true;
    let options = IdaOptions {
        suppressed: Suppressed::Components(left_out),
        ..tolerance(1e-8)
    };
    let mut solver = IdaSolver::builder(sample)
        .options(options)
        .build(0.0, &wrong, &[0.0; 100])
        .unwrap();
    let mode = ConsistencyMode::AlgebraicAndDerivatives;
    solver.correct_initial_values(mode, 0.01).unwrap();
    for (ours, exact) in solver.y().iter().zip(&start.y) {
        assert!((ours - exact).abs() < 1e-8, "{ours} ≠ {exact}");
    }
    for ((ours, exact), kind) in solver
        .y_dot()
        .iter()
        .zip(&start.y_dot)
        .zip(sample.kinds().unwrap())
    {
        // Newton's tolerance on y, times 4/Δx² = 324.
        let wanted = kind == VariableKind::Differential;
        assert!(
            !wanted || (ours - exact).abs() < 324.0 * 1e-8,
            "{ours} ≠ {exact}"
        );
    }
    assert_eq!(
        solver.integrate_to(0.01).unwrap(),
        Outcome::Reached { t: 0.01 }
    );
}

#[test]
fn consistent_values_of_robertson_are_found() {
    let start = Robertson.start();
    let builder = IdaSolver::builder(Robertson).options(tolerance(1e-8));
    let mut solver = builder.build(0.0, &[1.0, 0.0, 0.3], &[0.0; 3]).unwrap();
    let mode = ConsistencyMode::AlgebraicAndDerivatives;
    solver.correct_initial_values(mode, 0.4).unwrap();
    for (ours, exact) in solver.y().iter().zip(&start.y) {
        assert!((ours - exact).abs() < 1e-8, "{ours} ≠ {exact}");
    }
    for (ours, exact) in solver.y_dot()[..2].iter().zip(&start.y_dot) {
        assert!((ours - exact).abs() < 1e-8, "{ours} ≠ {exact}");
    }
}

/// A temperature from its rate of change: the discrete Poisson equation.
#[test]
fn states_are_found_from_derivatives() {
    let start = Heat2d::new(10).start();
    let builder = IdaSolver::builder(Heat2d::new(10)).options(tolerance(1e-10));
    let mut solver = builder.build(0.0, &[0.0; 100], &start.y_dot).unwrap();
    solver
        .correct_initial_values(ConsistencyMode::States, 0.01)
        .unwrap();
    for (ours, exact) in solver.y().iter().zip(&start.y) {
        assert!((ours - exact).abs() < 1e-10, "{ours} ≠ {exact}");
    }
    assert_eq!(solver.y_dot(), start.y_dot);
}

/// From far away Newton needs several iterations: with too few the search fails, with a loose
/// tolerance it ends early.
#[test]
fn controls_of_the_search_for_initial_values_reach_idas() {
    struct Root;
    impl Problem for Root {
        fn n_unknowns(&self) -> usize {
            2
        }
        fn residual(
            &mut self,
            _: f64,
            y: &[f64],
            y_dot: &[f64],
            residual: &mut [f64],
        ) -> Result<(), StepError> {
            residual[0] = y_dot[0] + y[0];
            residual[1] = y[1].atan() - 0.5 * y[0];
            Ok(())
        }
    }
    let search = |initial_values: InitialValueOptions| {
        let options = IdaOptions {
            initial_values,
            ..tolerance(1e-6)
        };
        let mut solver =
            IdaSolver::builder(Root)
                .options(options)
                .build(0.0, &[1.0, 1.5], &[-1.0, 0.0])?;
        let mode = ConsistencyMode::AlgebraicAndDerivatives;
        let found = solver.correct_initial_values(mode, 1.0);
        found.map(|()| solver.y()[1])
    };
    let all = InitialValueOptions::default();
    let found = search(all).unwrap();
    // Newton's tolerance is 0.0033 of 1e-6.
    assert!((found - 0.5f64.tan()).abs() < 1e-7, "{found}");
    let poor = InitialValueOptions {
        max_iterations: 1,
        max_jacobians: 1,
        max_scales: 1,
        ..all
    };
    assert!(search(poor).is_err());
    let loose = InitialValueOptions {
        nonlinear_coefficient: 1e3,
        ..all
    };
    assert!((search(loose).unwrap() - found).abs() > 1e-9);
    let none = InitialValueOptions {
        max_scales: 0,
        ..all
    };
    let message = search(none).unwrap_err().to_string();
    assert_eq!(
        message,
        "initial_values.max_scales = 0: must be a positive count"
    );
}
