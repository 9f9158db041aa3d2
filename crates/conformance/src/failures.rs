//! Tests that failures are reported with their cause and do not cause unnecessary work.

use std::panic::{AssertUnwindSafe, catch_unwind};

use super::problems::Circle;
use super::{Method, Request, assert_stop, roots, stopped};
use myovib_dae::{Direction, Integrator, Outcome, StepError, StopReason};

fn recoverable(message: &str) -> StepError {
    StepError::Recoverable(message.to_owned())
}

/// Checks that after a recoverable error, the step is reduced and the integration continues.
pub fn recovers_from_recoverable_errors<M: Method>(method: &M) {
    for not_a_number in [false, true] {
        // The first residual after the start fails; later residuals succeed.
        let mut refused = false;
        let problem = Circle::with_residual(move |t| {
            if t == 0.0 || refused {
                return Ok(0.0);
            }
            refused = true;
            match not_a_number {
                true => Ok(f64::NAN),
                false => Err(recoverable("too far")),
            }
        });
        let mut solver = method.build(Request { initial_step: Some(1e-3), ..problem.request() });
        solver.step(1.0).unwrap();
        let statistics = solver.statistics();
        assert!(statistics.last_step < 1e-3, "{statistics:?}");
        assert_eq!((statistics.steps, statistics.step_solve_failures), (1, 1));
        let outcome = solver.integrate_to(1.0).unwrap();
        assert_eq!(outcome, Outcome::Reached { t: 1.0 });
        assert!((solver.y()[0] - 1f64.sin()).abs() < 1e-4);
    }
}

/// Checks that a persistent recoverable error or NaN ends the integration, and that the message contains the function
/// and the reason.
pub fn names_the_function_that_failed<M: Method>(method: &M) {
    // All calls after a certain number fail, regardless of the time, so no step is small enough.
    let spoiled = |trouble: fn() -> Result<f64, StepError>| {
        let mut calls = 0;
        Circle::with_residual(move |_| {
            calls += 1;
            if calls > 100 { trouble() } else { Ok(0.0) }
        })
    };
    let residual = spoiled(|| Err(recoverable("a wall")));
    let nan = spoiled(|| Ok(f64::NAN));
    let jacobian = |trouble: f64| {
        let mut problem = Circle::new();
        let mut calls = 0;
        problem.in_jacobian = Box::new(move |_| {
            calls += 1;
            match trouble.is_nan() {
                // The integrator may evaluate the residual once to determine the algebraic variables.
                _ if calls <= 1 => Ok(0.0),
                true => Ok(f64::NAN),
                false => Err(recoverable("a wall")),
            }
        });
        problem
    };
    for (problem, reason, printed) in [
        (residual, StopReason::ResidualFailed, "a wall"),
        (nan, StopReason::ResidualFailed, "residual[0] = NaN"),
        (jacobian(0.0), StopReason::JacobianFailed, "a wall"),
        (jacobian(f64::NAN), StopReason::JacobianFailed, "Jacobian[0] = NaN"),
    ] {
        let mut solver = method.build(problem.request());
        let stop = stopped(solver.integrate_to(10.0).unwrap());
        assert_stop(&stop, reason, printed);
        // The reported state is the last accepted state.
        assert_eq!(stop.t, solver.t());
        assert_eq!(stop.statistics, solver.statistics());
        // If the first Jacobian fails, no step is taken.
        let started = reason == StopReason::ResidualFailed;
        assert_eq!(stop.statistics.steps > 0, started, "{stop}");
        assert_eq!(stop.statistics.last_step > 0.0, started, "{stop}");
        assert!((solver.y()[0] - stop.t.sin()).abs() < 1e-4, "{stop}");
    }
}

/// Checks that the integration stops just before the time beyond which the residual fails, and reports the cause.
pub fn stops_before_a_wall<M: Method>(method: &M) {
    let problem = Circle::with_residual(|t| match t > 0.5 {
        true => Err(recoverable("a wall")),
        false => Ok(0.0),
    });
    let mut solver = method.build(problem.request());
    let stop = stopped(solver.integrate_to(1.0).unwrap());
    assert_stop(&stop, StopReason::StepTooSmall, "a wall");
    assert!(stop.t <= 0.5 && stop.t > 0.5 - 1e-9, "{stop}");
}

/// Checks that a fatal error ends the call, and that it is returned with the name of the function, the time and the
/// source of the error.
pub fn returns_fatal_errors<M: Method>(method: &M) {
    let fatal = || StepError::Fatal("disk on fire".into());
    let residual = Circle::with_residual(move |t| if t > 0.5 { Err(fatal()) } else { Ok(0.0) });
    let mut jacobian = Circle::new();
    let mut calls = 0;
    jacobian.in_jacobian = Box::new(move |_| {
        calls += 1;
        if calls > 1 { Err(fatal()) } else { Ok(0.0) }
    });
    for (problem, function) in [(residual, "residual"), (jacobian, "Jacobian")] {
        let mut solver = method.build(problem.request());
        let error = solver.integrate_to(1.0).unwrap_err().to_string();
        let printed = format!("the {function} failed at t = ");
        assert!(error.starts_with(&printed), "{error}");
        assert!(error.ends_with("disk on fire"), "{error}");
    }
}

/// Checks that the message of a failure at a jump suggests a remedy, and that this remedy works.
pub fn names_a_remedy_for_a_jump<M: Method>(method: &M) {
    let problem = Circle::with_residual(|t| Ok(if t >= 0.5 { -30.0 } else { 0.0 }));
    let mut solver = method.build(Request { min_step: 1e-5, ..problem.request() });
    let printed = stopped(solver.integrate_to(1.0).unwrap()).to_string();
    assert!(printed.contains("jumps") && printed.contains("reinit"), "{printed}");
    let (y, mut y_dot) = (solver.y().to_vec(), solver.y_dot().to_vec());
    // At the jump of ẋ, the derivative of a = x² + v² also jumps.
    y_dot[0] += 30.0;
    y_dot[2] += 2.0 * y[0] * 30.0;
    solver.reinit(0.5, &y, &y_dot, &[]).unwrap();
    let outcome = solver.integrate_to(1.0).unwrap();
    assert_eq!(outcome, Outcome::Reached { t: 1.0 });
}

/// Checks that the integration ends at the smallest allowed step if a jump fails the error test at every step size.
pub fn stops_at_the_smallest_step<M: Method>(method: &M) {
    // The error test detects a jump of this size in ẋ at any step size.
    let problem = Circle::with_residual(|t| Ok(if t > 0.5 { 1e9 } else { 0.0 }));
    let mut solver =
        method.build(Request { min_step: 1e-4, initial_step: Some(1e-3), ..problem.request() });
    let stop = stopped(solver.integrate_to(1.0).unwrap());
    assert_eq!(stop.reason, StopReason::StepTooSmall, "{stop}");
    assert!(stop.t <= 0.5 + 1e-4, "{stop}");
    assert!(stop.statistics.steps > 0);
}

/// Checks the case in which a weight becomes zero or a weight function fails: the integration ends after the last step
/// with valid weights, and the statistics are available.
pub fn keeps_statistics_if_a_weight_becomes_invalid<M: Method>(method: &M) {
    for fails in [false, true] {
        let mut solver = method.build(Request {
            weights: Some(Box::new(move |_, y: &[f64], weights: &mut [f64]| {
                weights.fill(1e6);
                match y[0] > 0.5 {
                    true if fails => Err(recoverable("no weights")),
                    true => {
                        weights[1] = 0.0;
                        Ok(())
                    }
                    false => Ok(()),
                }
            })),
            max_step: Some(0.05),
            ..Circle::new().request()
        });
        let stop = stopped(solver.integrate_to(1.0).unwrap());
        let printed = match fails {
            true => "no weights",
            false => "error weight[1] = 0 must be positive",
        };
        assert_stop(&stop, StopReason::ErrorWeightsFailed, printed);
        assert!(stop.statistics.steps > 5, "{stop}");
        assert_eq!(stop.statistics, solver.statistics());
        assert!((solver.y()[0] - solver.t().sin()).abs() < 1e-4, "{stop}");
    }
}

/// Checks that t, y and ẏ remain consistent with each other if a root function fails.
pub fn keeps_a_consistent_state_if_a_root_function_fails<M: Method>(method: &M) {
    for at in [0.0, 0.5] {
        for fatal in [false, true] {
            let mut solver = method.build(Request {
                roots: roots(&[Direction::Both], move |t, _, g| {
                    g[0] = 1.0;
                    match t >= at {
                        true if fatal => Err(StepError::Fatal("disk on fire".into())),
                        true => Err(recoverable("no root")),
                        false => Ok(()),
                    }
                }),
                ..Circle::new().request()
            });
            match solver.integrate_to(1.0) {
                Ok(outcome) => {
                    let stop = stopped(outcome);
                    assert_stop(&stop, StopReason::RootFunctionFailed, "no root");
                    assert_eq!(stop.t, solver.t());
                    assert!(!fatal);
                }
                Err(error) => {
                    assert!(error.to_string().ends_with("disk on fire"), "{error}");
                    assert!(fatal);
                }
            }
            let (t, exact) = (solver.t(), Circle::exact(solver.t()));
            for (y, exact) in solver.y().iter().zip(exact) {
                assert!((y - exact).abs() < 1e-4, "t = {t}: {:?}", solver.y());
            }
            assert!((solver.y_dot()[0] - exact[1]).abs() < 1e-2, "t = {t}");
        }
    }
}

/// Checks that a panic in the problem propagates, and that the integrator can be reinitialized afterward.
pub fn propagates_panics<M: Method>(method: &M) {
    let mut armed = true;
    let problem = Circle::with_residual(move |t| {
        if armed && t > 0.5 {
            armed = false;
            panic!("out of paper");
        }
        Ok(0.0)
    });
    let mut solver = method.build(problem.request());
    let panic = catch_unwind(AssertUnwindSafe(|| solver.integrate_to(1.0))).unwrap_err();
    assert_eq!(panic.downcast_ref::<&str>(), Some(&"out of paper"));
    let (y, y_dot) = Circle::start();
    solver.reinit(0.0, &y, &y_dot, &[]).unwrap();
    assert_eq!(solver.integrate_to(1.0).unwrap(), Outcome::Reached { t: 1.0 });
}

/// Checks that, after the first steps, a step accepted at the first attempt does not allocate memory. `allocations`
/// counts the allocations during a call.
pub fn steps_allocate_nothing<M: Method>(
    method: &M,
    allocations: impl Fn(&mut dyn FnMut()) -> u64,
) {
    for problem in [Circle::new(), Circle::without_jacobian()] {
        let mut solver = method.build(problem.request());
        // The first steps allocate workspace.
        for _ in 0..20 {
            solver.step(1e3).unwrap();
        }
        let mut counted_steps = 0;
        for _ in 0..50 {
            let failures = |solver: &M::Integrator| {
                let statistics = solver.statistics();
                statistics.error_test_failures + statistics.newton_failures
            };
            let before = failures(&solver);
            let counted = allocations(&mut || {
                let outcome = solver.step(1e3).unwrap();
                assert!(matches!(outcome, Outcome::StepTaken { .. }));
            });
            // A rejected step allocates its message.
            if failures(&solver) == before {
                assert_eq!(counted, 0);
                counted_steps += 1;
            }
        }
        assert!(counted_steps > 25, "{counted_steps}");
    }
}
