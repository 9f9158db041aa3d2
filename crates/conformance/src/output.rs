//! Tests of dense output and events.

use std::f64::consts::PI;

use super::problems::Circle;
use super::{Method, Request, roots};
use myovib_dae::{Direction, Integrator, Outcome};

/// Checks that dense output covers exactly the last step, including both of its ends.
pub fn limits_dense_output_to_the_last_step<M: Method>(method: &M) {
    let (y, y_dot) = Circle::start();
    let mut solver = method.build(Circle::new().request());
    let mut out = [0.0; 3];
    // Before the first step, the initial values are available.
    for (derivative, expected) in [(0, y), (1, y_dot)] {
        solver.dense_output(0.0, derivative, &mut out).unwrap();
        assert_eq!(out, expected);
    }
    for t in [-1e-3, 1e-3, f64::NAN] {
        assert!(solver.dense_output(t, 0, &mut out).is_err(), "{t}");
    }
    for _ in 0..20 {
        solver.step(1e3).unwrap();
        let [from, to] = solver.last_step_interval();
        let h = to - from;
        for theta in [0.0, 0.3, 0.5, 0.9, 1.0] {
            let t = from + theta * h;
            solver.dense_output(t, 0, &mut out).unwrap();
            let exact = Circle::exact(t);
            // The bound is a multiple of the tolerance per step, 1e-6.
            assert!((out[0] - exact[0]).abs() < 1e-4, "t = {t}: {out:?}");
            solver.dense_output(t, 1, &mut out).unwrap();
            assert!((out[0] - exact[1]).abs() < 1e-2, "t = {t}: {out:?}");
        }
        solver.dense_output(to, 0, &mut out).unwrap();
        for (interpolated, y) in out.iter().zip(solver.y()) {
            assert!((interpolated - y).abs() < 1e-14);
        }
        for t in [from - 0.01 * h, to + 0.01 * h, -1.0, 100.0] {
            for derivative in [0, 1] {
                let error = solver.dense_output(t, derivative, &mut out).unwrap_err();
                let printed = format!("no derivative of order {derivative} at t = {t}");
                assert!(error.to_string().starts_with(&printed), "{error}");
            }
        }
        let order = solver.statistics().last_order;
        assert!(solver.dense_output(to, order + 1, &mut out).is_err());
        assert!(solver.dense_output(to, 0, &mut out[..2]).is_err());
    }
    assert_eq!(solver.n_quadratures(), 0);
    let error = solver.quadrature_dense_output(0.0, 0, &mut []).unwrap_err();
    assert_eq!(error.to_string(), "this solver has no quadratures");
}

/// Checks that events of x = sin t are found at multiples of π, in the right order and with the right directions. After
/// each event, the integration continues, and it takes the same steps as without events.
pub fn finds_events_in_order<M: Method>(method: &M) {
    let watched = |directions: &[Direction]| Request {
        roots: roots(directions, |_, y, g| {
            g.fill(y[0]);
            Ok(())
        }),
        ..Circle::new().request()
    };
    let all = [Direction::Falling, Direction::Rising, Direction::Both];
    let mut solver = method.build(watched(&all));
    for k in 1..4 {
        let outcome = solver.integrate_to(10.0).unwrap();
        let Outcome::Root { t, crossings } = outcome else {
            panic!("no root: {outcome:?}");
        };
        let expected = if k % 2 == 1 { [-1, 0, -1] } else { [0, 1, 1] };
        assert_eq!(crossings, expected);
        // The error of the solution is 1e-6 times the number of steps.
        assert!((t - f64::from(k) * PI).abs() < 1e-3, "{t}");
        assert_eq!(solver.t(), t);
        assert!(solver.y()[0].abs() < 1e-9, "{:?}", solver.y());
        assert!(myovib_dae::covers(solver.last_step_interval(), t));
    }
    let outcome = solver.integrate_to(10.0).unwrap();
    assert_eq!(outcome, Outcome::Reached { t: 10.0 });
    let mut unwatched = method.build(Circle::new().request());
    unwatched.step(10.0).unwrap();
    let mut again = method.build(watched(&[Direction::Both]));
    again.step(10.0).unwrap();
    assert_eq!(again.y(), unwatched.y());
}

/// Checks functions that stay at zero for some time: an event is reported when a function reaches zero, but not when it
/// leaves zero. The functions are clipped at zero from above or from below, or are zero from t = 2 to t = 3.
pub fn finds_events_where_a_root_function_becomes_zero<M: Method>(method: &M) {
    let between = |t: f64| (t - 2.0).min(0.0) + (t - 3.0).max(0.0);
    type Function = fn(f64) -> f64;
    let functions: [(Function, f64, i32); 4] = [
        (|t| (t - 1.0).min(0.0), 1.0, 1),
        (|t| (1.5 - t).max(0.0), 1.5, -1),
        (between, 2.0, 1),
        (|t| -((t - 2.0).min(0.0) - (t - 3.0).max(0.0)).abs(), 2.0, 1),
    ];
    for (function, expected, crossing) in functions {
        let mut solver = method.build(Request {
            roots: roots(&[Direction::Both], move |t, _, g| {
                g[0] = function(t);
                Ok(())
            }),
            ..Circle::new().request()
        });
        let outcome = solver.integrate_to(5.0).unwrap();
        let Outcome::Root { t, crossings } = outcome else {
            panic!("no root: {outcome:?}");
        };
        assert_eq!(crossings, [crossing]);
        // Roots are located within a hundred times the rounding errors of t and of the step.
        assert!((t - expected).abs() < 1e-12, "{t} {expected}");
        let outcome = solver.integrate_to(5.0).unwrap();
        assert_eq!(outcome, Outcome::Reached { t: 5.0 });
    }
}

/// Checks that the state may be changed at an event. With a reflection at x = 0, the solution is x = |sin t|. It
/// returns to zero after half a period, and the state after the restart is not reported as an event.
pub fn restarts_after_an_event<M: Method>(method: &M) {
    let mut solver = method.build(Request {
        roots: roots(&[Direction::Falling], |_, y, g| {
            g[0] = y[0];
            Ok(())
        }),
        ..Circle::new().request()
    });
    for k in 1..4 {
        let outcome = solver.integrate_to(20.0).unwrap();
        assert!(matches!(outcome, Outcome::Root { .. }), "{outcome:?}");
        // As in the previous tests, the error is the error per step times the number of steps.
        assert!((solver.t() - f64::from(k) * PI).abs() < 1e-3, "{outcome:?}");
        let back = [0.0, -solver.y()[1], solver.y()[2]];
        let rates = [back[1], 0.0, 0.0];
        solver.reinit(solver.t(), &back, &rates, &[]).unwrap();
        assert_eq!(solver.y(), back);
        assert_eq!(solver.statistics().steps, 0);
    }
    let t = 3.5 * PI;
    assert_eq!(solver.integrate_to(t).unwrap(), Outcome::Reached { t });
    assert!((solver.y()[0] - 1.0).abs() < 1e-3, "{:?}", solver.y());
}

/// Checks that a request for quadratures that were not set up is rejected with a clear message.
pub fn reports_missing_quadratures<M: Method>(method: &M) {
    let (y, y_dot) = Circle::start();
    let mut solver = method.build(Circle::new().request());
    solver.step(1.0).unwrap();
    assert_eq!(solver.n_quadratures(), 0);
    let t = solver.t();
    let requested = solver.quadrature_dense_output(t, 0, &mut []).unwrap_err();
    let started = solver.reinit(0.0, &y, &y_dot, &[1.0]).unwrap_err();
    for printed in [requested.to_string(), started.to_string()] {
        assert!(printed.contains("quadratures"), "{printed}");
    }
    // Neither of the failed calls has changed anything.
    assert_eq!(solver.t(), t);
    solver.reinit(0.0, &y, &y_dot, &[]).unwrap();
    let outcome = solver.integrate_to(1.0).unwrap();
    assert_eq!(outcome, Outcome::Reached { t: 1.0 });
}
