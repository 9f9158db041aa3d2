//! Runs with difference quotients, compared with runs with exact Jacobians.

use myovib_conformance::samples::{
    Akzo, Heat2d, LinearIndex1, MechanicalForm, Pendulum, Robertson, Sample, VanDerPol,
};
use myovib_dae::{Outcome, Tolerances};
use myovib_radau::RadauOptions;
use sundials_wrap::{IdaOptions, IdaSolver};

use crate::common::{WithoutJacobian, mescd, run};

/// Returns the number of steps and the solution of a run with BDF (0 stages) or Radau IIA.
fn outcome<S: Sample + 'static>(
    sample: S,
    t_end: f64,
    tolerances: &Tolerances,
    stages: Option<usize>,
) -> (u64, Vec<f64>) {
    let tolerances = tolerances.clone();
    if let Some(stages) = stages {
        let options =
            RadauOptions { stages, tolerances, max_steps: Some(10_000), ..RadauOptions::default() };
        let solver = run(sample, t_end, options);
        return (solver.statistics().steps, solver.y().to_vec());
    }
    let options = IdaOptions { tolerances, max_steps: Some(10_000), ..IdaOptions::default() };
    let start = sample.start();
    let mut solver =
        IdaSolver::builder(sample).options(options).build(start.t, &start.y, &start.y_dot).unwrap();
    let outcome = solver.integrate_to(t_end).unwrap();
    assert_eq!(outcome, Outcome::Reached { t: t_end });
    (solver.statistics().steps, solver.y().to_vec())
}

/// Compares runs with exact Jacobians and runs with difference quotients, for absolute tolerances larger and smaller
/// than the variables.
///
/// After any change, the error of a single run may differ by a factor of several, and the number of steps by a third.
fn compare<S: Sample + Copy + 'static>(name: &str, sample: S, t_end: f64) {
    let tight = Tolerances::scalar(1e-10, 1e-12);
    let (_, reference) = outcome(sample, t_end, &tight, Some(7));
    for (relative, absolute) in [(1e-4, 1e-4), (1e-4, 1e-8), (1e-6, 1e-6), (1e-6, 1e-10)] {
        let tolerances = Tolerances::scalar(relative, absolute);
        for stages in [None, Some(3), Some(7)] {
            let (exact, y) = outcome(sample, t_end, &tolerances, stages);
            let (steps, found) = outcome(WithoutJacobian(sample), t_end, &tolerances, stages);
            let [digits, expected] = [&found, &y].map(|y| mescd(y, &reference));
            let case = format!(
                "{name}, {stages:?} stages, {relative:e}, {absolute:e}: {steps} steps, \
                 {digits:.2} digits; {exact}, {expected:.2} with the exact Jacobian"
            );
            println!("{case}");
            assert!(2 * steps <= 3 * exact, "{case}");
            assert!(digits > expected.min(-relative.log10()) - 1.0, "{case}");
        }
    }
}

/// Regression test: the second species decreases from 4e-5 to 1e-13, far below its tolerance. With displacements equal
/// to the tolerance, a run took 59 907 steps instead of 109 at tolerances of 1e-4 and 1e-8.
#[test]
fn variables_below_their_tolerance_have_correct_jacobians() {
    compare("Robertson", Robertson, 4e10);
}

#[test]
fn difference_quotients_cost_no_steps_and_digits() {
    // F contains √y2, and y2 is not larger than the largest tolerance.
    compare("Akzo", Akzo, 180.0);
    compare("heat", Heat2d::new(6), 1.0);
    compare("linear", LinearIndex1, 3.0);
    compare("van der Pol", VanDerPol { vdp_mu: 100.0 }, 100.0);
    compare("pendulum", Pendulum::new(MechanicalForm::Index1), 1.0);
}
