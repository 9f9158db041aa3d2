//! Arguments that make no sense, limits that are reached, solvers by the thousand.

use sundials_wrap::samples::{Heat2d, Robertson, Sample};
use sundials_wrap::{
    Constraint, DaeProblem, Error, IdaOptions, IdaSolver, Outcome, StopReason, Suppressed,
    Tolerances,
};

use crate::decay::{Decay, stop};

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
