//! Behavior after failures.

use myovib_conformance::AnyProblem;
use myovib_dae::IntegratorError::InvalidOption;
use std::panic::{AssertUnwindSafe, catch_unwind};

use myovib_dae::{
    LinearSolver, Linearization, Outcome, Problem, StepError, StopReason, Tolerances, VariableKind,
};
use myovib_radau::{RadauError, RadauOptions, RadauSolver, SparseDirectSolver};
use myovib_sparse::SparseOptions;
use nalgebra_sparse::pattern::SparsityPattern;
use num_complex::Complex64;

use crate::common::{radau, stopped, stopped_with_any_jacobian};
use myovib_conformance::samples::{MechanicalForm, Pendulum, Sample};

/// The equation ẏ = 1 − 2 y² with y = tanh(√2 t)/√2, whose residual can be made to fail.
pub(crate) struct Touchy {
    /// Called with (t, y) before each evaluation of the residual. The returned value is added to the residual.
    trouble: fn(f64, f64) -> Result<f64, StepError>,
    /// Factor for the Jacobian; 0 makes it singular.
    jacobian_factor: f64,
}

pub(crate) fn touchy(trouble: fn(f64, f64) -> Result<f64, StepError>) -> Touchy {
    Touchy { trouble, jacobian_factor: 1.0 }
}

/// The problem without failures.
pub(crate) fn well_behaved() -> impl Problem {
    touchy(|_, _| Ok(0.0))
}

impl Problem for Touchy {
    fn n_unknowns(&self) -> usize {
        1
    }

    fn residual(
        &mut self,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
        residual: &mut [f64],
    ) -> Result<(), StepError> {
        residual[0] = (self.trouble)(t, y[0])? + y_dot[0] - 1.0 + 2.0 * y[0] * y[0];
        Ok(())
    }

    fn jacobian_pattern(&self) -> SparsityPattern {
        SparsityPattern::try_from_offsets_and_indices(1, 1, vec![0, 1], vec![0]).unwrap()
    }

    fn jacobian(
        &mut self,
        _t: f64,
        y: &[f64],
        _y_dot: &[f64],
        a: f64,
        b: f64,
        values: &mut [f64],
    ) -> Result<(), StepError> {
        values[0] = self.jacobian_factor * (4.0 * a * y[0] + b);
        Ok(())
    }

    fn kinds(&self) -> Option<Vec<VariableKind>> {
        Some(vec![VariableKind::Differential])
    }

    fn indices(&self) -> Option<Vec<u8>> {
        Some(vec![0])
    }
}

pub(crate) fn solver(problem: Touchy, options: RadauOptions) -> RadauSolver<AnyProblem> {
    radau(problem).options(options).build(0.0, &[0.0], &[1.0]).unwrap()
}

fn recoverable(message: &str) -> Result<f64, StepError> {
    Err(StepError::Recoverable(message.to_owned()))
}

#[test]
fn a_recoverable_error_halves_the_step() {
    // The state at the end of the first step of size 0.02 is rejected. The state after a step of half the size is
    // accepted.
    let problem = touchy(|_, y| if y > 0.012 { recoverable("too large") } else { Ok(0.0) });
    let options = RadauOptions { initial_step: Some(0.02), ..RadauOptions::default() };
    let mut solver = solver(problem, options);
    assert_eq!(solver.step(1.0).unwrap(), Outcome::StepTaken { t: 0.01 });
    let stats = solver.statistics();
    assert_eq!((stats.steps, stats.step_solve_failures, stats.newton_failures), (1, 1, 1));
}

#[test]
fn a_lasting_recoverable_error_stops_with_its_message_and_the_last_state() {
    let problem = touchy(|t, _| if t > 0.5 { recoverable("t is late") } else { Ok(0.0) });
    let mut solver = solver(problem, RadauOptions::default());
    let stop = stopped(solver.integrate_to(1.0).unwrap());
    // Halved steps approach t = 0.5, but the last step cannot reach it.
    assert_eq!(stop.reason, StopReason::StepTooSmall);
    assert!(stop.message.ends_with("after: t is late"), "{}", stop.message);
    assert!((stop.t - 0.5).abs() < 1e-14 && stop.t == solver.t(), "{stop:?}");
    let exact = (2f64.sqrt() * stop.t).tanh() / 2f64.sqrt();
    // The relative tolerance is 1e-4.
    assert!((solver.y()[0] - exact).abs() < 1e-4);
}

#[test]
fn too_many_recoverable_errors_in_one_step_stop() {
    let problem = touchy(|t, _| if t > 0.0 { recoverable("never") } else { Ok(0.0) });
    let stop = stopped(solver(problem, RadauOptions::default()).step(1.0).unwrap());
    assert_eq!((stop.reason, stop.message.as_str()), (StopReason::ResidualFailed, "never"));
    assert_eq!(stop.statistics.step_solve_failures, 10);
}

#[test]
fn nan_is_recoverable() {
    let problem = touchy(|t, _| Ok(if t > 0.0 { f64::NAN } else { 0.0 }));
    let stop = stopped(solver(problem, RadauOptions::default()).step(1.0).unwrap());
    assert_eq!(stop.reason, StopReason::ResidualFailed);
    assert!(stop.message.starts_with("residual[0] = NaN at t = "), "{stop}");
}

/// The default linear solver with a fault: after `healthy` real solves, the next `failures` solves return NaN.
struct Overflowing {
    klu: SparseDirectSolver,
    healthy: u64,
    failures: u64,
}

impl<P: Problem> LinearSolver<P> for Overflowing {
    fn evaluate(&mut self, p: &mut P, at: &Linearization<'_>) -> Result<(), StepError> {
        self.klu.evaluate(p, at)
    }

    fn set_up(&mut self, p: &mut P, real: f64, complex: &[Complex64]) -> Result<(), StepError> {
        self.klu.set_up(p, real, complex)
    }

    fn solve_real(&mut self, p: &mut P, rhs: &mut [f64]) -> Result<(), StepError> {
        self.klu.solve_real(p, rhs)?;
        if self.healthy > 0 {
            self.healthy -= 1;
        } else if self.failures > 0 {
            self.failures -= 1;
            rhs.fill(f64::NAN);
        }
        Ok(())
    }

    fn solve_complex(&mut self, p: &mut P, k: usize, b: &mut [Complex64]) -> Result<(), StepError> {
        self.klu.solve_complex(p, k, b)
    }
}

#[test]
fn an_error_estimate_of_nan_halves_the_step() {
    let start = |healthy, failures| {
        let problem = well_behaved();
        let options = RadauOptions { initial_step: Some(0.01), ..RadauOptions::default() };
        let pattern = problem.jacobian_pattern();
        let matrices = Overflowing {
            klu: SparseDirectSolver::new(&pattern, SparseOptions::default()).unwrap(),
            healthy,
            failures,
        };
        RadauSolver::builder(problem)
            .options(options)
            .build_with(matrices, 0.0, &[0.0], &[1.0])
            .unwrap()
    };
    // The last real solve of the second step belongs to its error estimate.
    let mut healthy = start(u64::MAX, 0);
    healthy.step(1.0).unwrap();
    healthy.step(1.0).unwrap();
    let mut solver = start(healthy.statistics().work.unwrap().real_solves - 1, 1);
    solver.step(1.0).unwrap();
    solver.step(1.0).unwrap();
    let stats = solver.statistics();
    assert_eq!(stats.last_step, 0.5 * healthy.statistics().last_step);
    assert_eq!((stats.step_solve_failures, stats.error_test_failures), (1, 0));
}

/// The default linear solver with a fault: all solves fail.
struct Broken(SparseDirectSolver);

impl<P: Problem> LinearSolver<P> for Broken {
    fn evaluate(&mut self, p: &mut P, at: &Linearization<'_>) -> Result<(), StepError> {
        self.0.evaluate(p, at)
    }

    fn set_up(&mut self, p: &mut P, real: f64, complex: &[Complex64]) -> Result<(), StepError> {
        self.0.set_up(p, real, complex)
    }

    fn solve_real(&mut self, _: &mut P, _: &mut [f64]) -> Result<(), StepError> {
        Err(StepError::Fatal("the solver is broken".into()))
    }

    fn solve_complex(&mut self, _: &mut P, _: usize, _: &mut [Complex64]) -> Result<(), StepError> {
        Err(StepError::Recoverable("no solution".into()))
    }
}

#[test]
fn a_linear_solve_that_fails_is_named() {
    let problem = well_behaved();
    let pattern = problem.jacobian_pattern();
    let klu = SparseDirectSolver::new(&pattern, SparseOptions::default()).unwrap();
    let mut solver =
        RadauSolver::builder(problem).build_with(Broken(klu), 0.0, &[0.0], &[1.0]).unwrap();
    let error = solver.step(1.0).unwrap_err().to_string();
    assert!(error.starts_with("the linear solve failed at t = 0"), "{error}");
    assert!(error.ends_with("the solver is broken"), "{error}");
}

#[test]
fn weights_must_be_positive() {
    for weight in [-1.0, 0.0, f64::NAN, f64::INFINITY] {
        let mut solver = radau(well_behaved())
            .error_weights(move |_, y, w| {
                w[0] = if y[0] > 0.5 { weight } else { 1e4 };
                Ok(())
            })
            .build(0.0, &[0.0], &[1.0])
            .unwrap();
        let stop = stopped(solver.integrate_to(1.0).unwrap());
        assert_eq!(stop.reason, StopReason::ErrorWeightsFailed, "{stop}");
        let expected = format!("error weight[0] = {weight} must be positive");
        assert_eq!(stop.message, expected);
        assert!(solver.y()[0] > 0.5, "the step before was good");
    }
}

/// Checks that `step` rejects an output time equal to the initial time, which provides no time scale.
#[test]
fn an_output_time_at_the_start_gives_no_first_step() {
    let start = |t0| {
        let builder = radau(well_behaved());
        builder.build(t0, &[0.0], &[1.0]).unwrap()
    };
    for t0 in [0.0, 1.0] {
        let refused = start(t0).step(t0);
        assert!(matches!(refused, Err(RadauError::Common(InvalidOption { .. }))), "{refused:?}");
        let reached = start(t0).integrate_to(t0).unwrap();
        assert_eq!(reached, Outcome::Reached { t: t0 });
    }
}

#[test]
fn fatal_errors_are_returned() {
    let problem =
        touchy(
            |t, _| {
                if t > 0.5 { Err(StepError::Fatal("the probe fell off".into())) } else { Ok(0.0) }
            },
        );
    match solver(problem, RadauOptions::default()).integrate_to(1.0) {
        Err(RadauError::Fatal { function: "residual", t, h, source }) => {
            assert_eq!(source.to_string(), "the probe fell off");
            assert!(t <= 0.5 && t + h > 0.5, "t = {t}, h = {h}");
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_panic_passes_through() {
    let problem = touchy(|t, _| if t > 0.5 { panic!("at {t}") } else { Ok(0.0) });
    let mut solver = solver(problem, RadauOptions::default());
    let caught = catch_unwind(AssertUnwindSafe(|| solver.integrate_to(1.0)));
    assert!(caught.unwrap_err().downcast_ref::<String>().unwrap().starts_with("at 0."));
}

#[test]
fn a_singular_matrix_stops() {
    let problem = Touchy { jacobian_factor: 0.0, ..touchy(|_, _| Ok(0.0)) };
    let outcome = solver(problem, RadauOptions::default()).step(1.0).unwrap();
    let stop = stopped_with_any_jacobian(outcome);
    assert_eq!(stop.reason, StopReason::LinearSetupFailed);
    assert!(stop.wrong_entry.is_some());
    assert!(stop.message.contains("singular"), "{}", stop.message);
}

#[test]
fn a_wrong_jacobian_stops_by_convergence_failures() {
    // Corrections that are a hundred times too large diverge for any step size. A correction is necessary, because
    // ẏ0 = 0 is inconsistent.
    let problem = Touchy { jacobian_factor: 0.01, ..touchy(|_, _| Ok(0.0)) };
    let mut solver = radau(problem).build(0.0, &[0.0], &[0.0]).unwrap();
    let stop = stopped_with_any_jacobian(solver.step(1.0).unwrap());
    assert_eq!(stop.reason, StopReason::ConvergenceFailures);
    assert!(stop.wrong_entry.is_some());
    assert_eq!(stop.statistics.newton_failures, 10);
}

#[test]
fn too_many_failed_error_tests_stop_with_the_component_at_fault() {
    let options = RadauOptions {
        initial_step: Some(0.5),
        tolerances: Tolerances::scalar(1e-10, 1e-10),
        max_error_test_failures: 1,
        ..RadauOptions::default()
    };
    let stop = stopped(solver(touchy(|_, _| Ok(0.0)), options).step(1.0).unwrap());
    assert_eq!(stop.reason, StopReason::ErrorTestFailures);
    let worst = &stop.worst_components[0];
    assert!(worst.name == "y[0]" && worst.weighted_error > 1.0, "{worst:?}");
}

#[test]
fn a_jump_stops_at_the_smallest_step_allowed() {
    let jump = |t: f64, _: f64| Ok(if t > 0.5 { -1e9 } else { 0.0 });
    let options = RadauOptions { min_step: 1e-3, ..RadauOptions::default() };
    let stop = stopped(solver(touchy(jump), options).integrate_to(1.0).unwrap());
    assert_eq!(stop.reason, StopReason::StepTooSmall);
}

/// A pendulum whose residual cannot be evaluated after a certain time.
struct Wall(Pendulum, f64);

impl Problem for Wall {
    fn n_unknowns(&self) -> usize {
        self.0.n_unknowns()
    }

    fn residual(&mut self, t: f64, y: &[f64], v: &[f64], r: &mut [f64]) -> Result<(), StepError> {
        match t > self.1 {
            true => Err(StepError::Recoverable("a wall".to_owned())),
            false => self.0.residual(t, y, v, r),
        }
    }

    fn kinds(&self) -> Option<Vec<VariableKind>> {
        self.0.kinds()
    }

    fn indices(&self) -> Option<Vec<u8>> {
        self.0.indices()
    }
}

/// Checks that steps are not accepted if their rounding errors exceed the tolerance. In short steps before a failure of
/// the residual, the rounding errors of a constraint are amplified.
#[test]
fn the_state_before_a_wall_is_as_accurate_as_any_other() {
    for form in [MechanicalForm::Index3, MechanicalForm::Index2] {
        for (stages, tolerance) in [(3, 1e-4), (3, 1e-6), (5, 1e-6), (7, 1e-6), (5, 1e-8)] {
            let pendulum = Pendulum::new(form);
            let start = pendulum.start();
            let options = RadauOptions {
                stages,
                tolerances: Tolerances::scalar(tolerance, tolerance),
                ..RadauOptions::default()
            };
            let builder = radau(Wall(pendulum, 0.5)).options(options);
            let mut solver = builder.build(0.0, &start.y, &start.y_dot).unwrap();
            let stop = stopped(solver.integrate_to(1.0).unwrap());
            assert!(stop.t > 0.5 - 1e-4 && stop.t <= 0.5, "{stop}");
            let exact = pendulum.exact(stop.t).unwrap();
            let errors = (0..4).map(|i| (solver.y()[i] - exact[i]).abs());
            let error = errors.fold(0.0, f64::max);
            // The error of a successful run may be 100 times the tolerance.
            assert!(error < 100.0 * tolerance, "{form:?}, {stages} stages: {error:e}");
        }
    }
}
