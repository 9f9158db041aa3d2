//! Errors, panics and nonsense at the boundary.

use std::panic::{AssertUnwindSafe, catch_unwind};

use nalgebra_sparse::pattern::SparsityPattern;
use sundials_wrap::samples::{Heat2d, Robertson, Sample};
use sundials_wrap::{
    ConsistencyMode, Constraint, DaeProblem, Error, IdaOptions, IdaSolver, Outcome, StepError,
    StopReason, Suppressed, Tolerances, VariableKind,
};

/// ẏ = −y with a residual and a Jacobian that can be made to fail.
struct Decay {
    pattern: SparsityPattern,
    residual: Box<dyn FnMut(f64, f64) -> Result<f64, StepError> + Send>,
    jacobian: Box<dyn FnMut(f64) -> Result<f64, StepError> + Send>,
}

impl Decay {
    fn new() -> Self {
        Self {
            pattern: SparsityPattern::try_from_offsets_and_indices(1, 1, vec![0, 1], vec![0])
                .unwrap(),
            residual: Box::new(|_, y| Ok(y)),
            jacobian: Box::new(|_| Ok(1.0)),
        }
    }

    fn residual(f: impl FnMut(f64, f64) -> Result<f64, StepError> + Send + 'static) -> Self {
        Self {
            residual: Box::new(f),
            ..Self::new()
        }
    }

    fn jacobian(f: impl FnMut(f64) -> Result<f64, StepError> + Send + 'static) -> Self {
        Self {
            jacobian: Box::new(f),
            ..Self::new()
        }
    }

    fn solver(self) -> IdaSolver<Self> {
        IdaSolver::builder(self)
            .build(0.0, &[1.0], &[-1.0])
            .unwrap()
    }
}

impl DaeProblem for Decay {
    fn n_unknowns(&self) -> usize {
        1
    }
    fn residual(
        &mut self,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
        r: &mut [f64],
    ) -> Result<(), StepError> {
        r[0] = y_dot[0] + (self.residual)(t, y[0])?;
        Ok(())
    }
    fn jacobian_pattern(&self) -> SparsityPattern {
        self.pattern.clone()
    }
    fn jacobian(
        &mut self,
        t: f64,
        _y: &[f64],
        _y_dot: &[f64],
        a: f64,
        b: f64,
        values: &mut [f64],
    ) -> Result<(), StepError> {
        let slope = (self.jacobian)(t)?;
        values.fill(a * slope + b);
        Ok(())
    }
    fn kinds(&self) -> Vec<VariableKind> {
        vec![VariableKind::Differential]
    }
    fn indices(&self) -> Vec<u8> {
        vec![0]
    }
    fn component_name(&self, _: usize) -> String {
        "amount".to_owned()
    }
}

fn stop(outcome: Result<Outcome, Error>) -> sundials_wrap::Stop {
    match outcome.unwrap() {
        Outcome::Stopped(stop) => *stop,
        other => panic!("did not stop: {other:?}"),
    }
}

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
    assert_eq!(
        solver.integrate_to(1.0).unwrap(),
        Outcome::Reached { t: 1.0 }
    );
    assert_eq!(solver.stats().step_solve_failures, 3);
    // Default tolerance 1e-4 per step, some thirty steps, of a solution of size 1/e.
    assert!(
        (solver.y()[0] - (-1.0_f64).exp()).abs() < 1e-2,
        "{}",
        solver.y()[0]
    );
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
        assert!(stop.last_step > 0.0 && stop.last_order >= 1, "{stop}");
        assert_eq!(stop.worst_components[0].name, "amount");
    }
}

/// Up to a wall in time the steps shrink for ever; the limit on steps ends that.
#[test]
fn a_wall_that_no_step_can_cross_is_reached_and_reported() {
    let problem = Decay::residual(|t, y| {
        if t > 0.5 {
            Err(StepError::Recoverable("wall".into()))
        } else {
            Ok(y)
        }
    });
    let stop = stop(problem.solver().integrate_to(1.0));
    assert_eq!(stop.reason, StopReason::MaxSteps, "{stop}");
    assert!(
        stop.t > 0.5 - 1e-9 && stop.message.contains("wall"),
        "{stop}"
    );
}

#[test]
fn nan_in_the_jacobian_is_recoverable() {
    let mut calls = 0;
    let problem = Decay::jacobian(move |_| {
        calls += 1;
        Ok(if calls == 3 { f64::NAN } else { 1.0 })
    });
    let mut solver = problem.solver();
    assert_eq!(
        solver.integrate_to(1.0).unwrap(),
        Outcome::Reached { t: 1.0 }
    );
    assert_eq!(solver.stats().step_solve_failures, 1);
}

#[test]
fn a_fatal_error_comes_back_as_it_was() {
    let fail = || StepError::Fatal(Box::new(std::io::Error::other("disk on fire")));
    let residual = Decay::residual(move |t, y| if t > 0.5 { Err(fail()) } else { Ok(y) });
    let jacobian = Decay::jacobian(move |_| Err(fail()));
    for (problem, name) in [(residual, "residual"), (jacobian, "Jacobian")] {
        let error = problem.solver().integrate_to(1.0).unwrap_err();
        let Error::Callback {
            function, source, ..
        } = &error
        else {
            panic!("{error}")
        };
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
    assert_eq!(
        solver.integrate_to(1.0).unwrap(),
        Outcome::Reached { t: 1.0 }
    );
}

#[test]
fn singular_jacobians_stop_the_integration() {
    // Numerically: the Newton matrix vanishes.
    let mut solver = Decay::new().solver();
    solver.problem_mut().jacobian = Box::new(|_| Ok(0.0));
    solver.integrate_to(0.1).unwrap();
    struct Flat(Vec<usize>);
    impl DaeProblem for Flat {
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
        fn kinds(&self) -> Vec<VariableKind> {
            vec![VariableKind::Differential, VariableKind::Algebraic]
        }
        fn indices(&self) -> Vec<u8> {
            vec![0, 1]
        }
    }
    // Row 1 empty (and column 1): structurally. Entry (1, 1) present, but zero: numerically.
    for rows in [vec![0], vec![0, 0], vec![0, 1]] {
        let mut solver = IdaSolver::builder(Flat(rows.clone()))
            .build(0.0, &[1.0, 1.0], &[1.0, 0.0])
            .unwrap();
        let stop = stop(solver.integrate_to(1.0));
        assert_eq!(
            stop.reason,
            StopReason::LinearSetupFailed,
            "{rows:?}: {stop}"
        );
    }
}

#[test]
fn wrong_lengths_and_values_are_refused_with_numbers() {
    let build = |y: &[f64], y_dot: &[f64]| {
        IdaSolver::builder(Robertson)
            .build(0.0, y, y_dot)
            .unwrap_err()
            .to_string()
    };
    assert_eq!(
        build(&[1.0], &[0.0; 3]),
        "initial values y0: expected length 3, got 1"
    );
    assert_eq!(
        build(&[1.0; 3], &[]),
        "initial derivatives y_dot0: expected length 3, got 0"
    );
    assert_eq!(
        build(&[1.0, f64::NAN, 0.0], &[0.0; 3]),
        "y0[1] = NaN is not finite"
    );

    let with = |options: IdaOptions| {
        let start = Robertson.start();
        let builder = IdaSolver::builder(Robertson).options(options);
        builder
            .build(0.0, &start.y, &start.y_dot)
            .unwrap_err()
            .to_string()
    };
    let base = IdaOptions::default;
    let scalar = |r, a| {
        with(IdaOptions {
            tolerances: Tolerances::scalar(r, a),
            ..base()
        })
    };
    assert_eq!(
        scalar(-1e-3, 1.0),
        "relative tolerance = -0.001: must be finite and ≥ 0"
    );
    assert_eq!(
        scalar(f64::NAN, 1.0),
        "relative tolerance = NaN: must be finite and ≥ 0"
    );
    assert!(scalar(0.0, 0.0).contains("not both zero"));
    let absolute = Tolerances::vector(1e-3, [1e-3, 1e-3]);
    let error = with(IdaOptions {
        tolerances: absolute,
        ..base()
    });
    assert_eq!(error, "absolute tolerances: expected length 3, got 2");
    for (options, word) in [
        (
            IdaOptions {
                max_order: 6,
                ..base()
            },
            "max_order = 6",
        ),
        (
            IdaOptions {
                max_order: 0,
                ..base()
            },
            "max_order = 0",
        ),
        (
            IdaOptions {
                max_step: Some(0.0),
                ..base()
            },
            "max_step = 0",
        ),
        (
            IdaOptions {
                min_step: 1.0,
                max_step: Some(0.5),
                ..base()
            },
            "at least min_step",
        ),
        (
            IdaOptions {
                delta_cj: 1.0,
                ..base()
            },
            "delta_cj = 1",
        ),
        (
            IdaOptions {
                max_newton_iterations: 0,
                ..base()
            },
            "max_newton_iterations = 0",
        ),
        (
            IdaOptions {
                constraints: vec![Constraint::None],
                ..base()
            },
            "constraints",
        ),
        (
            IdaOptions {
                suppressed: Suppressed::Components(vec![true]),
                ..base()
            },
            "suppressed components",
        ),
    ] {
        let error = with(options);
        assert!(error.contains(word), "{error}");
    }
    let zero_weight = with(IdaOptions {
        tolerances: Tolerances::vector(0.0, [1.0, 0.0, 1.0]),
        ..base()
    });
    assert!(zero_weight.contains("> 0"), "{zero_weight}");
    let violated = IdaOptions {
        constraints: vec![Constraint::Negative; 3],
        ..base()
    };
    let start = Robertson.start();
    let builder = IdaSolver::builder(Robertson).options(violated);
    let mut solver = builder.build(0.0, &start.y, &start.y_dot).unwrap();
    let error = solver.integrate_to(1.0).unwrap_err();
    assert!(
        matches!(
            error,
            Error::Call {
                call: "IDASolve",
                code: -22,
                ..
            }
        ),
        "{error}"
    );
}

#[test]
fn an_output_time_behind_t_is_misuse() {
    let mut solver = Decay::new().solver();
    solver.integrate_to(0.5).unwrap();
    let error = solver.integrate_to(0.4).unwrap_err();
    assert!(
        matches!(error, Error::TimeBehind { t_out: 0.4, t: 0.5 }),
        "{error}"
    );
    assert!(solver.step(f64::NAN).is_err());
    assert_eq!(
        solver.integrate_to(0.6).unwrap(),
        Outcome::Reached { t: 0.6 }
    );
    let mut out = [0.0];
    let error = solver.dense_output(-1.0, 0, &mut out).unwrap_err();
    assert!(
        matches!(error, Error::NoDenseOutput { derivative: 0, .. }),
        "{error}"
    );
    let error = solver.dense_output(0.6, 9, &mut out).unwrap_err();
    assert!(
        matches!(error, Error::NoDenseOutput { derivative: 9, .. }),
        "{error}"
    );
    assert!(matches!(
        solver.quadrature(&mut out),
        Err(Error::NoQuadrature)
    ));
    assert!(matches!(
        solver.dense_output(0.6, 0, &mut []),
        Err(Error::WrongLength { .. })
    ));
}

#[test]
fn integrates_backwards_too() {
    let mut solver = IdaSolver::builder(Decay::new())
        .build(1.0, &[1.0], &[-1.0])
        .unwrap();
    assert_eq!(
        solver.integrate_to(0.0).unwrap(),
        Outcome::Reached { t: 0.0 }
    );
    // Default tolerance 1e-4 per step, some thirty steps, growth by e.
    assert!(
        (solver.y()[0] - 1.0_f64.exp()).abs() < 1e-2,
        "{}",
        solver.y()[0]
    );
    assert!(matches!(
        solver.integrate_to(0.5),
        Err(Error::TimeBehind { .. })
    ));
}

#[test]
fn too_many_steps_is_an_outcome_and_the_next_call_goes_on() {
    let options = IdaOptions {
        max_steps: Some(5),
        ..IdaOptions::default()
    };
    let mut solver = IdaSolver::builder(Decay::new())
        .options(options)
        .build(0.0, &[1.0], &[-1.0])
        .unwrap();
    let first = stop(solver.integrate_to(1.0));
    assert_eq!((first.reason, first.stats.steps), (StopReason::MaxSteps, 5));
    while matches!(solver.integrate_to(1.0).unwrap(), Outcome::Stopped(_)) {}
    assert_eq!(solver.t(), 1.0);
}

/// ẏ = −1 from y = 1 with y ≥ 0: the steps shrink at the wall at t = 1.
#[test]
fn a_constraint_holds_the_integration_up() {
    let mut problem = Decay::residual(|_, _| Ok(1.0));
    problem.jacobian = Box::new(|_| Ok(0.0));
    let constraints = vec![Constraint::NonNegative];
    let options = IdaOptions {
        constraints,
        ..IdaOptions::default()
    };
    let mut solver = IdaSolver::builder(problem)
        .options(options)
        .build(0.0, &[1.0], &[-1.0])
        .unwrap();
    let stop = stop(solver.integrate_to(2.0));
    // IDAS lets each step pass the wall by up to Newton's share of the tolerance: it creeps on.
    let creep = 500.0 * 0.33 * 1e-8;
    assert!(
        (stop.t - 1.0).abs() < creep && solver.y()[0] > -creep,
        "{stop}"
    );
    assert_eq!(stop.reason, StopReason::MaxSteps, "{stop}");
}

#[test]
fn too_tight_a_tolerance_is_named() {
    let tight = Tolerances::scalar(0.0, 1e-20);
    let mut solver = IdaSolver::builder(Decay::new())
        .tolerances(tight)
        .build(0.0, &[1.0], &[-1.0])
        .unwrap();
    let stop = stop(solver.integrate_to(1.0));
    assert_eq!(stop.reason, StopReason::ToleranceTooTight, "{stop}");
    assert!(stop.stats.tolerance_scale_factor > 1.0, "{stop}");
}

#[test]
fn weights_must_be_positive() {
    let builder = IdaSolver::builder(Decay::new()).error_weights(|_, _, w| {
        w[0] = -1.0;
        Ok(())
    });
    let stop = stop(
        builder
            .build(0.0, &[1.0], &[-1.0])
            .unwrap()
            .integrate_to(1.0),
    );
    assert_eq!(stop.reason, StopReason::ErrorWeightsFailed, "{stop}");
    assert!(stop.message.contains("error weight[0] = -1"), "{stop}");
}

#[test]
fn inconsistent_values_that_cannot_be_mended_are_an_error() {
    // F = ẏ + NaN has no consistent ẏ.
    let mut solver = Decay::residual(|_, _| Ok(f64::NAN)).solver();
    let mode = ConsistencyMode::AlgebraicAndDerivatives;
    let error = solver.correct_initial_values(mode, 1.0).unwrap_err();
    let Error::InconsistentInitialValues { message, .. } = &error else {
        panic!("{error}")
    };
    assert!(message.contains("NaN"), "{error}");
}

#[test]
fn a_thousand_solvers_come_and_go() {
    for i in 0..1000 {
        let sample = Heat2d::new(4);
        let start = sample.start();
        let mut solver = IdaSolver::builder(sample)
            .build(0.0, &start.y, &start.y_dot)
            .unwrap();
        if i % 3 == 0 {
            solver.step(1.0).unwrap();
        }
        if i % 2 == 0 {
            assert_eq!(solver.into_problem().n_unknowns(), 16);
        }
    }
}

#[test]
fn solvers_run_in_many_threads_at_once_and_move_between_them() {
    fn assert_send<T: Send>() {}
    assert_send::<IdaSolver<Robertson>>();
    let run = || {
        let start = Robertson.start();
        let mut solver = IdaSolver::builder(Robertson)
            .build(0.0, &start.y, &start.y_dot)
            .unwrap();
        solver.integrate_to(4.0).unwrap();
        std::thread::spawn(move || {
            solver.integrate_to(40.0).unwrap();
            (solver.y().to_vec(), solver.stats())
        })
        .join()
        .unwrap()
    };
    let expected = run();
    let threads: Vec<_> = (0..64).map(|_| std::thread::spawn(run)).collect();
    for thread in threads {
        assert_eq!(
            thread.join().unwrap(),
            expected,
            "bit for bit, whatever runs beside it"
        );
    }
}
