//! Tests of output times, limits, restarts and counters, which must have the same meaning for all integrators.

use std::rc::Rc;

use super::problems::Circle;
use super::{Method, Request, stopped};
use myovib_dae::{ConsistencyMode, Integrator, Outcome, StopReason};

/// Checks that steps advance the time, that output times are reached exactly, and that t, y and ẏ are consistent.
pub fn reaches_output_times_exactly_with_consistent_values<M: Method>(method: &M) {
    let mut solver = method.build(Circle::new().request());
    assert_eq!((solver.t(), solver.last_step_interval()), (0.0, [0.0, 0.0]));
    let mut t = 0.0;
    for _ in 0..5 {
        let Outcome::StepTaken { t: reached } = solver.step(1.0).unwrap() else {
            panic!("no step");
        };
        assert!(reached > t);
        assert_eq!(solver.last_step_interval()[1], reached);
        assert!((solver.last_step_interval()[0] - t).abs() <= 1e-12 * reached);
        assert_eq!(solver.t(), reached);
        t = reached;
    }
    // `step` may end beyond t_out, but `integrate_to` does not.
    let outcome = solver.integrate_to(2.0).unwrap();
    assert_eq!((outcome, solver.t()), (Outcome::Reached { t: 2.0 }, 2.0));
    let exact = Circle::exact(2.0);
    assert!((solver.y()[0] - exact[0]).abs() < 1e-4);
    assert!((solver.y_dot()[0] - exact[1]).abs() < 1e-4);
    assert!(solver.statistics().t_reached >= 2.0);
}

/// Checks that non-finite times and times before the current time are rejected as misuse.
pub fn rejects_past_times_and_non_finite_values<M: Method>(method: &M) {
    let mut solver = method.build(Circle::new().request());
    solver.integrate_to(1.0).unwrap();
    for t in [0.5, f64::NAN, f64::INFINITY] {
        let printed = if t == 0.5 { "t = 1" } else { "finite" };
        for error in [
            solver.step(t).unwrap_err(),
            solver.integrate_to(t).unwrap_err(),
            solver.set_stop_time(t).unwrap_err(),
        ] {
            assert!(error.to_string().contains(printed), "{t}: {error}");
        }
    }
    let (y, y_dot) = Circle::start();
    assert!(solver.reinit(f64::NAN, &y, &y_dot, &[]).is_err());
    assert!(solver.reinit(0.0, &y[..2], &y_dot, &[]).is_err());
    assert!(solver.reinit(0.0, &[0.0, f64::NAN, 0.0], &y_dot, &[]).is_err());
    assert!(solver.reinit(0.0, &y, &y_dot, &[1.0]).is_err());
    // The rejected calls did not change the state.
    assert_eq!(solver.t(), 1.0);
    assert_eq!(solver.integrate_to(2.0).unwrap(), Outcome::Reached { t: 2.0 });
}

/// Checks calls in which the output time is the current time. `integrate_to` takes no step. A first step and the
/// correction of initial values reject this output time, because they require a direction and a time scale.
pub fn handles_an_output_time_equal_to_the_current_time<M: Method>(method: &M) {
    let mut solver = method.build(Circle::new().request());
    let reached = |t| Outcome::Reached { t };
    assert_eq!(solver.integrate_to(0.0).unwrap(), reached(0.0));
    assert!(solver.step(0.0).is_err());
    let mode = ConsistencyMode::AlgebraicAndDerivatives;
    assert!(solver.correct_initial_values(mode, 0.0).is_err());
    assert_eq!((solver.t(), solver.statistics().steps), (0.0, 0));
    assert_eq!(solver.integrate_to(1.0).unwrap(), reached(1.0));
    let steps = solver.statistics().steps;
    assert_eq!(solver.integrate_to(1.0).unwrap(), reached(1.0));
    assert_eq!(solver.statistics().steps, steps);
}

/// Checks that a stop time is reached exactly and is then cleared.
pub fn applies_a_stop_time_once<M: Method>(method: &M) {
    let mut solver = method.build(Request { stop_time: Some(0.7), ..Circle::new().request() });
    let mut outcome = solver.step(2.0).unwrap();
    while let Outcome::StepTaken { t } = outcome {
        assert!(t < 0.7);
        outcome = solver.step(2.0).unwrap();
    }
    assert_eq!(outcome, Outcome::StopTime { t: 0.7 });
    assert!(matches!(
        solver.step(2.0).unwrap(),
        Outcome::StepTaken { t } if t > 0.7
    ));
    let ahead = solver.t() + 0.5;
    solver.set_stop_time(ahead).unwrap();
    let stop = Outcome::StopTime { t: ahead };
    assert_eq!(solver.integrate_to(9.0).unwrap(), stop);
    assert_eq!(solver.integrate_to(9.0).unwrap(), Outcome::Reached { t: 9.0 });
    // If the stop time is equal to the output time, the stop time is reported.
    solver.set_stop_time(10.0).unwrap();
    assert_eq!(solver.integrate_to(10.0).unwrap(), Outcome::StopTime { t: 10.0 });
    // After a restart, a stop time that is not ahead is discarded. Other stop times are kept.
    let (y, y_dot) = Circle::start();
    for (stop, expected) in
        [(11.0, Outcome::Reached { t: 13.0 }), (12.5, Outcome::StopTime { t: 12.5 })]
    {
        solver.reinit(10.0, &y, &y_dot, &[]).unwrap();
        solver.set_stop_time(stop).unwrap();
        solver.reinit(12.0, &y, &y_dot, &[]).unwrap();
        assert_eq!(solver.integrate_to(13.0).unwrap(), expected);
    }
}

/// Checks that the limit on the number of steps applies to each call of `integrate_to` separately, and that it does not
/// apply to `step`.
pub fn limits_the_steps_of_each_call<M: Method>(method: &M) {
    let limited =
        || Request { max_steps: Some(3), max_step: Some(0.01), ..Circle::new().request() };
    let mut solver = method.build(limited());
    for calls in 1..4 {
        let stop = stopped(solver.integrate_to(1.0).unwrap());
        assert_eq!(stop.reason, StopReason::MaxSteps, "{stop}");
        assert_eq!(stop.statistics.steps, 3 * calls);
        assert_eq!(stop.t, solver.t());
    }
    let mut solver = method.build(limited());
    for _ in 0..10 {
        assert!(matches!(solver.step(1.0).unwrap(), Outcome::StepTaken { .. }));
    }
}

/// Checks that an integrator after a restart behaves like a new integrator, including its statistics and root
/// functions.
pub fn a_restart_equals_a_new_integrator<M: Method>(method: &M) {
    let (y, y_dot) = Circle::start();
    let mut fresh = method.build(Circle::new().request());
    fresh.integrate_to(3.0).unwrap();
    let mut used = method.build(Circle::new().request());
    used.integrate_to(1.7).unwrap();
    used.reinit(0.0, &y, &y_dot, &[]).unwrap();
    assert_eq!((used.t(), used.y(), used.y_dot()), (0.0, &y[..], &y_dot[..]));
    assert_eq!(used.statistics().steps, 0);
    assert_eq!(used.statistics().smallest_rcond, None);
    used.integrate_to(3.0).unwrap();
    // The pivot order of the first run may be reused, which changes the rounding errors.
    for (a, b) in used.y().iter().zip(fresh.y()) {
        assert!((a - b).abs() < 1e-12, "{a} and {b}");
    }
    let (a, b) = (used.statistics(), fresh.statistics());
    assert_eq!(
        (a.steps, a.residual_evaluations, a.jacobian_evaluations),
        (b.steps, b.residual_evaluations, b.jacobian_evaluations)
    );
}

/// Checks that the counters are equal to the numbers of calls that the problem receives, and that the reported numbers
/// and sizes of steps are correct.
pub fn counts_steps_and_evaluations<M: Method>(method: &M) {
    for problem in [Circle::new(), Circle::without_jacobian()] {
        let (has_jacobian, calls) = (problem.has_jacobian, Rc::clone(&problem.calls));
        let mut solver = method.build(problem.request());
        let (residuals, jacobians) = (calls.residuals.get(), calls.jacobians.get());
        let mut steps = 0;
        let mut first = 0.0;
        while solver.t() < 3.0 {
            let before = solver.t();
            let outcome = solver.step(3.0).unwrap();
            assert!(matches!(outcome, Outcome::StepTaken { .. }), "{outcome:?}");
            steps += 1;
            let statistics = solver.statistics();
            let [from, to] = solver.last_step_interval();
            // The size of a step is equal to the difference between its end times, up to rounding.
            assert!((statistics.last_step - (to - from)).abs() <= 1e-12 * to);
            if steps == 1 {
                first = solver.t() - before;
            }
            assert_eq!(statistics.steps, steps);
            assert!((1..=13).contains(&statistics.last_order));
            assert!(statistics.current_step > 0.0);
        }
        let statistics = solver.statistics();
        assert!((statistics.initial_step - first).abs() <= 1e-12 * first);
        assert_eq!(
            statistics.residual_evaluations + statistics.difference_evaluations,
            calls.residuals.get() - residuals
        );
        if has_jacobian {
            assert_eq!(statistics.jacobian_evaluations, calls.jacobians.get() - jacobians);
        }
        assert!(statistics.linear_setups >= statistics.jacobian_evaluations);
        assert!(statistics.newton_iterations >= statistics.steps);
    }
}
