//! Roots of functions of the solution, compared with exact times.

use myovib_dae::IntegratorError::TimeBehind;
use std::f64::consts::PI;

use myovib_conformance::samples::{MechanicalForm, Pendulum, Sample};
use myovib_dae::{Direction, Outcome, StepError, StopReason};
use myovib_radau::{RadauError, RadauOptions, RadauSolver, StepSize};

use crate::common::{Oscillator, tolerance};

type Values<'a> = &'a mut [f64];

/// Returns a solver with root functions that starts from the initial values of `sample`.
fn watched<S: Sample>(
    sample: S,
    options: RadauOptions,
    directions: &[Direction],
    functions: impl FnMut(&mut S, f64, &[f64], &[f64], Values<'_>) -> Result<(), StepError>
    + Send
    + 'static,
) -> RadauSolver<S> {
    let start = sample.start();
    RadauSolver::builder(sample)
        .options(options)
        .roots(directions, functions)
        .build(start.t, &start.y, &start.y_dot)
        .unwrap()
}

#[track_caller]
fn root(outcome: Outcome) -> (f64, Vec<i32>) {
    match outcome {
        Outcome::Root { t, crossings } => (t, crossings),
        other => panic!("no root: {other:?}"),
    }
}

/// This test is the same as for the IDAS wrapper. At the start, x is zero, which does not count as a crossing.
#[test]
fn roots_are_found_in_the_requested_direction() {
    for stages in [3, 5, 7] {
        let options = RadauOptions { stages, step_size: StepSize::Fixed(0.45), ..tolerance(1e-9) };
        let directions = [Direction::Falling, Direction::Rising, Direction::Both];
        let mut solver = watched(Oscillator, options, &directions, |_, _, y, _, g| {
            g.fill(y[0]);
            Ok(())
        });
        for k in 1..4 {
            let (t, crossings) = root(solver.integrate_to(10.0).unwrap());
            let error = (t - f64::from(k) * PI).abs();
            println!("{stages} stages: {error:.1e}");
            // The bound is the error of the polynomial of degree s + 1 within a step, h^(s+2)/(s+2)!.
            let allowed = [2e-4, 1e-6, 2e-9][stages / 2 - 1];
            assert!(error < allowed, "{stages}: {t}");
            assert_eq!(crossings, if k % 2 == 1 { [-1, 0, -1] } else { [0, 1, 1] });
            assert_eq!((solver.t(), solver.statistics().t_reached), (t, t));
            // At the root, the function is zero up to the rounding of t.
            assert!(solver.y()[0].abs() < 1e-11, "{:?}", solver.y());
        }
        let end = solver.integrate_to(10.0).unwrap();
        assert_eq!(end, Outcome::Reached { t: 10.0 });
    }
}

#[test]
fn the_pendulum_passes_below_its_pivot_in_time() {
    // The exact times are a quarter of the period, K(1/√2)/√g, and three quarters.
    let quarter = 1.854_074_677_301_372 / 9.81_f64.sqrt();
    for stages in [3, 5, 7] {
        let options = RadauOptions { stages, ..tolerance(1e-10) };
        let pendulum = Pendulum::new(MechanicalForm::Index3);
        let both = [Direction::Both];
        let mut solver = watched(pendulum, options, &both, |_, _, y, _, g| {
            g[0] = y[0];
            Ok(())
        });
        for (exact, crossing) in [(quarter, -1), (3.0 * quarter, 1)] {
            let (t, crossings) = root(solver.integrate_to(2.5).unwrap());
            assert_eq!(crossings, [crossing]);
            println!("{stages} stages: {:.1e}", t - exact);
            // The bound is ten tolerances, divided by the velocity of x at the crossing, 4 m/s.
            assert!((t - exact).abs() < 1e-9, "{stages}: {t}, {exact}");
        }
    }
}

/// x crosses 0.9 twice within 0.9 s, and another function crosses zero between these crossings, all within one step.
#[test]
fn several_events_of_one_step_come_in_their_order() {
    let options = RadauOptions { stages: 7, step_size: StepSize::Fixed(2.5), ..tolerance(1e-9) };
    let both = [Direction::Both; 2];
    let mut solver = watched(Oscillator, options, &both, |_, t, y, _, g| {
        (g[0], g[1]) = (1.5 - t, y[0] - 0.9);
        Ok(())
    });
    let rise = 0.9_f64.asin();
    for (exact, expected) in [(rise, [0, 1]), (1.5, [-1, 0]), (PI - rise, [0, -1])] {
        let (t, crossings) = root(solver.step(10.0).unwrap());
        // The bound is the error of the polynomial of degree 7 over 2.5 s.
        assert!((t - exact).abs() < 1e-3, "{t} {exact}");
        assert_eq!((crossings, solver.statistics().steps), (expected.to_vec(), 1));
    }
    assert_eq!(solver.step(10.0).unwrap(), Outcome::StepTaken { t: 2.5 }, "the rest of the step");
    assert_eq!(solver.statistics().steps, 1);
}

#[test]
fn events_at_the_same_time_come_together() {
    let options = RadauOptions { step_size: StepSize::Fixed(0.5), ..tolerance(1e-9) };
    let both = [Direction::Both; 3];
    let mut solver = watched(Oscillator, options, &both, |_, t, _, _, g| {
        g.copy_from_slice(&[t - 0.3, 0.6 - 2.0 * t, t - 0.4]);
        Ok(())
    });
    let (t, crossings) = root(solver.integrate_to(1.0).unwrap());
    assert!((t - 0.3).abs() < 1e-13);
    assert_eq!(crossings, [1, -1, 0]);
    let (t, crossings) = root(solver.integrate_to(1.0).unwrap());
    assert!((t - 0.4).abs() < 1e-13);
    assert_eq!(crossings, [0, 0, 1]);
}

#[test]
fn a_time_within_an_interrupted_step_can_be_reached() {
    let options = RadauOptions { step_size: StepSize::Fixed(1.0), ..tolerance(1e-9) };
    let falling = [Direction::Falling];
    let mut solver = watched(Oscillator, options, &falling, |_, t, _, _, g| {
        g[0] = 0.25 - t;
        Ok(())
    });
    root(solver.step(5.0).unwrap());
    let reached = solver.integrate_to(0.5).unwrap();
    assert_eq!((reached, solver.t()), (Outcome::Reached { t: 0.5 }, 0.5));
    let mut out = [0.0; 2];
    solver.dense_output(0.5, 0, &mut out).unwrap();
    assert_eq!(solver.y(), out);
    assert!(matches!(solver.step(0.4), Err(RadauError::Common(TimeBehind { t_out: 0.4, t: 0.5 }))));
    solver.set_stop_time(0.75).unwrap();
    let stopped = Outcome::StopTime { t: 0.75 };
    assert_eq!(solver.step(5.0).unwrap(), stopped);
    assert_eq!(solver.statistics().steps, 1);
    solver.set_stop_time(5.0).unwrap();
    let end = solver.integrate_to(1.0).unwrap();
    assert_eq!((end, solver.statistics().steps), (Outcome::Reached { t: 1.0 }, 1));
}

#[test]
fn events_do_not_change_the_steps_if_dense_output_does_not() {
    let start = Oscillator.start();
    let options = || RadauOptions { dense_output: false, ..tolerance(1e-6) };
    let mut plain = RadauSolver::builder(Oscillator)
        .options(options())
        .build(start.t, &start.y, &start.y_dot)
        .unwrap();
    let both = [Direction::Both];
    let mut solver = watched(Oscillator, options(), &both, |_, _, y, _, g| {
        g[0] = y[0];
        Ok(())
    });
    plain.integrate_to(10.0).unwrap();
    let mut roots = 0;
    while let Outcome::Root { .. } = solver.integrate_to(10.0).unwrap() {
        roots += 1;
    }
    let (plain_stats, mut stats) = (plain.statistics(), solver.statistics());
    assert!(stats.root_evaluations > 3 * stats.steps);
    stats.root_evaluations = 0;
    assert_eq!((roots, stats), (3, plain_stats));
    assert_eq!(solver.y(), plain.y());
}

#[test]
fn failing_root_functions_stop_or_return_the_error() {
    let failing = |failure: fn() -> Result<f64, StepError>| {
        let options = tolerance(1e-6);
        let both = [Direction::Both];
        watched(Oscillator, options, &both, move |_, t, _, _, g| {
            g[0] = if t > 0.5 { failure()? } else { 1.0 };
            Ok(())
        })
    };
    for (failure, printed) in [
        (
            (|| Err(StepError::Recoverable("no pressure".into())))
                as fn() -> Result<f64, StepError>,
            "no pressure",
        ),
        (|| Ok(f64::NAN), "root function[0] = NaN at t = "),
    ] {
        let Outcome::Stopped(stop) = failing(failure).integrate_to(1.0).unwrap() else {
            panic!("not stopped");
        };
        assert_eq!(stop.reason, StopReason::RootFunctionFailed);
        assert!(stop.message.starts_with(printed), "{}", stop.message);
    }
    let fatal = || Err(StepError::Fatal("the probe fell off".into()));
    match failing(fatal).integrate_to(1.0) {
        Err(RadauError::Fatal { function, source, .. }) => {
            let printed = source.to_string();
            assert_eq!((function, printed.as_str()), ("root function", "the probe fell off"));
        }
        other => panic!("{other:?}"),
    }
}
