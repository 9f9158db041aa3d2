//! Equations with exponential functions of algebraic variables, which successful runs must satisfy.

use myovib_dae::{Outcome, Problem, StepError, Tolerances};
use myovib_radau::RadauOptions;

use crate::common::radau;

/// ẏ0 = 8 cos t · y0, exp(y1) = y0, with y1 = 8 sin t.
struct Logarithm;

const RATE: f64 = 8.0;

impl Problem for Logarithm {
    fn n_unknowns(&self) -> usize {
        2
    }

    fn residual(&mut self, t: f64, y: &[f64], v: &[f64], r: &mut [f64]) -> Result<(), StepError> {
        r.copy_from_slice(&[v[0] - RATE * t.cos() * y[0], y[1].exp() - y[0]]);
        Ok(())
    }
}

/// Regression test: the first correction of a step led to values of y1 at which F is almost independent of y1. As the
/// second correction was much smaller, Newton's method seemed to converge, and the step was accepted.
#[test]
fn accepted_steps_satisfy_an_exponential_equation() {
    for (stages, relative) in [(5, 1e-2), (7, 1e-2), (7, 1e-3), (7, 1e-4)] {
        for end in (3..60).map(|k| 0.1 * f64::from(k)) {
            let tolerances = Tolerances::scalar(relative, 1e-6);
            let options = RadauOptions { tolerances, stages, ..RadauOptions::default() };
            let mut solver =
                radau(Logarithm).options(options).build(0.0, &[1.0, 0.0], &[RATE, RATE]).unwrap();
            let outcome = solver.integrate_to(end).unwrap();
            assert!(
                matches!(outcome, Outcome::Reached { .. }),
                "{stages} {relative} {end}: {outcome:?}"
            );
            let y = solver.y();
            // The last correction of Newton's method is at most a hundredth of the solution, and y1 is at most 8.
            assert!((y[1] - y[0].ln()).abs() < 0.01 * RATE, "{stages} {relative} {end}: {y:?}");
            let error = (y[1] - RATE * end.sin()).abs();
            // The bound is 100 tolerances, as stated in the guide.
            assert!(error < 100.0 * relative * RATE, "{stages} {relative} {end}: {error}");
        }
    }
}
