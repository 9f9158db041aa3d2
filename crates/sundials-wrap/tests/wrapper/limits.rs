//! Limits that are reached: of the number of steps, of the tolerance, of a constraint.

use myovib_dae::{Outcome, StopReason, Tolerances};

use sundials_wrap::{Constraint, IdaOptions, IdaSolver};

use crate::decay::{Decay, stop};

#[test]
fn too_many_steps_is_an_outcome_and_the_next_call_goes_on() {
    let options = IdaOptions {
        max_steps: Some(5),
        ..IdaOptions::default()
    };
    let mut solver = IdaSolver::builder(Decay::new())
        .options(options)
        .build(0.0, &[1.0], &[-1.0])
        .unwrap();
    let first = stop(solver.integrate_to(1.0));
    assert_eq!(
        (first.reason, first.statistics.steps),
        (StopReason::MaxSteps, 5)
    );
    while matches!(solver.integrate_to(1.0).unwrap(), Outcome::Stopped(_)) {}
    assert_eq!(solver.t(), 1.0);
}

/// ẏ = −1 from y = 1 with y ≥ 0: the steps shrink at the wall at t = 1.
#[test]
fn a_constraint_holds_the_integration_up() {
    let mut problem = Decay::residual(|_, _| Ok(1.0));
    problem.jacobian = Box::new(|_| Ok(0.0));
    let constraints = vec![Constraint::NonNegative];
    let options = IdaOptions {
        constraints,
        ..IdaOptions::default()
    };
    let mut solver = IdaSolver::builder(problem)
        .options(options)
        .build(0.0, &[1.0], &[-1.0])
        .unwrap();
    let stop = stop(solver.integrate_to(2.0));
    // IDAS lets each step pass the wall by up to Newton's share of the tolerance: it creeps on.
    let creep = 500.0 * 0.33 * 1e-8;
    assert!(
        (stop.t - 1.0).abs() < creep && solver.y()[0] > -creep,
        "{stop}"
    );
    assert_eq!(stop.reason, StopReason::MaxSteps, "{stop}");
}

#[test]
fn too_tight_a_tolerance_is_named() {
    let tight = Tolerances::scalar(0.0, 1e-20);
    let mut solver = IdaSolver::builder(Decay::new())
        .tolerances(tight)
        .build(0.0, &[1.0], &[-1.0])
        .unwrap();
    let stop = stop(solver.integrate_to(1.0));
    assert_eq!(stop.reason, StopReason::ToleranceTooTight, "{stop}");
    assert!(stop.statistics.tolerance_scale_factor > 1.0, "{stop}");
}

/// Regression: a step cut to a sliver before the stop time magnifies Newton's errors of multipliers, and may
/// fail. It shares the time with the step before.
#[test]
fn no_sliver_is_left_before_a_stop_time() {
    let start = || {
        IdaSolver::builder(Decay::new())
            .build(0.0, &[1.0], &[-1.0])
            .unwrap()
    };
    let mut free = start();
    for _ in 0..40 {
        free.step(9.0).unwrap();
    }
    let (t, h) = (free.t(), free.current_step());
    for part in [1e-6, 1e-3, 0.05] {
        let stop_time = t + (1.0 + part) * h;
        let mut solver = start();
        for _ in 0..40 {
            solver.step(9.0).unwrap();
        }
        solver.set_stop_time(stop_time).unwrap();
        let outcome = solver.step(9.0).unwrap();
        let middle = outcome.t();
        assert!(matches!(outcome, Outcome::StepTaken { .. }), "{outcome:?}");
        // Half of the remaining time, to rounding of t.
        let expected = t + 0.5 * (1.0 + part) * h;
        assert!((middle - expected).abs() < 1e-9 * h, "{middle} {expected}");
        assert_eq!(
            solver.step(9.0).unwrap(),
            Outcome::StopTime { t: stop_time }
        );
        let last = solver.statistics().last_step;
        assert!(last > 0.4 * h, "{last}");
    }
}
