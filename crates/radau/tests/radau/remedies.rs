//! Checks that an integration succeeds with each of the remedies suggested after a stop.

use myovib_conformance::AnyProblem;
use myovib_conformance::samples::{
    Constrained, Differentiated, MechanicalForm, Pendulum, Sample, SliderCrank,
};
use myovib_dae::{ConsistencyMode, Outcome, Problem, Remedy, StepError, Tolerances};
use myovib_radau::{RadauOptions, RadauSolver};
use sundials_wrap::{IdaOptions, IdaSolver};

use crate::common::{Oscillator, radau, solver, stopped, tolerance};

/// The pendulum of index 3.
#[derive(Clone, Copy)]
struct StatedPendulum {
    pendulum: Pendulum,
    /// Whether the problem states the indices of its variables.
    indices: bool,
    /// Whether the problem states its constraints.
    constraints: bool,
}

impl StatedPendulum {
    fn new(indices: bool, constraints: bool) -> Self {
        Self { pendulum: Pendulum::new(MechanicalForm::Index3), indices, constraints }
    }
}

impl Problem for StatedPendulum {
    fn n_unknowns(&self) -> usize {
        self.pendulum.n_unknowns()
    }

    fn residual(&mut self, t: f64, y: &[f64], v: &[f64], r: &mut [f64]) -> Result<(), StepError> {
        self.pendulum.residual(t, y, v, r)
    }

    fn indices(&self) -> Option<Vec<u8>> {
        self.pendulum.indices().filter(|_| self.indices)
    }

    fn n_constraints(&self) -> usize {
        if self.constraints { 2 } else { 0 }
    }

    fn constraints(&mut self, _: f64, y: &[f64], c: &mut [f64]) -> Result<(), StepError> {
        let both = [y[0] * y[0] + y[1] * y[1] - 1.0, y[0] * y[2] + y[1] * y[3]];
        c.copy_from_slice(&both[..c.len()]);
        Ok(())
    }
}

/// ẏ = 0 until t = 1, and ẏ = 1 afterward.
struct Jump;

impl Problem for Jump {
    fn n_unknowns(&self) -> usize {
        1
    }

    fn residual(&mut self, t: f64, _: &[f64], v: &[f64], r: &mut [f64]) -> Result<(), StepError> {
        r[0] = v[0] - if t > 1.0 { 1.0 } else { 0.0 };
        Ok(())
    }

    fn indices(&self) -> Option<Vec<u8>> {
        Some(vec![0])
    }
}

const REACHED: Outcome = Outcome::Reached { t: 2.0 };

fn pendulum(problem: StatedPendulum, options: RadauOptions) -> RadauSolver<AnyProblem> {
    let start = problem.pendulum.start();
    let builder = radau(problem).options(options);
    builder.build(start.t, &start.y, &start.y_dot).unwrap()
}

fn oscillator_by_bdf(tol: f64) -> Outcome {
    let start = Oscillator.start();
    let builder = IdaSolver::builder(Oscillator).tolerances(Tolerances::scalar(tol, tol));
    let mut solver = builder.build(start.t, &start.y, &start.y_dot).unwrap();
    solver.integrate_to(2.0).unwrap()
}

#[test]
fn after_too_many_steps_more_calls_and_more_steps_finish() {
    let limited = |most| RadauOptions { max_steps: Some(most), ..tolerance(1e-8) };
    let mut few = solver(Oscillator, limited(3));
    let stop = stopped(few.integrate_to(2.0).unwrap());
    assert_eq!(stop.remedies, [Remedy::AnotherCall, Remedy::MoreSteps]);
    let mut calls = (0..1000).map(|_| few.integrate_to(2.0).unwrap());
    assert!(calls.any(|outcome| outcome == REACHED));
    let mut many = solver(Oscillator, limited(1000));
    assert_eq!(many.integrate_to(2.0).unwrap(), REACHED);
}

#[test]
fn tolerances_below_rounding_are_loosened() {
    let stop = stopped(oscillator_by_bdf(1e-17));
    assert_eq!(stop.remedies, [Remedy::LooserTolerances]);
    assert_eq!(oscillator_by_bdf(1e-8), REACHED);
}

#[test]
fn for_an_index_above_that_of_bdf_lower_indices_and_radau_work() {
    let crank = |form| Differentiated::new(Constrained::new(SliderCrank, form));
    let by_bdf = |form| {
        let start = crank(form).start();
        let builder = IdaSolver::builder(crank(form)).options(IdaOptions {
            tolerances: Tolerances::scalar(1e-6, 1e-6),
            max_steps: Some(100_000),
            ..IdaOptions::default()
        });
        let mut solver = builder.build(start.t, &start.y, &start.y_dot).unwrap();
        solver.integrate_to(2.0).unwrap()
    };
    let stop = stopped(by_bdf(MechanicalForm::Index3));
    assert_eq!(stop.remedies, [Remedy::LowerIndex, Remedy::Radau]);
    let mut radau = solver(crank(MechanicalForm::Index3), tolerance(1e-6));
    assert_eq!(radau.integrate_to(2.0).unwrap(), REACHED);
    assert_eq!(by_bdf(MechanicalForm::Index1), REACHED);
}

/// Restarts with positions that violate the constraint by many tolerances, because the values at a restart are not
/// checked.
#[test]
fn initial_values_off_a_constraint_are_corrected() {
    let restarted = |are_stated, off| {
        let mut solver = pendulum(StatedPendulum::new(true, are_stated), tolerance(1e-8));
        let t = solver.integrate_to(0.5).unwrap().t();
        let (mut y, y_dot) = (solver.y().to_vec(), solver.y_dot().to_vec());
        y[0] += off;
        solver.reinit(t, &y, &y_dot).unwrap();
        solver
    };
    let stop = stopped(restarted(false, OFF).integrate_to(2.0).unwrap());
    let remedies = [Remedy::ConsistentStart, Remedy::StateConstraints];
    assert_eq!(stop.remedies, remedies);
    assert_eq!(restarted(false, 0.0).integrate_to(2.0).unwrap(), REACHED);
    let mut stated = restarted(true, OFF);
    let stop = stopped(stated.integrate_to(2.0).unwrap());
    assert_eq!(stop.remedies, [Remedy::ConsistentStart]);
    let mut stated = restarted(true, OFF);
    stated.correct_initial_values(ConsistencyMode::Constraints, 2.0).unwrap();
    assert_eq!(stated.integrate_to(2.0).unwrap(), REACHED);
}

/// Error of the position.
const OFF: f64 = 1e-3;

/// Integrates the pendulum of index 3, which fails if all variables have equal weights.
#[test]
fn indices_are_stated() {
    let mut silent = pendulum(StatedPendulum::new(false, false), tolerance(1e-8));
    let stop = stopped(silent.integrate_to(2.0).unwrap());
    assert!(stop.remedies.contains(&Remedy::StateIndices), "{stop}");
    let mut stated = pendulum(StatedPendulum::new(true, false), tolerance(1e-8));
    assert_eq!(stated.integrate_to(2.0).unwrap(), REACHED);
}

/// Limits the step size from below, so that the steps cannot resolve a jump of the input.
#[test]
fn a_jump_is_a_time_to_restart_at() {
    let options = |tol| RadauOptions { min_step: 1e-3, ..tolerance(tol) };
    let started = |tol| {
        let builder = radau(Jump).options(options(tol));
        builder.build(0.0, &[0.0], &[0.0]).unwrap()
    };
    let stop = stopped(started(1e-8).integrate_to(2.0).unwrap());
    let remedies = [Remedy::RestartAtBreak, Remedy::LooserTolerances];
    assert_eq!(stop.remedies, remedies);
    let mut restarted = started(1e-8);
    let outcome = restarted.integrate_to(1.0).unwrap();
    assert_eq!(outcome, Outcome::Reached { t: 1.0 });
    let y = restarted.y().to_vec();
    restarted.reinit(1.0, &y, &[1.0]).unwrap();
    assert_eq!(restarted.integrate_to(2.0).unwrap(), REACHED);
    assert_eq!(started(1e-2).integrate_to(2.0).unwrap(), REACHED);
}

/// Limits the step size from below. This limits the accuracy of multipliers of index 3, in which errors of positions
/// are divided by the square of the step size.
#[test]
fn looser_tolerances_of_multipliers_permit_longer_steps() {
    // Factors for the tolerances of all variables, of velocities and of multipliers.
    let outcome = |tol: f64, all: f64, [velocities, multipliers]: [f64; 2]| {
        let tol = all * tol;
        let [velocity, multiplier] = [velocities * tol, multipliers * tol];
        let absolute = vec![tol, tol, velocity, velocity, multiplier];
        let options = RadauOptions {
            tolerances: Tolerances::vector(tol, absolute),
            initial_step: Some(1e-3),
            min_step: 1e-3,
            ..RadauOptions::default()
        };
        let mut solver = pendulum(StatedPendulum::new(true, true), options);
        solver.integrate_to(2.0).unwrap()
    };
    for tol in [1e-8, 1e-9] {
        let stop = stopped(outcome(tol, 1.0, [1.0; 2]));
        let remedies =
            [Remedy::RestartAtBreak, Remedy::LooserTolerances, Remedy::LooserMultipliers];
        assert_eq!(stop.remedies, remedies);
        assert_eq!(outcome(tol, 1e3, [1.0; 2]), REACHED);
        assert_eq!(outcome(tol, 1.0, [1e2, 1e4]), REACHED);
    }
}
