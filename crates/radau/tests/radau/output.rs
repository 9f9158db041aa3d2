//! Output between the ends of steps, for inputs and characteristics with kinks.

use myovib_conformance::AnyProblem;
use myovib_conformance::samples::{Differentiated, Pump, Sample, TwoStageAmplifier, VanDerPol};
use myovib_dae::{Direction, Outcome, Problem, StepError, StopReason};
use myovib_radau::RadauOptions;

use crate::circuits::{CIRCUITS, Driven, PROMISED, WAVES, pairs};
use crate::common::{radau, stopped, tolerance};

/// Result of a completed run: the number of attempted steps, and y.
type End = Option<(u64, Vec<f64>)>;

/// Integrates with or without error control of the output between steps. Returns `None` if the solver stops.
fn run<P: Problem + 'static>(
    problem: P,
    [y, y_dot]: [&[f64]; 2],
    t_end: f64,
    (stages, tol): (usize, f64),
    dense_output: bool,
) -> End {
    let options = RadauOptions { stages, dense_output, ..tolerance(tol) };
    let builder = radau(problem).options(options);
    let mut solver = builder.build(0.0, y, y_dot).unwrap();
    solver.set_stop_time(t_end).unwrap();
    for _ in 0..5000 {
        match solver.step(t_end).unwrap() {
            Outcome::StepTaken { .. } => {}
            Outcome::StopTime { .. } => {
                let statistics = solver.statistics();
                let attempts = statistics.steps + statistics.error_test_failures;
                return Some((attempts, solver.y().to_vec()));
            }
            _ => return None,
        }
    }
    None
}

/// Regression test: after a kink, the next steps were limited by rounding errors of multipliers, which were divided by
/// the sizes of the short steps at the kink. With dense output, 80 of these runs did not reach the end.
#[test]
fn output_does_not_prevent_success() {
    let mut attempts = [0; 2];
    let mut compare = |what: &str, [without, with]: [End; 2]| -> Option<Vec<f64>> {
        let (count, _) = without?;
        let (count_with, y) = with.unwrap_or_else(|| panic!("{what}: no success with output"));
        attempts[0] += count;
        attempts[1] += count_with;
        Some(y)
    };
    for method in pairs(&[3, 5, 7], &[1e-4, 1e-6, 1e-8]) {
        let pump = || Differentiated::new(Pump);
        let start = pump().start();
        let both =
            [false, true].map(|output| run(pump(), [&start.y, &start.y_dot], 2.0, method, output));
        compare(&format!("pump, {method:?}"), both);
        for (circuit, (name, wave, t_end)) in pairs(&CIRCUITS, &WAVES) {
            let units = [1.0, 1.0];
            let driven = || Driven { circuit, wave, units };
            let [y, y_dot] = driven().exact(0.0);
            let both =
                [false, true].map(|output| run(driven(), [&y, &y_dot], t_end, method, output));
            let what = format!("{}, {name}, {method:?}", circuit.name);
            if let Some(y) = compare(&what, both) {
                let error = driven().error(&y, t_end, method.1);
                assert!(error < PROMISED, "{what}: {error:.1e}");
            }
        }
    }
    // With dense output, the solver must take a shorter step at each kink.
    assert!(attempts[1] < 2 * attempts[0], "{attempts:?}");
}

/// Regression test: at a tolerance near the rounding error of y, rounding errors of the output between the ends of
/// steps exceeded the tolerance for any step size, and these runs stopped.
#[test]
fn rounding_between_steps_does_not_prevent_output() {
    for stages in [5, 7] {
        let amplifier = || Differentiated::new(TwoStageAmplifier);
        let start = amplifier().start();
        let end =
            |output| run(amplifier(), [&start.y, &start.y_dot], 0.03, (stages, 1e-12), output);
        let [without, with] = [false, true].map(|output| end(output).map(|(_, y)| y));
        let without = without.unwrap();
        let with = with.unwrap_or_else(|| panic!("{stages} stages: no success with output"));
        for (i, (with, without)) in with.iter().zip(&without).enumerate() {
            let error = (with - without).abs() / (1e-12 * (1.0 + without.abs()));
            assert!(error < PROMISED, "{stages} stages, component {i}: {error:.1e}");
        }
    }
}

/// Regression test: dense output in the first step after a restart used the multipliers and slopes from before the
/// restart. After a jump, its error was a tenth of the jump.
#[test]
fn output_after_a_restart_does_not_depend_on_earlier_values() {
    for (stages, tol) in pairs(&[3, 5, 7], &[1e-4, 1e-6]) {
        for (circuit, (name, wave, t_end)) in pairs(&CIRCUITS, &WAVES) {
            let units = [1.0, 1.0];
            let driven = Driven { circuit, wave, units };
            let [y, y_dot] = driven.exact(0.0);
            let options = RadauOptions { stages, ..tolerance(tol) };
            let builder = radau(Driven { ..driven }).options(options);
            let mut solver = builder.build(0.0, &y, &y_dot).unwrap();
            for t in driven.breaks(t_end) {
                if !matches!(solver.integrate_to(t).unwrap(), Outcome::Reached { .. }) {
                    break;
                }
                solver.restart();
                let outcome = solver.step(t_end).unwrap();
                let Outcome::StepTaken { .. } = outcome else {
                    break;
                };
                let [from, to] = solver.last_step_interval();
                let mut y = vec![0.0; y.len()];
                for theta in [0.013, 0.1, 0.35, 0.5, 0.77, 0.95] {
                    let t = from + theta * (to - from);
                    solver.dense_output(t, 0, &mut y).unwrap();
                    let error = driven.error(&y, t, tol);
                    assert!(
                        error < PROMISED,
                        "{}, {name}, {stages} stages, {tol:e}, {t}: {error:.1e}",
                        circuit.name
                    );
                }
            }
        }
    }
}

/// Regression test: t + h was rounded, but h was not. In a run that started at a time in seconds since 1970, the
/// solution of an autonomous problem was wrong by thousands of tolerances.
#[test]
fn steps_are_exact_differences_of_times() {
    let tol = 1e-6;
    for stages in [3, 5, 7] {
        let end = |t0: f64| {
            let problem = VanDerPol { vdp_mu: 1.0 };
            let start = problem.start();
            let options = RadauOptions { stages, ..tolerance(tol) };
            let builder = radau(problem).options(options);
            let mut solver = builder.build(t0, &start.y, &start.y_dot).unwrap();
            solver.set_stop_time(t0 + 5.0).unwrap();
            let mut checked = 0;
            while solver.t() < t0 + 5.0 {
                let outcome = solver.step(t0 + 5.0).unwrap();
                assert!(!matches!(outcome, Outcome::Stopped(_)), "{outcome:?}");
                let [from, to] = solver.last_step_interval();
                // In runs from 0, step sizes are not rounded.
                assert!(t0 == 0.0 || solver.statistics().last_step == to - from);
                checked += 1;
            }
            assert_eq!((solver.t(), solver.statistics().steps), (t0 + 5.0, checked));
            solver.y().to_vec()
        };
        let exact = end(0.0);
        for t0 in [1.7e9, 1e12] {
            for (found, exact) in end(t0).iter().zip(&exact) {
                // The errors of the two runs add up.
                let bound = 2.0 * PROMISED * tol * (1.0 + exact.abs());
                assert!((found - exact).abs() < bound, "{stages} {t0:e}: {found} {exact}");
            }
        }
    }
}

/// Regression test: after a late start, a first step was halved to 0 if an input changed within the rounding error of
/// the time.
#[test]
fn first_steps_are_not_halved_below_the_rounding_of_times() {
    struct Noise;
    impl Problem for Noise {
        fn n_unknowns(&self) -> usize {
            2
        }

        fn residual(
            &mut self,
            t: f64,
            y: &[f64],
            yp: &[f64],
            r: &mut [f64],
        ) -> Result<(), StepError> {
            r.copy_from_slice(&[yp[0] + y[0], y[1] - (1e7 * t).sin()]);
            Ok(())
        }
    }
    for (stages, t0) in pairs(&[3, 5, 7], &[1.7e9, 1e12]) {
        let options = RadauOptions { stages, ..tolerance(1e-6) };
        let builder = radau(Noise).options(options);
        let mut solver = builder.build(t0, &[1.0, (1e7 * t0).sin()], &[-1.0, 0.0]).unwrap();
        let stop = stopped(solver.step(t0 + 1e3).unwrap());
        assert_eq!(stop.reason, StopReason::StepTooSmall, "{stop}");
        // The matrix of a step of size 0 contains infinities.
        assert_eq!(stop.statistics.step_solve_failures, 0, "{stop}");
    }
}

/// Regression test: dense output of a first step used the initial multiplier and derivatives, which do not affect the
/// steps.
#[test]
fn output_of_first_steps_does_not_depend_on_wrong_multipliers() {
    for (stages, (circuit, (name, wave, t_end))) in pairs(&[3, 5, 7], &pairs(&CIRCUITS, &WAVES)) {
        let driven = Driven { circuit, wave, units: [1.0, 1.0] };
        let [mut y, y_dot] = driven.exact(0.0);
        let indices = driven.indices().unwrap();
        let wrong = (0..y.len()).filter(|&i| indices[i] > 1);
        wrong.for_each(|i| y[i] += 1.0);
        let options = RadauOptions { stages, ..tolerance(1e-6) };
        let builder = radau(Driven { ..driven }).options(options);
        let mut solver = builder.build(0.0, &y, &y_dot).unwrap();
        let Outcome::StepTaken { .. } = solver.step(t_end).unwrap() else {
            continue;
        };
        let [from, to] = solver.last_step_interval();
        for theta in [0.013, 0.1, 0.35, 0.5, 0.77, 0.95] {
            let t = from + theta * (to - from);
            solver.dense_output(t, 0, &mut y).unwrap();
            let error = driven.error(&y, t, 1e-6);
            let what = format!("{}, {name}, {stages} stages", circuit.name);
            assert!(error < PROMISED, "{what}, {theta}: {error:.1e}");
        }
    }
}

/// Regression test: dense output of a first step used wrong initial derivatives, which do not affect the steps. The
/// error was 60 tolerances, or 600 with a given first step. Root functions used the same polynomial.
#[test]
fn output_of_first_steps_does_not_depend_on_wrong_derivatives() {
    struct Decay;
    impl Problem for Decay {
        fn n_unknowns(&self) -> usize {
            1
        }

        fn residual(
            &mut self,
            _: f64,
            y: &[f64],
            yp: &[f64],
            r: &mut [f64],
        ) -> Result<(), StepError> {
            r[0] = yp[0] + y[0];
            Ok(())
        }
    }
    let first_steps = [None, Some(1e-2), Some(0.1)];
    for ((stages, tol), (initial_step, guess)) in
        pairs(&pairs(&[3, 5, 7], &[1e-4, 1e-8]), &pairs(&first_steps, &[0.0, 1.0, -1.0, 1e6]))
    {
        let options = RadauOptions { stages, initial_step, ..tolerance(tol) };
        let builder = radau(Decay).options(options);
        let crossing = 1e-4_f64;
        let root = move |_: &mut AnyProblem, _: f64, y: &[f64], _: &[f64], g: &mut [f64]| {
            g[0] = y[0] - (-crossing).exp();
            Ok(())
        };
        let builder = builder.roots(vec![Direction::Both], root);
        let mut solver = builder.build(0.0, &[1.0], &[guess]).unwrap();
        let Outcome::Root { t, .. } = solver.integrate_to(1.0).unwrap() else {
            panic!("{stages} stages, {initial_step:?}, {guess}: no root");
        };
        // The derivative of the root function is about 1. The solution is accurate to PROMISED tolerances of size
        // tol (1 + |y|).
        let bound = PROMISED * 2.0 * tol;
        let what = format!("{stages} stages, {tol:e}, {initial_step:?}, {guess}");
        assert!((t - crossing).abs() < bound, "{what}: root at {t}");
        let [from, to] = solver.last_step_interval();
        for theta in [0.013, 0.1, 0.35, 0.5, 0.77, 0.95] {
            let (t, mut y) = (from + theta * (to - from), [0.0]);
            solver.dense_output(t, 0, &mut y).unwrap();
            let error = (y[0] - (-t).exp()).abs();
            assert!(error < bound, "{what}, {theta}: {:.1e} tolerances", error / tol);
        }
    }
}
