//! Integrations limited by the number of steps, the smallest tolerance, or a constraint.

use myovib_dae::{Outcome, StopReason, Tolerances};

use sundials_wrap::{Constraint, IdaOptions, IdaSolver};

use crate::decay::{Decay, stop};

#[test]
fn too_many_steps_is_an_outcome_and_the_next_call_goes_on() {
    let options = IdaOptions { max_steps: Some(5), ..IdaOptions::default() };
    let mut solver =
        IdaSolver::builder(Decay::new()).options(options).build(0.0, &[1.0], &[-1.0]).unwrap();
    let first = stop(solver.integrate_to(1.0));
    assert_eq!((first.reason, first.statistics.steps), (StopReason::MaxSteps, 5));
    while matches!(solver.integrate_to(1.0).unwrap(), Outcome::Stopped(_)) {}
    assert_eq!(solver.t(), 1.0);
}

/// ẏ = −1 from y = 1 with the constraint y ≥ 0. The steps become small near t = 1.
#[test]
fn a_constraint_holds_the_integration_up() {
    let mut problem = Decay::residual(|_, _| Ok(1.0));
    problem.jacobian = Box::new(|_| Ok(0.0));
    let constraints = vec![Constraint::NonNegative];
    let options = IdaOptions { constraints, ..IdaOptions::default() };
    let mut solver =
        IdaSolver::builder(problem).options(options).build(0.0, &[1.0], &[-1.0]).unwrap();
    let stop = stop(solver.integrate_to(2.0));
    // IDAS allows each step to violate the constraint by the tolerance of Newton's method, so the solution continues in
    // small steps.
    let creep = 500.0 * 0.33 * 1e-8;
    assert!((stop.t - 1.0).abs() < creep && solver.y()[0] > -creep, "{stop}");
    assert_eq!(stop.reason, StopReason::MaxSteps, "{stop}");
}

#[test]
fn too_tight_a_tolerance_is_named() {
    let tight = Tolerances::scalar(0.0, 1e-20);
    let mut solver =
        IdaSolver::builder(Decay::new()).tolerances(tight).build(0.0, &[1.0], &[-1.0]).unwrap();
    let stop = stop(solver.integrate_to(1.0));
    assert_eq!(stop.reason, StopReason::ToleranceTooTight, "{stop}");
    assert!(stop.statistics.tolerance_scale_factor > 1.0, "{stop}");
}
