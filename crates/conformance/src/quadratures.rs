//! Tests of quadratures.

use super::problems::Circle;
use super::{AnyProblem, Method, Request, assert_stop, stopped};
use myovib_dae::{Integrator, Outcome, StepError, StopReason};

const START: [f64; 3] = [1.0, 0.0, 0.0];

/// Returns ∫ x, ∫ ẋ² and ∫ a t for the solution of [`Circle`].
fn exact(t: f64) -> [f64; 3] {
    [2.0 - t.cos(), 0.5 * t + 0.25 * (2.0 * t).sin(), 0.5 * t * t]
}

fn request() -> Request {
    let integrand = |_: &mut AnyProblem, t: f64, y: &[f64], v: &[f64], g: &mut [f64]| {
        g.copy_from_slice(&[y[0], v[0] * v[0], y[2] * t]);
        Ok(())
    };
    Request { quadrature: Some((START.to_vec(), Box::new(integrand))), ..Circle::new().request() }
}

/// Checks quadratures of the solution, its derivative, algebraic variables and the time. Their values and derivatives
/// are correct at the end of steps and within steps, with given initial values, and after a reinitialization.
/// Quadratures do not change the steps.
pub fn integrates_quadratures_with_the_solution<M: Method>(method: &M) {
    let mut solver = method.build(request());
    assert_eq!(solver.n_quadratures(), START.len());
    let mut q = [0.0; 3];
    let (y, y_dot) = Circle::start();
    let mut alone = method.build(Circle::new().request());
    for _ in 0..20 {
        solver.step(1e3).unwrap();
        alone.step(1e3).unwrap();
        assert_eq!(solver.y(), alone.y());
        let [from, to] = solver.last_step_interval();
        for theta in [0.0, 0.3, 0.9, 1.0] {
            let t = from + theta * (to - from);
            solver.quadrature_dense_output(t, 0, &mut q).unwrap();
            for (q, exact) in q.iter().zip(exact(t)) {
                // The bound is a multiple of the tolerance per step, 1e-6, as for the solution.
                assert!((q - exact).abs() < 1e-4 * (1.0 + t), "t = {t}: {q} {exact}");
            }
            solver.quadrature_dense_output(t, 1, &mut q).unwrap();
            assert!((q[0] - t.sin()).abs() < 1e-2, "t = {t}: {q:?}");
        }
        let beyond = to + 0.01 * (to - from);
        assert!(solver.quadrature_dense_output(beyond, 0, &mut q).is_err());
        assert!(solver.quadrature_dense_output(to, 0, &mut q[..2]).is_err());
    }
    let statistics = solver.statistics();
    assert!(statistics.quadrature_evaluations >= statistics.steps);
    assert!(solver.reinit(0.0, &y, &y_dot, &[]).is_err());
    assert!(solver.reinit(0.0, &y, &y_dot, &[f64::NAN; 3]).is_err());
    let moved = START.map(|q| q + 10.0);
    solver.reinit(0.0, &y, &y_dot, &moved).unwrap();
    assert_eq!(solver.integrate_to(2.0).unwrap(), Outcome::Reached { t: 2.0 });
    solver.quadrature_dense_output(2.0, 0, &mut q).unwrap();
    for (q, exact) in q.iter().zip(exact(2.0)) {
        // The error is 1e-6 per step in a few dozen steps.
        assert!((q - 10.0 - exact).abs() < 1e-4, "{q} {exact}");
    }
}

/// Checks that the integration stops and reports the reason if the integrand fails in every call after a certain
/// number, and that a fatal error of the integrand is returned.
pub fn stops_if_a_quadrature_fails<M: Method>(method: &M) {
    let spoiled = |error: fn() -> StepError| {
        let mut calls = 0;
        let integrand = move |_: &mut AnyProblem, _: f64, _: &[f64], _: &[f64], g: &mut [f64]| {
            calls += 1;
            g[0] = 1.0;
            if calls > 30 { Err(error()) } else { Ok(()) }
        };
        Request { quadrature: Some((vec![0.0], Box::new(integrand))), ..Circle::new().request() }
    };
    let no_table = || StepError::Recoverable("beyond the table".to_owned());
    let mut solver = method.build(spoiled(no_table));
    let stop = stopped(solver.integrate_to(10.0).unwrap());
    assert_stop(&stop, StopReason::QuadratureFailed, "beyond the table");
    assert_eq!(stop.t, solver.t());
    assert!((solver.y()[0] - stop.t.sin()).abs() < 1e-4, "{stop}");
    let fatal = || StepError::Fatal("the table is gone".into());
    let mut solver = method.build(spoiled(fatal));
    let printed = solver.integrate_to(10.0).unwrap_err().to_string();
    assert!(printed.contains("quadrature"), "{printed}");
    assert!(printed.contains("the table is gone"), "{printed}");
}
