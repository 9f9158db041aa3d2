//! User functions that fail, panic, or write invalid values, and matrices that cannot be factorized.

use std::panic::{AssertUnwindSafe, catch_unwind};

use myovib_dae::{
    IntegratorError, Outcome, Problem, StepError, StopReason, Suppressed, VariableKind,
};
use nalgebra_sparse::pattern::SparsityPattern;

use sundials_wrap::{ConsistencyMode, Error, IdaOptions, IdaSolver};

use crate::decay::{Decay, stop};

#[test]
fn a_recoverable_error_shortens_the_step_and_the_integration_goes_on() {
    let mut failures = 0;
    let problem = Decay::residual(move |t, y| {
        if t > 0.5 && failures < 3 {
            failures += 1;
            return Err(StepError::Recoverable("not yet".into()));
        }
        Ok(y)
    });
    let mut solver = problem.solver();
    assert_eq!(solver.integrate_to(1.0).unwrap(), Outcome::Reached { t: 1.0 });
    assert_eq!(solver.statistics().step_solve_failures, 3);
    // The default tolerance is 1e-4 per step, for about thirty steps, and the solution has the size 1/e.
    assert!((solver.y()[0] - (-1.0_f64).exp()).abs() < 1e-2, "{}", solver.y()[0]);
}

#[test]
fn a_recoverable_error_that_persists_and_a_nan_stop_with_the_reason() {
    let broken = |message: &'static str| {
        let mut broken = false;
        move |t: f64, y: f64| {
            broken |= t > 0.5;
            match message {
                _ if !broken => Ok(y),
                "NaN" => Ok(f64::NAN),
                _ => Err(StepError::Recoverable(message.into())),
            }
        }
    };
    for message in ["the spring broke", "NaN"] {
        let mut solver = Decay::residual(broken(message)).solver();
        let stop = stop(solver.integrate_to(1.0));
        assert_eq!(stop.reason, StopReason::ResidualFailed, "{stop}");
        assert!(stop.message.contains(message), "{stop}");
        assert!(stop.t <= 0.5 && stop.t > 0.4, "{stop}");
        assert!(stop.statistics.last_step > 0.0 && stop.statistics.last_order >= 1, "{stop}");
        assert_eq!(stop.worst_components[0].name, "amount");
    }
}

/// Two algebraic variables that jump at t = 1/2; the second jump is a million times as large.
struct Jumps;

impl Problem for Jumps {
    fn n_unknowns(&self) -> usize {
        2
    }

    fn residual(&mut self, t: f64, y: &[f64], _: &[f64], out: &mut [f64]) -> Result<(), StepError> {
        let jump = if t > 0.5 { 1.0 } else { 0.0 };
        out[0] = y[0] - jump;
        out[1] = y[1] - 1e6 * jump;
        Ok(())
    }

    fn jacobian_pattern(&self) -> SparsityPattern {
        SparsityPattern::try_from_offsets_and_indices(2, 2, vec![0, 1, 2], vec![0, 1]).unwrap()
    }

    fn jacobian(
        &mut self,
        _: f64,
        _: &[f64],
        _: &[f64],
        a: f64,
        _: f64,
        values: &mut [f64],
    ) -> Result<(), StepError> {
        values.fill(a);
        Ok(())
    }

    fn kinds(&self) -> Option<Vec<VariableKind>> {
        Some(vec![VariableKind::Algebraic; 2])
    }

    fn indices(&self) -> Option<Vec<u8>> {
        Some(vec![1; 2])
    }
}

/// At a jump, the error test fails for every step size. Only components included in the test are reported as the cause.
#[test]
fn a_failed_error_test_names_no_excluded_component() {
    let worst = |excluded: bool| {
        let options = IdaOptions {
            suppressed: Suppressed::Components(vec![false, excluded]),
            ..IdaOptions::default()
        };
        let builder = IdaSolver::builder(Jumps).options(options);
        let mut solver = builder.build(0.0, &[0.0; 2], &[0.0; 2]).unwrap();
        let stop = stop(solver.integrate_to(1.0));
        assert_eq!(stop.reason, StopReason::ErrorTestFailures, "{stop}");
        stop.worst_components[0].clone()
    };
    for (excluded, index) in [(false, 1), (true, 0)] {
        let worst = worst(excluded);
        assert_eq!(worst.index, index);
        assert!(worst.weighted_error > 1.0, "{worst:?}");
    }
}

/// If the residual cannot be evaluated after some time, the step size decreases until the maximum number of steps is
/// reached.
#[test]
fn a_wall_that_no_step_can_cross_is_reached_and_reported() {
    let problem =
        Decay::residual(
            |t, y| {
                if t > 0.5 { Err(StepError::Recoverable("wall".into())) } else { Ok(y) }
            },
        );
    let stop = stop(problem.solver().integrate_to(1.0));
    assert_eq!(stop.reason, StopReason::MaxSteps, "{stop}");
    assert!(stop.t > 0.5 - 1e-9 && stop.message.contains("wall"), "{stop}");
}

#[test]
fn nan_in_the_jacobian_is_recoverable() {
    let mut calls = 0;
    let problem = Decay::jacobian(move |_| {
        calls += 1;
        Ok(if calls == 3 { f64::NAN } else { 1.0 })
    });
    let mut solver = problem.solver();
    assert_eq!(solver.integrate_to(1.0).unwrap(), Outcome::Reached { t: 1.0 });
    assert_eq!(solver.statistics().step_solve_failures, 1);
}

#[test]
fn a_fatal_error_comes_back_as_it_was() {
    let fail = || StepError::Fatal(Box::new(std::io::Error::other("disk on fire")));
    let residual = Decay::residual(move |t, y| if t > 0.5 { Err(fail()) } else { Ok(y) });
    let jacobian = Decay::jacobian(move |_| Err(fail()));
    for (problem, name) in [(residual, "residual"), (jacobian, "Jacobian")] {
        let error = problem.solver().integrate_to(1.0).unwrap_err();
        let Error::Callback { function, source, .. } = &error else { panic!("{error}") };
        assert_eq!(*function, name);
        assert!(source.downcast_ref::<std::io::Error>().is_some(), "{error}");
    }
}

#[test]
fn a_panic_goes_through_idas_and_the_solver_can_still_be_dropped_or_restarted() {
    let mut calls = 0;
    let problem = Decay::residual(move |_, y| {
        calls += 1;
        assert!(calls != 10, "tenth call");
        Ok(y)
    });
    let mut solver = problem.solver();
    let panic = catch_unwind(AssertUnwindSafe(|| solver.integrate_to(1.0))).unwrap_err();
    let text = panic.downcast_ref::<&str>().copied().unwrap_or_default();
    assert!(text.contains("tenth call"), "{text}");
    solver.reinit(0.0, &[1.0], &[-1.0], &[]).unwrap();
    assert_eq!(solver.integrate_to(1.0).unwrap(), Outcome::Reached { t: 1.0 });
}

#[test]
fn singular_jacobians_stop_the_integration() {
    struct Flat(Vec<usize>);
    impl Problem for Flat {
        fn n_unknowns(&self) -> usize {
            2
        }
        fn residual(
            &mut self,
            _: f64,
            _: &[f64],
            d: &[f64],
            r: &mut [f64],
        ) -> Result<(), StepError> {
            (r[0], r[1]) = (d[0], 0.0);
            Ok(())
        }
        fn jacobian_pattern(&self) -> SparsityPattern {
            let offsets = vec![0, 1, self.0.len()];
            SparsityPattern::try_from_offsets_and_indices(2, 2, offsets, self.0.clone()).unwrap()
        }
        fn jacobian(
            &mut self,
            _: f64,
            _: &[f64],
            _: &[f64],
            _: f64,
            b: f64,
            values: &mut [f64],
        ) -> Result<(), StepError> {
            values[0] = b;
            Ok(())
        }
        fn kinds(&self) -> Option<Vec<VariableKind>> {
            Some(vec![VariableKind::Differential, VariableKind::Algebraic])
        }
        fn indices(&self) -> Option<Vec<u8>> {
            Some(vec![0, 1])
        }
    }
    // The first two matrices are structurally singular: row 1 and column 1 are empty. The third matrix is numerically
    // singular: entry (1, 1) is in the pattern but zero.
    for rows in [vec![0], vec![0, 0], vec![0, 1]] {
        let mut solver =
            IdaSolver::builder(Flat(rows.clone())).build(0.0, &[1.0, 1.0], &[1.0, 0.0]).unwrap();
        let stop = stop(solver.integrate_to(1.0));
        assert_eq!(stop.reason, StopReason::LinearSetupFailed, "{rows:?}: {stop}");
    }
}

#[test]
fn weights_must_be_positive() {
    for weight in [-1.0, 0.0] {
        let builder = IdaSolver::builder(Decay::new()).error_weights(move |_, _, w| {
            w[0] = weight;
            Ok(())
        });
        let mut solver = builder.build(0.0, &[1.0], &[-1.0]).unwrap();
        let stop = stop(solver.integrate_to(1.0));
        assert_eq!(stop.reason, StopReason::ErrorWeightsFailed, "{stop}");
        let printed = format!("error weight[0] = {weight} must be positive");
        assert!(stop.message.contains(&printed), "{stop}");
    }
}

#[test]
fn uncorrectable_initial_values_are_an_error() {
    // F = ẏ + NaN has no consistent ẏ.
    let mut solver = Decay::residual(|_, _| Ok(f64::NAN)).solver();
    let mode = ConsistencyMode::AlgebraicAndDerivatives;
    let error = solver.correct_initial_values(mode, 1.0).unwrap_err();
    assert!(matches!(error, Error::Common(IntegratorError::Inconsistent { .. })), "{error}");
}
