//! Failures of backward problems and their misuse.

use myovib_dae::IntegratorError::{
    AfterTheStart, InvalidOption, NoQuadrature, NotFinite, TimeBehind, WrongLength,
};
use std::panic::{AssertUnwindSafe, catch_unwind};

use myovib_conformance::samples::{MechanicalForm, Oscillator, Pendulum, Sample};
use myovib_dae::{Direction, Outcome, Problem, StepError, StopReason, Tolerances};
use sundials_wrap::adjoint::{
    AdjointProblem, BackwardOptions, BackwardProblem, Checkpoints, ForwardState, Interpolation,
};
use sundials_wrap::{Error, IdaSolver};

use crate::adjoint::every;
use Interpolation::Hermite;

fn oscillator(tolerance: f64) -> IdaSolver<Oscillator> {
    IdaSolver::builder(Oscillator { omega: 3.0 })
        .tolerances(Tolerances::scalar(tolerance, tolerance))
        .checkpoints(every(10, Hermite))
        .build(0.0, &[1.0, 0.0], &[0.0, -9.0])
        .unwrap()
}

/// An adjoint whose residual calls a given function.
struct Told(fn(&mut Oscillator) -> Result<(), StepError>);

impl BackwardProblem<Oscillator> for Told {
    fn n_unknowns(&self) -> usize {
        1
    }

    fn residual(
        &mut self,
        forward: &mut Oscillator,
        at: &ForwardState,
        values: &[f64],
        rates: &[f64],
        residual: &mut [f64],
    ) -> Result<(), StepError> {
        residual[0] = rates[0] - values[0] + at.y[0];
        // The kinds are determined at the end of the run.
        if at.t < 5.0 { (self.0)(forward) } else { Ok(()) }
    }
}

fn reported(does: fn(&mut Oscillator) -> Result<(), StepError>) -> IdaSolver<Oscillator> {
    let mut solver = oscillator(1e-6);
    solver.integrate_to(5.0).unwrap();
    let end = solver.forward_state().unwrap();
    let options = BackwardOptions::default();
    solver.add_backward(Told(does), &options, &end, [&[0.0], &[-end.y[0]]]).unwrap();
    solver
}

#[test]
fn panics_and_errors_of_backward_problems_come_back() {
    let mut solver = reported(|_| panic!("on purpose"));
    let panic = catch_unwind(AssertUnwindSafe(|| solver.integrate_back_to(0.0))).unwrap_err();
    assert_eq!(panic.downcast_ref::<&str>(), Some(&"on purpose"));
    let mut solver = reported(|_| Err(StepError::Fatal("no more".into())));
    let error = solver.integrate_back_to(0.0).unwrap_err();
    assert!(matches!(&error, Error::Callback { function, .. } if function.contains("backward")));
    let mut solver = reported(|_| Err(StepError::Recoverable("not here".into())));
    let Outcome::Stopped(stop) = solver.integrate_back_to(0.0).unwrap() else {
        panic!("went through")
    };
    assert_eq!(stop.reason, StopReason::ResidualFailed);
    assert!(stop.message.contains("not here"), "{stop}");
}

/// IDAS stores a fixed number of repeated steps and would write beyond its buffer. Therefore, a repeated run is stopped
/// if it takes more steps.
#[test]
fn an_unrepeatable_forward_run_is_reported() {
    let mut solver = reported(|oscillator| {
        oscillator.omega = 3000.0;
        Ok(())
    });
    let error = solver.integrate_back_to(0.0).unwrap_err();
    assert!(matches!(error, Error::NotRepeated { .. }), "{error}");
}

/// After a backward run, the forward run can only be restarted. The restarted run has the same results as the first.
#[test]
fn a_forward_run_that_was_left_is_started_again_only() {
    let mut solver = oscillator(1e-8);
    let mut run = |again: Option<sundials_wrap::adjoint::Backward>| {
        solver.integrate_to(5.0).unwrap();
        let end = solver.forward_state().unwrap();
        let (lambda, slope) = ([0.0, 0.0], [-2.0 * end.y[0], 0.0]);
        let start = [&lambda[..], &slope];
        let backward = match again {
            None => {
                let problem = *solver.problem();
                let adjoint = AdjointProblem::new(&problem, |_, at, of_y, _| {
                    of_y[0] = 2.0 * at.y[0];
                    Ok(())
                });
                let options = BackwardOptions {
                    tolerances: Tolerances::scalar(1e-8, 1e-8),
                    ..BackwardOptions::default()
                };
                solver.add_backward(adjoint, &options, &end, start).unwrap()
            }
            Some(backward) => {
                solver.restart_backward(backward, &end, start).unwrap();
                backward
            }
        };
        let steps = solver.statistics().steps;
        solver.integrate_back_to(2.0).unwrap();
        solver.integrate_back_to(0.0).unwrap();
        assert_eq!(solver.statistics().steps, steps);
        assert!(matches!(solver.integrate_to(6.0), Err(Error::ForwardRunLeft)));
        let mut y = [0.0; 2];
        assert!(matches!(solver.dense_output(5.0, 0, &mut y), Err(Error::ForwardRunLeft)));
        let behind = solver.integrate_back_to(1.0);
        assert!(matches!(behind, Err(Error::Common(TimeBehind { .. }))), "{behind:?}");
        let values = solver.backward(backward).unwrap().values.clone();
        solver.reinit(0.0, &[1.0, 0.0], &[0.0, -9.0], &[]).unwrap();
        (backward, values)
    };
    let (backward, first) = run(None);
    let (_, again) = run(Some(backward));
    // G = ∫ y² dt of y = y(0) cos 3t: dG/dy(0) = ∫ 2 cos² 3t dt. The bound covers the local errors of about a hundred
    // steps.
    let exact = 5.0 + 30_f64.sin() / 6.0;
    println!("{first:?} {again:?} {exact}");
    for found in [&first, &again] {
        assert!((found[0].abs() - exact).abs() < 1e-5, "{found:?} {exact}");
    }
}

#[test]
fn misuse_of_backward_problems_is_rejected() {
    let index_3 = Pendulum::new(MechanicalForm::Index3);
    let start = index_3.start();
    let refused = IdaSolver::builder(index_3)
        .checkpoints(Checkpoints::default())
        .build(start.t, &start.y, &start.y_dot)
        .unwrap_err();
    assert!(matches!(refused, Error::NoAdjoint { index: 3 }));

    let builder = || {
        let builder = IdaSolver::builder(Oscillator { omega: 3.0 });
        builder.checkpoints(every(10, Hermite))
    };
    let watched = builder().roots(vec![Direction::Both], |_, _, y, _, g| {
        g[0] = y[0];
        Ok(())
    });
    let refused = watched.build(0.0, &[1.0, 0.0], &[0.0, -9.0]).unwrap_err();
    assert!(matches!(refused, Error::NotWithCheckpoints { what: "roots" }));
    let mut solver = oscillator(1e-6);
    let refused = solver.set_stop_time(3.0).unwrap_err();
    assert!(matches!(refused, Error::NotWithCheckpoints { .. }));
    let never = builder().checkpoints(every(0, Hermite));
    let refused = never.build(0.0, &[1.0, 0.0], &[0.0, -9.0]).unwrap_err();
    assert!(matches!(refused, Error::Common(InvalidOption { .. })));

    let nothing = || Told(|_| Ok(()));
    let options = BackwardOptions::default();
    let state = solver.forward_state().unwrap();
    let before = solver.add_backward(nothing(), &options, &state, [&[0.0], &[0.0]]);
    assert!(matches!(before, Err(Error::Common(InvalidOption { .. }))), "{before:?}");
    assert!(matches!(solver.integrate_back_to(0.0), Err(Error::NoBackward { .. })));
    solver.integrate_to(6.0).unwrap();
    let state = solver.forward_state().unwrap();
    let short = solver.add_backward(nothing(), &options, &state, [&[], &[0.0]]);
    assert!(matches!(short, Err(Error::Common(WrongLength { .. }))), "{short:?}");
    let endless = solver.add_backward(nothing(), &options, &state, [&[f64::NAN], &[0.0]]);
    assert!(matches!(endless, Err(Error::Common(NotFinite { .. }))), "{endless:?}");
    let tested = BackwardOptions { quadrature_tolerances: Some((1e-6, 1e-6)), ..options.clone() };
    let none = solver.add_backward(nothing(), &tested, &state, [&[0.0], &[0.0]]);
    assert!(matches!(none, Err(Error::Common(NoQuadrature))), "{none:?}");
    let (lambda, slope) = ([0.0], [-state.y[0]]);
    let backward = solver.add_backward(nothing(), &options, &state, [&lambda, &slope]).unwrap();
    assert!(matches!(solver.integrate_back_to(7.0), Err(Error::Common(TimeBehind { .. }))));
    assert!(matches!(solver.integrate_back_to(-1.0), Err(Error::Common(InvalidOption { .. }))));
    solver.integrate_back_to(0.0).unwrap();
    let late = solver.correct_backward(backward, 1.0);
    assert!(matches!(late, Err(Error::Common(AfterTheStart { .. }))), "{late:?}");
    let mut plain = IdaSolver::builder(Oscillator { omega: 3.0 })
        .build(0.0, &[1.0, 0.0], &[0.0, -9.0])
        .unwrap();
    let unkept = plain.integrate_back_to(0.0);
    assert!(matches!(unkept, Err(Error::NoCheckpoints)), "{unkept:?}");
    assert!(matches!(plain.backward(backward), Err(Error::NoBackward { number: 0, of: 0 })));
}

/// ẏ + y² = 0.
struct Square;

impl Problem for Square {
    fn n_unknowns(&self) -> usize {
        1
    }

    fn residual(&mut self, _: f64, y: &[f64], v: &[f64], r: &mut [f64]) -> Result<(), StepError> {
        r[0] = v[0] + y[0] * y[0];
        Ok(())
    }
}

/// Regression test: after a failed gradient, the matrices of its state were used for the previous state.
#[test]
fn a_failed_gradient_leaves_no_matrices_of_another_state() {
    let mut calls = 0;
    let mut adjoint = AdjointProblem::new(&Square, move |_: &mut Square, _, _: &mut [f64], _| {
        calls += 1;
        match calls {
            2 => Err(StepError::Recoverable("outside of the data".into())),
            _ => Ok(()),
        }
    });
    let at = |y: f64| ForwardState { t: y, y: vec![y], y_dot: vec![0.0], s: vec![] };
    let mut residual = |y: f64| {
        let mut r = [0.0];
        let evaluated = adjoint.residual(&mut Square, &at(y), &[1.0], &[0.0], &mut r);
        evaluated.map(|()| r[0])
    };
    let first = residual(1.0).unwrap();
    assert!(residual(5.0).is_err());
    assert_eq!(residual(1.0).unwrap(), first);
    // −∂F/∂y λ = −2 y, from difference quotients over a distance of 1.
    assert!((first + 2.0).abs() < 1.1, "{first}");
}
