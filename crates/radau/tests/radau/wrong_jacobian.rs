//! Stops caused by a wrong Jacobian.

use myovib_conformance::samples::{Altered, MechanicalForm, Pendulum, Sample};
use myovib_dae::{Outcome, Stop, Tolerances};
use myovib_radau::RadauOptions;

use crate::common::radau;

/// Integrates a pendulum of index 3 whose entry ∂F₂/∂λ is multiplied by this factor.
fn stop(factor: f64, check_jacobian_at_stop: bool) -> Option<Box<Stop>> {
    let sample = Pendulum::new(MechanicalForm::Index3);
    // The matrix is full and has 5 rows: row 2, column 4.
    let (start, problem) = (sample.start(), Altered { sample, place: 4 * 5 + 2, factor });
    let options = RadauOptions {
        tolerances: Tolerances::scalar(1e-8, 1e-10),
        check_jacobian_at_stop,
        ..RadauOptions::default()
    };
    let builder = radau(problem).options(options);
    let mut solver = builder.build(start.t, &start.y, &start.y_dot).unwrap();
    match solver.integrate_to(2.0).unwrap() {
        Outcome::Stopped(stop) => Some(stop),
        _ => None,
    }
}

/// Regression test: an integration with a wrong Jacobian stopped, and the message did not report the wrong entry.
#[test]
fn a_wrong_entry_is_named_and_correct_entries_are_not() {
    let stopped = stop(-1.0, true).expect("Newton's method fails");
    let wrong = stopped.wrong_entry.expect("the entry is negated");
    assert_eq!((wrong.row, wrong.column, wrong.is_rate_matrix), (2, 4, false));
    assert_eq!(stop(-1.0, false).unwrap().wrong_entry, None);
    assert!(stop(1.0, true).is_none());
}
