//! Changes of settings between steps, and selection of the next step size.

use myovib_conformance::AnyProblem;
use myovib_conformance::samples::{MechanicalForm, Pendulum, Sample};
use myovib_dae::{Outcome, Tolerances};
use myovib_radau::{RadauOptions, RadauSolver};

use crate::common::{Oscillator, radau, solver, tolerance};

/// Checks that Newton's tolerance is the same for user-defined weights and for equivalent tolerances. If it were
/// computed from the default tolerance, 1e-4, the error would be about a hundred times as large.
#[test]
fn weights_of_a_tolerance_solve_like_the_tolerance() {
    let tol = 1e-8;
    let t_end = 20.0;
    let exact = Oscillator.exact(t_end).unwrap();
    let plain = tolerance(tol);
    let factor = plain.internal_factor(tol);
    let error = |solver: &RadauSolver<AnyProblem>| (solver.y()[0] - exact[0]).abs();
    let mut by_tolerance =
        radau(Oscillator).options(plain).build(0.0, &[0.0, 1.0], &[1.0, 0.0]).unwrap();
    by_tolerance.integrate_to(t_end).unwrap();
    let mut by_weights = radau(Oscillator)
        .options(RadauOptions {
            // The weights imply a relative tolerance of about `tol`, because sin t or cos t is always large.
            tolerances: Tolerances::scalar(1e-4, 1e-4),
            ..RadauOptions::default()
        })
        .error_weights(move |_, y, w| {
            for (w, y) in w.iter_mut().zip(y) {
                *w = 1.0 / (factor * tol * (y.abs() + 1.0));
            }
            Ok(())
        })
        .build(0.0, &[0.0, 1.0], &[1.0, 0.0])
        .unwrap();
    by_weights.integrate_to(t_end).unwrap();
    let (a, b) = (error(&by_tolerance), error(&by_weights));
    assert!(b < 3.0 * a && a < 3.0 * b, "{a:e} {b:e}");
    let steps = [&by_tolerance, &by_weights].map(|solver| solver.statistics().steps as f64);
    assert!((steps[0] / steps[1] - 1.0).abs() < 0.2, "{steps:?}");
}

/// Checks that a restart takes a small first step from the current state and does not reduce the accuracy.
#[test]
fn a_restart_goes_on_from_where_it_is() {
    let sample = Pendulum::new(MechanicalForm::Index2);
    let mut solver = solver(sample, tolerance(1e-6));
    solver.integrate_to(1.0).unwrap();
    let before = solver.statistics();
    solver.restart();
    assert_eq!(solver.t(), 1.0);
    assert!(matches!(solver.step(2.0).unwrap(), Outcome::StepTaken { .. }));
    let after = solver.statistics();
    assert_eq!(after.steps, before.steps + 1);
    assert!(after.last_step < 0.5 * before.last_step, "{after:?}");
    solver.integrate_to(2.0).unwrap();
    let exact = sample.exact(2.0).unwrap();
    for (y, exact) in solver.y()[..4].iter().zip(&exact) {
        // The error may be a hundred times the tolerance.
        assert!((y - exact).abs() < 1e-4 * (1.0 + exact.abs()), "{y} {exact}");
    }
}
