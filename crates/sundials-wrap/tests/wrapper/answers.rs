//! Queries of a solver and its problem.

use myovib_conformance::samples::{Heat2d, Robertson, Sample};
use myovib_dae::IntegratorError::NoDenseOutput;
use myovib_dae::{Problem, StepError, StopReason, Tolerances};

use sundials_wrap::{Error, IdaSolver};

use crate::decay::{Decay, stop};

fn started() -> IdaSolver<Robertson> {
    let start = Robertson.start();
    IdaSolver::builder(Robertson).build(start.t, &start.y, &start.y_dot).unwrap()
}

/// IDAS starts with the backward Euler method, for which c_j is the reciprocal of the step size.
#[test]
fn c_j_is_the_inverse_of_the_step_at_order_one() {
    let mut solver = started();
    solver.step(1.0).unwrap();
    let stats = solver.statistics();
    assert_eq!(stats.last_order, 1);
    assert_eq!(solver.c_j(), 1.0 / stats.last_step);
    assert_eq!(solver.current_step(), stats.current_step);
}

#[test]
fn the_default_parts_of_a_jacobian_make_the_whole() {
    let mut problem = Heat2d::new(4);
    let start = problem.start();
    let n = problem.jacobian_pattern().nnz();
    let [mut df_dy, mut df_dyp, mut whole] = [(); 3].map(|()| vec![f64::NAN; n]);
    let parts = [df_dy.as_mut_slice(), df_dyp.as_mut_slice()];
    problem.jacobian_parts(0.0, &start.y, &start.y_dot, parts).unwrap();
    problem.jacobian(0.0, &start.y, &start.y_dot, 2.0, 8.0, &mut whole).unwrap();
    for ((a, b), whole) in df_dy.iter().zip(&df_dyp).zip(&whole) {
        // The results are exact, because the factors are powers of two and each entry belongs to only one of the
        // matrices. On the diagonal, a sum is rounded.
        assert!((2.0 * a + 8.0 * b - whole).abs() <= f64::EPSILON * whole.abs());
    }
}

#[test]
fn components_have_a_name_and_solvers_a_form_to_print() {
    assert_eq!(Robertson.component_name(2), "y[2]");
    let printed = format!("{:?}", started());
    assert!(printed.starts_with("IdaSolver { n: 3, t: 0.0"), "{printed}");
}

#[test]
fn the_span_of_dense_output_is_the_last_step() {
    let mut solver = started();
    solver.integrate_to(0.4).unwrap();
    let error = solver.dense_output(-1.0, 0, &mut [0.0; 3]).unwrap_err();
    let Error::Common(NoDenseOutput { from, to, .. }) = error else { panic!("{error}") };
    let stats = solver.statistics();
    assert_eq!((from, to), (stats.t_reached - stats.last_step, stats.t_reached));
    assert!(from < 0.4 && to >= 0.4, "{from} {to}");
}

#[test]
fn either_tolerance_may_be_zero_where_the_other_is_not() {
    for tolerances in
        [Tolerances::vector(0.0, [1e-6, 1e-8, 1e-6]), Tolerances::vector(1e-4, [1e-8, 1e-10, 0.0])]
    {
        let start = Robertson.start();
        IdaSolver::builder(Robertson)
            .tolerances(tolerances)
            .build(start.t, &start.y, &start.y_dot)
            .unwrap();
    }
}

/// At t = 1e9, a step below 1e-7 does not change t. Such a step results from ten failures of Newton's method, each of
/// which reduces the step to a quarter.
#[test]
fn steps_that_are_lost_in_rounding_are_too_small() {
    let run = |t0: f64| {
        let mut calls = 0;
        let problem = Decay::jacobian(move |_| {
            calls += 1;
            match calls {
                1..=3 => Ok(1.0),
                _ => Err(StepError::Recoverable("no matrix".into())),
            }
        });
        let mut solver = IdaSolver::builder(problem).build(t0, &[1.0], &[-1.0]).unwrap();
        stop(solver.integrate_to(t0 + 1.0)).reason
    };
    assert_eq!(run(0.0), StopReason::JacobianFailed);
    assert_eq!(run(1e9), StopReason::StepTooSmall);
}
