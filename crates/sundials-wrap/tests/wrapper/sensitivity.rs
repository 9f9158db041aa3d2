//! Forward sensitivities, compared with closed forms, and their errors.

use myovib_dae::IntegratorError::{NoDenseOutput, WrongLength};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex};

use myovib_conformance::samples::{
    MechanicalForm, Oscillator, ParametricSample, Pendulum, ScaledLinear,
};
use myovib_dae::{
    Complex64, ConsistencyMode, Differenced, LinearSolver, Linearization, Parameter, Parameters,
    Problem, StepError, Suppressed, Tolerances,
};
use sundials_wrap::{Error, IdaOptions, IdaSolver, SensitivityMethod, SensitivityOptions};

use SensitivityMethod::{Simultaneous, Staggered};

/// Returns the largest error of p̄ S at the end, relative to 1 + |p̄ S|.
fn error<S: ParametricSample + Copy + Send + 'static>(
    sample: S,
    t_end: f64,
    tol: f64,
    options: SensitivityOptions,
) -> f64 {
    let (start, list) = (sample.start(), sample.parameters());
    let n = start.y.len();
    let starts = (0..list.len()).map(|j| [sample.exact_sensitivity(j, 0.0), vec![0.0; n]]);
    let mut solver = IdaSolver::builder(sample)
        .tolerances(Tolerances::scalar(tol, tol))
        .sensitivities(sample.differenced(), options, starts.collect())
        .build(start.t, &start.y, &start.y_dot)
        .unwrap();
    solver.correct_initial_values(ConsistencyMode::AlgebraicAndDerivatives, t_end).unwrap();
    assert_eq!(solver.integrate_to(t_end).unwrap().t(), t_end);
    let mut largest = 0.0_f64;
    for (j, parameter) in list.iter().enumerate() {
        let mut s = vec![0.0; n];
        solver.sensitivity(j, &mut s).unwrap();
        for (s, exact) in s.iter().zip(sample.exact_sensitivity(j, t_end)) {
            let error = parameter.scale * (s - exact).abs();
            largest = largest.max(error / (1.0 + parameter.scale * exact.abs()));
        }
    }
    largest
}

/// Local errors within the tolerance accumulate over a few hundred steps. The same is true for the errors of the
/// states.
#[test]
fn closed_forms_are_met_by_both_methods_in_and_out_of_the_error_test() {
    for method in [Staggered, Simultaneous] {
        for in_error_test in [true, false] {
            let options = SensitivityOptions { method, in_error_test };
            for tol in [1e-5, 1e-8] {
                for (name, error) in [
                    ("oscillator", error(Oscillator { omega: 3.0 }, 2.0, tol, options)),
                    ("linear", error(ScaledLinear { p: 2.0, q: 0.6 }, 2.0, tol, options)),
                ] {
                    println!("{name}, {options:?}, {tol:e}: {error:.1e}");
                    assert!(error < 300.0 * tol, "{name}, {options:?}, {tol:e}: {error:e}");
                }
            }
        }
    }
}

/// Compares positions and velocities of a pendulum in its stabilized form of index 2 with the closed form.
#[test]
fn the_stabilized_pendulum_has_its_sensitivity_to_gravity() {
    let sample = Pendulum::new(MechanicalForm::Stabilized);
    let (start, list) = (myovib_conformance::samples::Sample::start(&sample), sample.parameters());
    let starts = (0..2).map(|j| {
        let mut slope = vec![0.0; 6];
        // If the pendulum is at rest in the horizontal position, only the acceleration depends on gravity.
        slope[3] = if j == 1 { -1.0 } else { 0.0 };
        [sample.exact_sensitivity(j, 0.0), slope]
    });
    let mut solver = IdaSolver::builder(sample)
        .options(IdaOptions {
            tolerances: Tolerances::scalar(1e-8, 1e-8),
            suppressed: Suppressed::Algebraic,
            ..IdaOptions::default()
        })
        .sensitivities(sample.differenced(), SensitivityOptions::default(), starts.collect())
        .build(start.t, &start.y, &start.y_dot)
        .unwrap();
    assert_eq!(solver.integrate_to(1.0).unwrap().t(), 1.0);
    for (j, parameter) in list.iter().enumerate() {
        let mut s = vec![0.0; 6];
        solver.sensitivity(j, &mut s).unwrap();
        let exact = sample.exact_sensitivity(j, 1.0);
        for i in 0..4 {
            let error = (s[i] - exact[i]).abs() / (1.0 + exact[i].abs());
            // The bound is 300 times the tolerance, as above.
            assert!(error < 3e-6, "dy{i}/d{}: {error:e}", parameter.name);
        }
    }
}

/// The pendulum without an implemented Jacobian.
struct WithoutJacobian(Pendulum);

impl Problem for WithoutJacobian {
    fn n_unknowns(&self) -> usize {
        self.0.n_unknowns()
    }

    fn residual(&mut self, t: f64, y: &[f64], v: &[f64], r: &mut [f64]) -> Result<(), StepError> {
        self.0.residual(t, y, v, r)
    }
}

/// Returns the largest relative error of the sensitivities of a pendulum at t = 1.
fn error_of_pendulum<P: Problem + 'static>(
    sample: Pendulum,
    problem: P,
    parameters: impl Parameters<P> + Send + 'static,
    in_error_test: bool,
) -> f64 {
    let start = myovib_conformance::samples::Sample::start(&sample);
    let n = start.y.len();
    let starts = (0..2).map(|j| {
        let mut slope = vec![0.0; n];
        slope[3] = if j == 1 { -1.0 } else { 0.0 };
        [sample.exact_sensitivity(j, 0.0), slope]
    });
    let options = SensitivityOptions { in_error_test, ..SensitivityOptions::default() };
    let mut solver = IdaSolver::builder(problem)
        .options(IdaOptions {
            tolerances: Tolerances::scalar(1e-6, 1e-6),
            suppressed: Suppressed::Algebraic,
            strict_newton: true,
            ..IdaOptions::default()
        })
        .sensitivities(parameters, options, starts.collect())
        .build(start.t, &start.y, &start.y_dot)
        .unwrap();
    assert_eq!(solver.integrate_to(1.0).unwrap().t(), 1.0);
    let mut largest = 0.0_f64;
    for j in 0..2 {
        let mut s = vec![0.0; n];
        solver.sensitivity(j, &mut s).unwrap();
        for (s, exact) in s.iter().zip(sample.exact_sensitivity(j, 1.0)).take(4) {
            largest = largest.max((s - exact).abs() / (1.0 + exact.abs()));
        }
    }
    largest
}

/// Regression test: with convergence rates from earlier steps, sensitivities outside the error test had errors of 5e6.
/// Without a Jacobian, sensitivities in the error test stopped the integration.
#[test]
fn sensitivities_converge_in_each_step() {
    let stabilized = Pendulum::new(MechanicalForm::Stabilized);
    let outside = error_of_pendulum(stabilized, stabilized, stabilized.differenced(), false);
    let index_1 = Pendulum::new(MechanicalForm::Index1);
    let values = [1.0, 9.81];
    let parameters = Differenced::new(
        index_1.parameters(),
        move |_: &WithoutJacobian, j| values[j],
        |problem: &mut WithoutJacobian, j, value| problem.0.set(j, value),
    );
    let inside = error_of_pendulum(index_1, WithoutJacobian(index_1), parameters, true);
    // The bound is 300 times the tolerance, as above.
    assert!(outside < 3e-4 && inside < 3e-4, "{outside:e}, {inside:e}");
}

/// Parameters whose derivative calls a given function.
struct Scripted(Vec<Parameter>, fn() -> Result<(), StepError>);

impl Parameters<Oscillator> for Scripted {
    fn list(&self) -> &[Parameter] {
        &self.0
    }

    fn derivative(
        &mut self,
        _: &mut Oscillator,
        _: usize,
        _: f64,
        _: &[f64],
        _: &[f64],
        out: &mut [f64],
    ) -> Result<(), StepError> {
        out.fill(0.0);
        (self.1)()
    }
}

fn reported(
    does: fn() -> Result<(), StepError>,
    starts: usize,
) -> Result<IdaSolver<Oscillator>, Error> {
    let parameters = Scripted(vec![Parameter::new("p", 1.0)], does);
    let starts = vec![[vec![0.0; 2], vec![0.0; 2]]; starts];
    IdaSolver::builder(Oscillator { omega: 1.0 })
        .sensitivities(parameters, SensitivityOptions::default(), starts)
        .build(0.0, &[1.0, 0.0], &[0.0, -1.0])
}

#[test]
fn a_panic_passes_through_c_and_a_fatal_error_comes_back() {
    let mut solver = reported(|| panic!("on purpose"), 1).unwrap();
    let panic = catch_unwind(AssertUnwindSafe(|| solver.integrate_to(1.0))).unwrap_err();
    assert_eq!(panic.downcast_ref::<&str>(), Some(&"on purpose"));
    let mut solver = reported(|| Err(StepError::Fatal("no more".into())), 1).unwrap();
    let error = solver.integrate_to(1.0).unwrap_err();
    assert!(matches!(&error, Error::Callback { function, .. } if function.contains("sensitivity")));
    let mut solver = reported(|| Err(StepError::Recoverable("not here".into())), 1).unwrap();
    let outcome = solver.integrate_to(1.0).unwrap();
    assert!(matches!(outcome, myovib_dae::Outcome::Stopped(_)), "{outcome:?}");
}

#[test]
fn misuse_is_rejected_and_without_parameters_nothing_is_returned() {
    assert!(matches!(reported(|| Ok(()), 2), Err(Error::Common(WrongLength { .. }))));
    let mut solver = reported(|| Ok(()), 1).unwrap();
    solver.integrate_to(0.5).unwrap();
    let none = solver.sensitivity(1, &mut [0.0; 2]);
    assert!(matches!(none, Err(Error::NoParameter { parameter: 1, of: 1 })));
    let outside = solver.sensitivity_dense_output(0, 9.0, 0, &mut [0.0; 2]);
    assert!(matches!(outside, Err(Error::Common(NoDenseOutput { .. }))));
    let plain = IdaSolver::builder(Oscillator { omega: 1.0 })
        .build(0.0, &[1.0, 0.0], &[0.0, -1.0])
        .unwrap();
    assert_eq!((plain.n_parameters(), plain.sensitivity_statistics()), (0, Default::default()));
}

/// Checks that the sensitivities after a restart are the same.
#[test]
fn reinit_starts_the_sensitivities_again() {
    let sample = Oscillator { omega: 2.0 };
    let starts = vec![[vec![0.0, 0.0], vec![0.0, -4.0]]];
    let mut solver = IdaSolver::builder(sample)
        .sensitivities(sample.differenced(), SensitivityOptions::default(), starts)
        .build(0.0, &[1.0, 0.0], &[0.0, -4.0])
        .unwrap();
    let mut run = || {
        solver.integrate_to(1.0).unwrap();
        let mut s = [0.0; 2];
        solver.sensitivity(0, &mut s).unwrap();
        solver.reinit(0.0, &[1.0, 0.0], &[0.0, -4.0], &[]).unwrap();
        s
    };
    let (first, again) = (run(), run());
    // IDAS keeps its estimate of the convergence rate of Newton's method. The resulting difference is a fraction of the
    // tolerance of 1e-4.
    for (first, again) in first.into_iter().zip(again) {
        assert!((first - again).abs() < 1e-6, "{first} {again}");
    }
}

/// Returns a solver for the oscillator with its sensitivity, for a relative tolerance of 1e-8.
fn oscillating() -> IdaSolver<Oscillator> {
    let sample = Oscillator { omega: 2.0 };
    let starts = vec![[vec![0.0, 0.0], vec![0.0, -4.0]]];
    let options = IdaOptions {
        tolerances: Tolerances::scalar(1e-8, 1e-10),
        max_steps: None,
        ..IdaOptions::default()
    };
    IdaSolver::builder(sample)
        .options(options)
        .sensitivities(sample.differenced(), SensitivityOptions::default(), starts)
        .build(0.0, &[1.0, 0.0], &[0.0, -4.0])
        .unwrap()
}

/// Regression test: a restart at any time used the sensitivities of the first start.
#[test]
fn sensitivities_are_continued_over_a_reinit_on_request_only() {
    let mut solver = oscillating();
    solver.integrate_to(0.5).unwrap();
    let (y, y_dot) = (solver.y().to_vec(), solver.y_dot().to_vec());
    let mut s = [vec![0.0; 2], vec![0.0; 2]];
    for (derivative, s) in s.iter_mut().enumerate() {
        solver.sensitivity_dense_output(0, 0.5, derivative, s).unwrap();
    }
    let refused = solver.reinit(0.5, &y, &y_dot, &[]);
    assert!(matches!(refused, Err(Error::SensitivitiesDue { .. })), "{refused:?}");
    solver.reinit_with_sensitivities(0.5, &y, &y_dot, &[], vec![s]).unwrap();
    solver.integrate_to(1.0).unwrap();
    let mut found = [0.0; 2];
    solver.sensitivity(0, &mut found).unwrap();
    let exact = Oscillator { omega: 2.0 }.exact_sensitivity(0, 1.0);
    // The error is 1e-8 per step, for several hundred steps.
    assert!((found[0] - exact[0]).abs() < 1e-6, "{found:?} {exact:?}");
}

/// Regression test: parameters that were changed after the solver was built were reset to their previous values.
#[test]
fn a_parameter_that_was_changed_keeps_its_value() {
    let mut solver = oscillating();
    solver.integrate_to(1.0).unwrap();
    solver.problem_mut().omega = 3.0;
    solver.reinit(0.0, &[1.0, 0.0], &[0.0, -9.0], &[]).unwrap();
    solver.integrate_to(1.0).unwrap();
    assert_eq!(solver.problem().omega, 3.0);
    // The bound is the same as above.
    assert!((solver.y()[0] - 3_f64.cos()).abs() < 1e-6);
    let mut found = [0.0; 2];
    solver.sensitivity(0, &mut found).unwrap();
    let exact = Oscillator { omega: 3.0 }.exact_sensitivity(0, 1.0);
    assert!((found[0] - exact[0]).abs() < 1e-6, "{found:?} {exact:?}");
}

/// The equation ẏ + p y = 0, which records the states of its evaluations.
struct Recording(f64, Arc<Mutex<Vec<[f64; 3]>>>);

impl Problem for Recording {
    fn n_unknowns(&self) -> usize {
        1
    }

    fn residual(&mut self, t: f64, y: &[f64], v: &[f64], r: &mut [f64]) -> Result<(), StepError> {
        self.1.lock().unwrap().push([t, y[0], v[0]]);
        r[0] = v[0] + self.0 * y[0];
        Ok(())
    }
}

/// Parameter p of [`Recording`] with an exact derivative. Counts the evaluations of the derivative.
struct Counted([Parameter; 1], Arc<Mutex<u64>>);

impl Parameters<Recording> for Counted {
    fn list(&self) -> &[Parameter] {
        &self.0
    }

    fn derivative(
        &mut self,
        _: &mut Recording,
        _: usize,
        _: f64,
        y: &[f64],
        _: &[f64],
        out: &mut [f64],
    ) -> Result<(), StepError> {
        *self.1.lock().unwrap() += 1;
        out.copy_from_slice(y);
        Ok(())
    }
}

/// Regression: each iteration for the sensitivities linearized F again, and the counters excluded these evaluations.
#[test]
fn a_state_is_linearized_once_and_all_evaluations_are_counted() {
    for method in [Staggered, Simultaneous] {
        let (states, derivatives) = (Arc::default(), Arc::default());
        let problem = Recording(1.0, Arc::clone(&states));
        let parameters = Counted([Parameter::new("p", 1.0)], Arc::clone(&derivatives));
        let options = SensitivityOptions { method, ..SensitivityOptions::default() };
        let mut solver = IdaSolver::builder(problem)
            .tolerances(Tolerances::scalar(1e-8, 1e-10))
            .sensitivities(parameters, options, vec![[vec![0.0], vec![-1.0]]])
            .build(0.0, &[1.0], &[-1.0])
            .unwrap();
        // The evaluations of the consistency check are not counted.
        let before = states.lock().unwrap().len();
        solver.integrate_to(1.0).unwrap();
        let (statistics, of) = (solver.statistics(), solver.sensitivity_statistics());
        let evaluations = (states.lock().unwrap().len() - before) as u64;
        let counted = statistics.residual_evaluations + statistics.difference_evaluations;
        let n_derivatives = *derivatives.lock().unwrap();
        println!("{method:?}: {n_derivatives} of {}, {evaluations}", of.residual_evaluations);
        if method == Staggered {
            // IDAS evaluates F at each state of a staggered solve, and does not count it.
            assert_eq!(evaluations, counted + n_derivatives);
            assert!(n_derivatives < of.residual_evaluations, "{of:?}");
        } else {
            assert_eq!(evaluations, counted);
        }
        let mut s = [0.0];
        solver.sensitivity(0, &mut s).unwrap();
        // 300 times the tolerance, as above.
        assert!((s[0] + (-1.0_f64).exp()).abs() < 3e-6, "{s:?}");
    }
}

/// Regression: a state must be linearized again if the problem has changed, even if the state has not.
#[test]
fn a_changed_problem_is_linearized_again() {
    let start = vec![[vec![0.0], vec![-1.0]]];
    let mut slopes = [0.0; 2];
    let parameters = Differenced::new(
        vec![Parameter::new("p", 1.0)],
        |problem: &Recording, _| problem.0,
        |problem: &mut Recording, _, p| problem.0 = p,
    );
    let mut solver = IdaSolver::builder(Recording(1.0, Arc::default()))
        .tolerances(Tolerances::scalar(1e-8, 1e-10))
        .sensitivities(parameters, SensitivityOptions::default(), start.clone())
        .build(0.0, &[1.0], &[-1.0])
        .unwrap();
    for (p, slope) in [1.0, 2.0].into_iter().zip(&mut slopes) {
        solver.problem_mut().0 = p;
        solver.reinit_with_sensitivities(0.0, &[1.0], &[-p], &[], start.clone()).unwrap();
        solver.integrate_to(1.0).unwrap();
        let mut s = [0.0];
        solver.sensitivity(0, &mut s).unwrap();
        *slope = s[0] + (-p).exp();
    }
    // 300 times the tolerance, as above.
    assert!(slopes.iter().all(|error| error.abs() < 3e-6), "{slopes:?}");
}

/// ẏ + p y² = 0.
struct Decay(f64);

impl Problem for Decay {
    fn n_unknowns(&self) -> usize {
        1
    }

    fn residual(&mut self, _: f64, y: &[f64], v: &[f64], r: &mut [f64]) -> Result<(), StepError> {
        r[0] = v[0] + self.0 * y[0] * y[0];
        Ok(())
    }
}

/// A linear solver that records the weights it receives, relative to the weights of y.
struct Noting {
    jacobian: f64,
    y: f64,
    ratios: Arc<Mutex<Vec<f64>>>,
}

impl LinearSolver<Decay> for Noting {
    fn evaluate(&mut self, problem: &mut Decay, at: &Linearization<'_>) -> Result<(), StepError> {
        let of_y = 1.0 / (1e-6 * at.y[0].abs() + 1e-6);
        self.ratios.lock().unwrap().push(at.weights[0] / of_y);
        self.y = 2.0 * problem.0 * at.y[0];
        Ok(())
    }

    fn set_up(&mut self, _: &mut Decay, c: f64, _: &[Complex64]) -> Result<(), StepError> {
        self.jacobian = self.y + c;
        Ok(())
    }

    fn solve_real(&mut self, _: &mut Decay, rhs: &mut [f64]) -> Result<(), StepError> {
        rhs[0] /= self.jacobian;
        Ok(())
    }

    fn solve_complex(
        &mut self,
        _: &mut Decay,
        _: usize,
        _: &mut [Complex64],
    ) -> Result<(), StepError> {
        unreachable!("BDF has no complex systems");
    }
}

/// Regression test: IDAS uses one function for the weights of y and of the sensitivities. Linear solvers received the
/// weights of the last call of this function. At a scale of 1e4, these differed from the weights of y by a factor of
/// 1714.
#[test]
fn linear_solvers_are_given_the_weights_of_y() {
    for scale in [1.0, 1e4] {
        let ratios = Arc::new(Mutex::new(Vec::new()));
        let linear_solver = Noting { jacobian: 1.0, y: 0.0, ratios: Arc::clone(&ratios) };
        let parameter = Parameter { scale, ..Parameter::new("p", 1.0) };
        let parameters = Differenced::new(
            vec![parameter],
            |problem: &Decay, _| problem.0,
            |problem: &mut Decay, _, p| problem.0 = p,
        );
        let options = SensitivityOptions { in_error_test: false, ..SensitivityOptions::default() };
        let mut solver = IdaSolver::builder(Decay(1.0))
            .options(IdaOptions {
                tolerances: Tolerances::scalar(1e-6, 1e-6),
                max_steps: None,
                ..IdaOptions::default()
            })
            .linear_solver(linear_solver)
            .sensitivities(parameters, options, vec![[vec![0.0], vec![-1.0]]])
            .build(0.0, &[1.0], &[-1.0])
            .unwrap();
        solver.integrate_to(2.0).unwrap();
        let ratios = ratios.lock().unwrap();
        assert!(ratios.len() > 5, "{}", ratios.len());
        assert!(ratios.iter().all(|ratio| *ratio == 1.0), "{ratios:?}");
    }
}
