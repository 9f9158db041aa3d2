//! Features of the integrator in addition to stepping: events, dense output, weights, constraints.

use myovib_conformance::samples::{
    Akzo, Constrained, Differentiated, LinearIndex1, MechanicalForm, Robertson, Sample, SliderCrank,
};
use myovib_dae::IntegratorError::NoDenseOutput;
use myovib_dae::{Direction, Outcome, Problem, StepError, Suppressed, Tolerances};
use myovib_sparse::{Scaling, SparseOptions};
use sundials_wrap::{IdaOptions, IdaSolver, VectorArithmetic, Versions};

use crate::common::{HAS_KLU, build, tolerance};

/// With three unknowns, the sums in norms are also computed in the same order as in SUNDIALS.
#[test]
fn vector_arithmetic_matches_that_of_sundials() {
    let run = |vectors| {
        let mut solver = build(Robertson, IdaOptions { vectors, ..tolerance(1e-7) });
        assert_eq!(solver.integrate_to(40.0).unwrap(), Outcome::Reached { t: 40.0 });
        (solver.y().to_vec(), solver.statistics().steps)
    };
    assert_eq!(run(VectorArithmetic::Simd), run(VectorArithmetic::Serial));
}

/// y2 = sin t crosses zero at multiples of π. It rises at even multiples.
#[test]
fn roots_are_found_in_the_requested_direction() {
    let start = LinearIndex1.start();
    let mut solver = IdaSolver::builder(LinearIndex1)
        .options(tolerance(1e-9))
        .roots([Direction::Falling, Direction::Rising], |_, _, y, _, g| {
            g.fill(y[1]);
            Ok(())
        })
        .build(start.t, &start.y, &start.y_dot)
        .unwrap();
    for k in 1..4 {
        let Outcome::Root { t, crossings } = solver.integrate_to(10.0).unwrap() else {
            panic!("no root near {k} π")
        };
        // y2 is accurate to the tolerance, and its slope at the roots is ±1.
        assert!((t - f64::from(k) * std::f64::consts::PI).abs() < 1e-8, "{t}");
        assert_eq!(crossings, if k % 2 == 1 { [-1, 0] } else { [0, 1] });
        assert_eq!(solver.t(), t);
    }
    assert_eq!(solver.integrate_to(10.0).unwrap(), Outcome::Reached { t: 10.0 });
}

/// A root function is zero at the start and changes by rounding just after the start. IDAS evaluates it there first,
/// and then at earlier times.
#[test]
fn rounding_of_a_root_function_after_a_zero_at_the_start_does_not_stop_the_integration() {
    let start = LinearIndex1.start();
    let mut evaluations = 0;
    let mut solver = IdaSolver::builder(LinearIndex1)
        .options(tolerance(1e-9))
        .roots([Direction::Both], move |_, t, _, _, g| {
            evaluations += 1;
            g[0] = if evaluations == 2 { -f64::EPSILON } else { (t - 1.0).max(0.0) };
            Ok(())
        })
        .build(start.t, &start.y, &start.y_dot)
        .unwrap();
    let mut outcome = solver.integrate_to(2.0).unwrap();
    if let Outcome::Root { t, .. } = outcome {
        // The return to zero is in the first step.
        assert_eq!(solver.statistics().steps, 1, "{t}");
        outcome = solver.integrate_to(2.0).unwrap();
    }
    assert_eq!(outcome, Outcome::Reached { t: 2.0 });
}

/// In one-step mode with a stop time, the steps end at the stop time. Dense output agrees with the exact solution and
/// its derivatives, and does not change the steps.
#[test]
fn dense_output_gives_the_solution_and_its_derivatives() {
    let tol = 1e-10;
    let options = IdaOptions { stop_time: Some(10.0), ..tolerance(tol) };
    let mut plain = build(LinearIndex1, options.clone());
    while !matches!(plain.step(10.0).unwrap(), Outcome::StopTime { .. }) {}

    let mut solver = build(LinearIndex1, options);
    let mut out = [0.0; 2];
    loop {
        let outcome = solver.step(10.0).unwrap();
        let stats = solver.statistics();
        if stats.last_order >= 4 {
            let t = solver.t() - 0.5 * stats.last_step;
            let exact = |k: i32| [t.sin(), t.cos(), -t.sin()][k as usize];
            // Each differentiation of the interpolating polynomial loses one power of h.
            for k in 0..3 {
                solver.dense_output(t, k as usize, &mut out).unwrap();
                let bound = 1e3 * tol / stats.last_step.powi(k);
                assert!((out[1] - exact(k)).abs() < bound, "t = {t}, k = {k}: {out:?}");
            }
        }
        if outcome == (Outcome::StopTime { t: 10.0 }) {
            break;
        }
        assert_eq!(outcome, Outcome::StepTaken { t: solver.t() });
    }
    assert_eq!(solver.statistics(), plain.statistics());
    assert_eq!(solver.y(), plain.y());
}

#[test]
fn a_weight_function_that_repeats_the_tolerances_changes_nothing() {
    let tol = 1e-6;
    let mut plain = build(Akzo, tolerance(tol));
    plain.integrate_to(180.0).unwrap();
    let start = Akzo.start();
    let mut weighted = IdaSolver::builder(Akzo)
        .options(tolerance(1.0))
        .error_weights(move |_, y, weights| {
            for (w, y) in weights.iter_mut().zip(y) {
                *w = 1.0 / (tol * y.abs() + tol);
            }
            Ok(())
        })
        .build(start.t, &start.y, &start.y_dot)
        .unwrap();
    weighted.integrate_to(180.0).unwrap();
    assert_eq!(weighted.statistics(), plain.statistics());
    assert_eq!(weighted.y(), plain.y());

    let (mut weights, mut errors) = ([0.0; 6], [0.0; 6]);
    weighted.error_weights(&mut weights).unwrap();
    weighted.estimated_local_errors(&mut errors).unwrap();
    let squares = errors.iter().zip(&weights).map(|(e, w)| (e * w).powi(2)).sum::<f64>();
    let norm = (squares / 6.0).sqrt();
    assert!(norm > 0.0 && norm <= 1.0, "an accepted step passed its error test: {norm}");
}

#[test]
fn settings_reach_idas() {
    let run = |options: IdaOptions| {
        let mut solver = build(Akzo, options);
        let mut highest = 0;
        while solver.t() < 180.0 {
            solver.step(180.0).unwrap();
            highest = highest.max(solver.statistics().last_order);
        }
        (highest, solver.statistics())
    };
    let (order, plain) = run(tolerance(1e-6));
    assert!(order > 2);
    let (order, low) = run(IdaOptions { max_order: 2, ..tolerance(1e-6) });
    assert!(order == 2 && low.steps > plain.steps);
    let (_, small) = run(IdaOptions { max_step: Some(0.5), ..tolerance(1e-6) });
    assert!(small.steps >= 360 && small.last_step <= 0.5);
    let (_, first) = run(IdaOptions { initial_step: Some(1e-7), ..tolerance(1e-6) });
    assert_eq!(first.initial_step, 1e-7);
    let (_, eager) = run(IdaOptions { delta_cj: 0.01, ..tolerance(1e-6) });
    assert!(eager.linear_setups > plain.linear_setups);
    let (_, strict) = run(IdaOptions { nonlinear_coefficient: 1e-3, ..tolerance(1e-6) });
    assert!(strict.newton_iterations > plain.newton_iterations);
    let sparse = SparseOptions { scaling: Scaling::None, ..SparseOptions::default() };
    let (_, unscaled_rows) = run(IdaOptions { sparse, ..tolerance(1e-6) });
    assert!((unscaled_rows.steps as f64 / plain.steps as f64 - 1.0).abs() < 0.05);
    assert_eq!(
        unscaled_rows.smallest_rcond != plain.smallest_rcond,
        HAS_KLU,
        "unscaled pivots, another estimate"
    );
    let suppressed = Suppressed::Components(vec![true, false, false, false, false, true]);
    let (_, fewer) = run(IdaOptions { suppressed, ..tolerance(1e-6) });
    assert_ne!(fewer.steps, plain.steps);
}

#[test]
fn the_linked_libraries_are_those_of_the_headers() {
    let versions = Versions::linked();
    assert_eq!(versions.sundials, versions.sundials_headers);
    assert_eq!(versions.index_bits, 64);
    let major = if cfg!(feature = "vendored") { "7." } else { "6." };
    assert!(versions.sundials.starts_with(major), "{versions:?}");
    assert_eq!(versions.sparse.is_some(), HAS_KLU);
    if let Some(sparse) = &versions.sparse {
        let is_known = |major| sparse.klu.starts_with(major);
        assert!(is_known("1.") || is_known("2."), "{versions:?}");
    }
}

/// Regression test: the derivative of order k + 1, where k is the order of the last step, aborted the process. Values
/// at times far outside the last step were extrapolated.
#[test]
fn quadratures_have_the_derivatives_of_the_last_step_only() {
    let start = Akzo.start();
    let mut solver = IdaSolver::builder(Akzo)
        .options(tolerance(1e-8))
        .quadrature([0.0], None, |_, _, y, _, rate| {
            rate[0] = y[0];
            Ok(())
        })
        .build(start.t, &start.y, &start.y_dot)
        .unwrap();
    let mut out = [f64::NAN];
    solver.quadrature_dense_output(0.0, 0, &mut out).unwrap();
    assert_eq!(out, [0.0]);
    let mut orders_to_come = 0;
    while solver.t() < 10.0 {
        solver.step(180.0).unwrap();
        let statistics = solver.statistics();
        let [from, to] = solver.last_step_interval();
        for derivative in 0..=statistics.last_order.min(statistics.current_order) {
            solver.quadrature_dense_output(to, derivative, &mut out).unwrap();
        }
        orders_to_come += u32::from(statistics.current_order > statistics.last_order);
        for (t, derivative) in [
            (to, statistics.last_order + 1),
            (from - 0.1 * (to - from), 0),
            (to + 0.1 * (to - from), 0),
            (to + 100.0, 1),
        ] {
            let error = solver.quadrature_dense_output(t, derivative, &mut out);
            assert!(
                matches!(error, Err(sundials_wrap::Error::Common(NoDenseOutput { .. }))),
                "{t}"
            );
        }
    }
    assert!(orders_to_come > 0, "the case that aborted");
}

/// Regression test: with a purely relative tolerance, a solution that became zero was reported as misuse, without
/// statistics.
#[test]
fn a_tolerance_that_becomes_zero_is_an_outcome_with_statistics() {
    struct Ramp;
    impl Problem for Ramp {
        fn n_unknowns(&self) -> usize {
            1
        }
        fn residual(
            &mut self,
            _: f64,
            _: &[f64],
            y_dot: &[f64],
            residual: &mut [f64],
        ) -> Result<(), StepError> {
            // y = 1 − t. Steps of 1/8 have no rounding errors.
            residual[0] = y_dot[0] + 1.0;
            Ok(())
        }
    }
    let options = IdaOptions {
        tolerances: Tolerances::scalar(1e-4, 0.0),
        max_step: Some(0.125),
        initial_step: Some(0.125),
        ..IdaOptions::default()
    };
    let mut solver = IdaSolver::builder(Ramp).options(options).build(0.0, &[1.0], &[-1.0]).unwrap();
    let Outcome::Stopped(stop) = solver.integrate_to(4.0).unwrap() else {
        panic!("it must stop");
    };
    assert_eq!(stop.reason, myovib_dae::StopReason::ErrorWeightsFailed, "{stop}");
    assert!(stop.statistics.steps >= 8, "{stop}");
}

/// Regression test: the smallest condition estimate was kept after a restart.
#[test]
fn condition_estimates_restart() {
    let start = Robertson.start();
    let mut solver = build(Robertson, tolerance(1e-4));
    solver.integrate_to(40.0).unwrap();
    assert_eq!(solver.statistics().smallest_rcond.is_some(), HAS_KLU);
    solver.reinit(start.t, &start.y, &start.y_dot, &[]).unwrap();
    assert_eq!(solver.statistics().smallest_rcond, None);
}

/// Regression test: the first step chosen by IDAS, 6e-10, was so short that rounding errors of multipliers prevented
/// the second step.
#[test]
fn rounding_of_multipliers_does_not_prevent_first_steps() {
    let crank = || Differentiated::new(Constrained::new(SliderCrank, MechanicalForm::Stabilized));
    let start = crank().start();
    for tol in [1e-6, 1e-8, 1e-10] {
        let options = IdaOptions {
            suppressed: Suppressed::FromIndex(2),
            max_steps: Some(100_000),
            ..tolerance(tol)
        };
        let builder = IdaSolver::builder(crank()).options(options);
        let mut solver = builder.build(start.t, &start.y, &start.y_dot).unwrap();
        assert_eq!(solver.integrate_to(2.0).unwrap(), Outcome::Reached { t: 2.0 }, "{tol:e}");
    }
}
