//! Checks that the remedies in the message of a stop work.

use myovib_dae::samples::{MechanicalForm, Pendulum, Sample};
use myovib_dae::{Outcome, Problem, StepError, Tolerances};
use myovib_radau::{RadauOptions, RadauSolver};

use crate::common::stopped;

/// A problem that does not state its indices.
struct Silent<P>(P);

impl<P: Problem> Problem for Silent<P> {
    fn n_unknowns(&self) -> usize {
        self.0.n_unknowns()
    }

    fn residual(&mut self, t: f64, y: &[f64], v: &[f64], r: &mut [f64]) -> Result<(), StepError> {
        self.0.residual(t, y, v, r)
    }
}

/// The pendulum of index 3 fails if all its variables have equal weights, and succeeds with the
/// remedy.
#[test]
fn indices_that_are_not_stated_are_asked_for() {
    let pendulum = Pendulum::new(MechanicalForm::Index3);
    let start = pendulum.start();
    let options = || RadauOptions {
        tolerances: Tolerances::scalar(1e-8, 1e-8),
        ..RadauOptions::default()
    };
    let builder = RadauSolver::builder(Silent(pendulum)).options(options());
    let mut silent = builder.build(start.t, &start.y, &start.y_dot).unwrap();
    let stop = stopped(silent.integrate_to(2.0).unwrap());
    assert!(stop.to_string().contains("stating the index"), "{stop}");
    let builder = RadauSolver::builder(pendulum).options(options());
    let mut stated = builder.build(start.t, &start.y, &start.y_dot).unwrap();
    let outcome = stated.integrate_to(2.0).unwrap();
    assert_eq!(outcome, Outcome::Reached { t: 2.0 });
}

/// Under a hidden constraint, failures may be caused by a short first step or by small tolerances
/// for amplified variables.
#[test]
fn under_a_hidden_constraint_longer_first_steps_are_named() {
    let pendulum = Pendulum::new(MechanicalForm::Index3);
    let start = pendulum.start();
    let options = RadauOptions {
        tolerances: Tolerances::scalar(1e-12, 1e-12),
        initial_step: Some(0.5),
        min_step: 0.4,
        ..RadauOptions::default()
    };
    let builder = RadauSolver::builder(pendulum).options(options);
    let mut solver = builder.build(start.t, &start.y, &start.y_dot).unwrap();
    let stop = stopped(solver.integrate_to(2.0).unwrap()).to_string();
    for remedy in ["initial_step", "velocities and multipliers"] {
        assert!(stop.contains(remedy), "{stop}");
    }
}
