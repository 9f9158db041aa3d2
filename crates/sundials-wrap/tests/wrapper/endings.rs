//! User functions that panic or write NaN or huge values, and solvers dropped after calls in any order.

use myovib_dae::IntegratorError::TimeBehind;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use myovib_dae::{
    Complex64, Direction, LinearSolver, Linearization, Outcome, StepError, StopReason, Tolerances,
};

use sundials_wrap::{Error, IdaOptions, IdaSolver};

use crate::decay::Decay;

/// Type of failure of a function.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Fault {
    None,
    Panic,
    Fail,
    Write(f64),
}

/// Failure of a single function, starting with its third call.
#[derive(Clone)]
struct Plan {
    function: &'static str,
    trouble: Fault,
    calls: Arc<AtomicU64>,
}

impl Plan {
    fn new(function: &'static str, trouble: Fault) -> Self {
        let calls = Arc::default();
        Self { function, trouble, calls }
    }

    /// Returns the value that `function` writes instead of `good`.
    fn value(&self, function: &str, good: f64) -> Result<f64, StepError> {
        if function != self.function || self.calls.fetch_add(1, Ordering::Relaxed) < 2 {
            return Ok(good);
        }
        match self.trouble {
            Fault::None => Ok(good),
            Fault::Panic => panic!("the {function} panics"),
            Fault::Fail => Err(StepError::Fatal("disk on fire".into())),
            Fault::Write(value) => Ok(value),
        }
    }
}

/// Linear solver for the Newton matrix of ẏ = −y, which is 1 + c_j.
struct ScalarSolver {
    plan: Plan,
    matrix: f64,
}

impl LinearSolver<Decay> for ScalarSolver {
    fn evaluate(&mut self, _: &mut Decay, _: &Linearization<'_>) -> Result<(), StepError> {
        Ok(())
    }

    fn set_up(&mut self, _: &mut Decay, c_j: f64, _: &[Complex64]) -> Result<(), StepError> {
        self.matrix = self.plan.value("linear setup", 1.0 + c_j)?;
        Ok(())
    }

    fn solve_real(&mut self, _: &mut Decay, rhs: &mut [f64]) -> Result<(), StepError> {
        rhs[0] = self.plan.value("linear solve", rhs[0] / self.matrix)?;
        Ok(())
    }

    fn solve_complex(
        &mut self,
        _: &mut Decay,
        _: usize,
        _: &mut [Complex64],
    ) -> Result<(), StepError> {
        unreachable!("BDF has real shifts only")
    }
}

/// Creates a solver with all functions, one of which fails.
fn solver(plan: &Plan) -> IdaSolver<Decay> {
    let of = || plan.clone();
    let (residual, jacobian, weights, roots, rates) = (of(), of(), of(), of(), of());
    let mut problem = Decay::residual(move |_, y| residual.value("residual", y));
    problem.jacobian = Box::new(move |_| jacobian.value("Jacobian", 1.0));
    let mut builder = IdaSolver::builder(problem)
        .error_weights(move |_, y, w| {
            w[0] = weights.value("error weight function", 1.0 / (1e-4 * y[0].abs() + 1e-8))?;
            Ok(())
        })
        .roots([Direction::Both], move |_, _, y, _, g| {
            g[0] = roots.value("root function", y[0] + 1.0)?;
            Ok(())
        })
        .quadrature([0.0], Some((1e-4, 1e-8)), move |_, _, y, _, rate| {
            rate[0] = rates.value("quadrature", y[0])?;
            Ok(())
        });
    if plan.function.starts_with("linear") {
        let (plan, matrix) = (of(), f64::NAN);
        builder = builder.linear_solver(ScalarSolver { plan, matrix });
    }
    builder.build(0.0, &[1.0], &[-1.0]).unwrap()
}

/// Each function, and the expected reason of the stop if only this function fails.
const FUNCTIONS: [(&str, StopReason); 7] = [
    ("residual", StopReason::ResidualFailed),
    ("Jacobian", StopReason::JacobianFailed),
    ("error weight function", StopReason::ErrorWeightsFailed),
    ("root function", StopReason::RootFunctionFailed),
    ("quadrature", StopReason::QuadratureFailed),
    // A NaN in a setup is detected in the solve.
    ("linear setup", StopReason::LinearSolveFailed),
    ("linear solve", StopReason::LinearSolveFailed),
];

#[test]
fn without_trouble_all_functions_are_called_and_agree_with_the_solution() {
    for (function, _) in FUNCTIONS {
        let plan = Plan::new(function, Fault::None);
        let mut solver = solver(&plan);
        let outcome = solver.integrate_to(1.0).unwrap();
        assert_eq!(outcome, Outcome::Reached { t: 1.0 }, "{function}");
        assert!(plan.calls.load(Ordering::Relaxed) > 2, "{function}");
        let mut integral = [0.0];
        solver.quadrature(&mut integral).unwrap();
        // y = exp(−t); the tolerance is 1e-4 per step, for about thirty steps.
        let decayed = 1.0 - (-1.0_f64).exp();
        assert!((integral[0] - decayed).abs() < 3e-3, "{integral:?}");
    }
}

#[test]
fn a_panic_in_any_function_comes_back_as_it_was() {
    for (function, _) in FUNCTIONS {
        let plan = Plan::new(function, Fault::Panic);
        let mut solver = solver(&plan);
        let run = AssertUnwindSafe(|| solver.integrate_to(1.0));
        let panic = catch_unwind(run).expect_err(function);
        let text = panic.downcast_ref::<String>().unwrap();
        assert_eq!(*text, format!("the {function} panics"));
        // The solver can still be queried, restarted and converted back into its problem.
        assert!(solver.t().is_finite() && solver.statistics().steps < 100);
        plan.calls.store(0, Ordering::Relaxed);
        solver.reinit(0.0, &[1.0], &[-1.0], &[0.0]).unwrap();
        let again = catch_unwind(AssertUnwindSafe(|| solver.integrate_to(1.0)));
        assert!(again.is_err(), "{function}");
        drop(solver.into_problem());
    }
}

#[test]
fn a_fatal_error_of_any_function_ends_the_integration() {
    for (function, _) in FUNCTIONS {
        let error = solver(&Plan::new(function, Fault::Fail)).integrate_to(1.0).unwrap_err();
        let expected = format!("the {function} failed at t = ");
        let message = error.to_string();
        assert!(message.starts_with(&expected), "{message}");
        assert!(message.ends_with("disk on fire"), "{message}");
    }
}

#[test]
fn non_finite_values_stop_and_name_the_function() {
    for (function, reason) in FUNCTIONS {
        for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            // The matrix of a user's linear solver is not checked, but its solution is. However, b / ∞ is a finite
            // number.
            if function == "linear setup" && value.is_infinite() {
                continue;
            }
            let mut solver = solver(&Plan::new(function, Fault::Write(value)));
            let outcome = solver.integrate_to(1.0).unwrap();
            let Outcome::Stopped(stop) = outcome else { panic!("{function} {value}: {outcome:?}") };
            let named = match function {
                "linear setup" => "linear solve[0]",
                "error weight function" => "error weight[0]",
                other => &format!("{other}[0]"),
            };
            let printed = format!("{named} = {value}");
            assert!(stop.message.contains(&printed), "{function} {value}: {stop}");
            assert_eq!(stop.reason, reason, "{function} {value}: {stop}");
            assert!(solver.y()[0].is_finite() && solver.t() < 1.0, "{function}");
        }
    }
}

/// Each function returns values whose squares overflow. The call results in a value, a stop or an error, and all
/// results are finite.
#[test]
fn huge_numbers_end_by_themselves() {
    for (function, _) in FUNCTIONS {
        for value in [1e160, -1e160, f64::MAX, f64::MIN, f64::MIN_POSITIVE, -0.0] {
            let mut solver = solver(&Plan::new(function, Fault::Write(value)));
            match solver.integrate_to(1.0) {
                Ok(outcome) => assert!(outcome.t().is_finite(), "{function} {value:e}"),
                Err(error) => assert!(!error.to_string().is_empty()),
            }
            assert!(solver.t().is_finite(), "{function} {value:e}");
        }
    }
}

#[test]
fn huge_and_tiny_scales_are_solved_or_refused() {
    for scale in [1e-300, 1e-150, 1e150, 1e300] {
        let mut solver = IdaSolver::builder(Decay::new())
            .tolerances(Tolerances::scalar(1e-4, 1e-8 * scale))
            .build(0.0, &[scale], &[-scale])
            .unwrap();
        match solver.integrate_to(1.0).unwrap() {
            Outcome::Reached { .. } => {
                // The tolerance is 1e-4 per step, for about thirty steps.
                let error = solver.y()[0] / scale - (-1.0_f64).exp();
                assert!(error.abs() < 3e-3, "{scale:e}: {error:e}");
            }
            Outcome::Stopped(stop) => assert!(!stop.message.is_empty(), "{scale:e}"),
            other => panic!("{scale:e}: {other:?}"),
        }
    }
}

#[test]
fn a_solver_continues_or_explains_after_each_kind_of_end() {
    let options = IdaOptions { stop_time: Some(0.5), ..IdaOptions::default() };
    let mut solver =
        IdaSolver::builder(Decay::new()).options(options).build(0.0, &[1.0], &[-1.0]).unwrap();
    // The stop time applies once. A later stop time may be set, but an earlier one may not.
    assert_eq!(solver.integrate_to(2.0).unwrap(), Outcome::StopTime { t: 0.5 });
    let error = solver.set_stop_time(0.1).unwrap_err();
    assert!(matches!(error, Error::Common(TimeBehind { .. })), "{error}");
    assert!(solver.set_stop_time(f64::NAN).is_err());
    solver.set_stop_time(0.75).unwrap();
    assert_eq!(solver.integrate_to(2.0).unwrap(), Outcome::StopTime { t: 0.75 });
    assert_eq!(solver.integrate_to(1.0).unwrap(), Outcome::Reached { t: 1.0 });
    // A restart after a stop has the same results as a new solver.
    solver.problem_mut().residual = Box::new(|_, _| Err(StepError::Recoverable("no".into())));
    assert!(matches!(solver.integrate_to(9.0).unwrap(), Outcome::Stopped(_)));
    solver.problem_mut().residual = Box::new(|_, y| Ok(y));
    solver.reinit(0.0, &[1.0], &[-1.0], &[]).unwrap();
    let mut fresh = Decay::new().solver();
    assert_eq!(solver.statistics().steps, 0);
    solver.integrate_to(1.0).unwrap();
    fresh.integrate_to(1.0).unwrap();
    assert_eq!(solver.y(), fresh.y());
    assert_eq!(solver.statistics(), fresh.statistics());
    // The problem can be taken from the solver and used for another solver.
    let mut second = solver.into_problem().solver();
    assert_eq!(second.integrate_to(1.0).unwrap(), Outcome::Reached { t: 1.0 });
    assert_eq!(second.y(), fresh.y());
}
