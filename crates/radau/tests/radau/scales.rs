//! Units of time, and inputs shorter than the steps.

use myovib_conformance::samples::Sample;
use myovib_dae::{Outcome, Problem, StepError, Tolerances};
use myovib_radau::RadauOptions;

use crate::common::{Oscillator, radau, run};

/// A pendulum in the form of index 3 or 2, with a unit of time of `unit` seconds.
#[derive(Clone, Copy)]
struct Pendulum {
    index: u8,
    unit: f64,
}

impl Problem for Pendulum {
    fn n_unknowns(&self) -> usize {
        5
    }

    fn residual(&mut self, _: f64, y: &[f64], v: &[f64], r: &mut [f64]) -> Result<(), StepError> {
        for i in 0..2 {
            r[i] = v[i] - y[2 + i];
            r[2 + i] = v[2 + i] + y[4] * y[i];
        }
        r[3] += 9.81 * self.unit.powi(2);
        r[4] = match self.index {
            2 => y[0] * y[2] + y[1] * y[3],
            _ => y[0] * y[0] + y[1] * y[1] - 1.0,
        };
        Ok(())
    }

    fn indices(&self) -> Option<Vec<u8>> {
        Some(match self.index {
            2 => vec![1, 1, 1, 1, 2],
            _ => vec![1, 1, 2, 2, 3],
        })
    }
}

/// Regression test: errors of multipliers were multiplied by powers of h in the user's unit of time. With a unit of
/// 1e-4 s, order 5 needed forty times as many steps.
#[test]
fn steps_do_not_depend_on_the_unit_of_time() {
    for (stages, index) in [(3, 3), (5, 3), (7, 3), (3, 2), (5, 2)] {
        let steps = [1.0, 1e-6, 1e-3, 1e3, 1e6].map(|unit: f64| {
            let scale = |power| 1e-5 * unit.powi(power);
            let absolute = [0, 0, 1, 1, 2].map(scale).to_vec();
            let end = 5.0 / unit;
            let options = RadauOptions {
                stages,
                tolerances: Tolerances::vector(1e-5, absolute),
                time_scale: end,
                ..RadauOptions::default()
            };
            let problem = Pendulum { index, unit };
            let rates = [0.0, 0.0, 0.0, -9.81 * unit * unit, 0.0];
            let mut solver = radau(problem)
                .options(options)
                .build(0.0, &[1.0, 0.0, 0.0, 0.0, 0.0], &rates)
                .unwrap();
            assert_eq!(solver.integrate_to(end).unwrap(), Outcome::Reached { t: end });
            solver.statistics().steps as f64
        });
        // The runs differ only by rounding errors, which may change the number of 60 steps by up to 4.
        for &number in &steps {
            assert!(
                (number / steps[0] - 1.0).abs() < 0.1,
                "{stages} stages, index {index}: {steps:?}"
            );
        }
    }
}

/// A half-wave rectifier for 50 Hz with RC = 0.1 s. The diode conducts for 2 ms of each period. During the rest of the
/// period, only the voltage decays.
struct Rectifier;

impl Problem for Rectifier {
    fn n_unknowns(&self) -> usize {
        2
    }

    fn residual(&mut self, t: f64, y: &[f64], v: &[f64], r: &mut [f64]) -> Result<(), StepError> {
        let source = 10.0 * (100.0 * std::f64::consts::PI * t).sin();
        let current = 1e-12 * (((source - y[0]) / 0.02585).min(100.0).exp() - 1.0);
        r[0] = 1e-4 * v[0] - y[1] + y[0] / 1e3;
        r[1] = y[1] - current;
        Ok(())
    }
}

/// The same rectifier with a resistor of 10 Ω in series. The voltage of the diode is algebraic. Although the diode
/// conducts during a step, the interpolated voltage may remain negative.
struct RectifierWithResistor;

impl Problem for RectifierWithResistor {
    fn n_unknowns(&self) -> usize {
        2
    }

    fn residual(&mut self, t: f64, y: &[f64], v: &[f64], r: &mut [f64]) -> Result<(), StepError> {
        let source = 10.0 * (100.0 * std::f64::consts::PI * t).sin();
        let current = 1e-9 * ((y[1] / 0.026).exp() - 1.0);
        r[0] = 1e-4 * v[0] - current + y[0] / 1e3;
        r[1] = source - 10.0 * current - y[1] - y[0];
        Ok(())
    }
}

/// Regression test: the last step skipped an interval in which the diode conducts. The reference was computed with
/// SciPy's LSODA and Radau.
#[test]
fn no_conduction_through_a_resistor_is_skipped() {
    let rate = 1e3 * std::f64::consts::PI;
    for stages in [3, 5, 7] {
        for tolerance in [1e-4, 1e-5, 1e-6] {
            let tolerances = Tolerances::scalar(tolerance, tolerance);
            let options = RadauOptions { stages, tolerances, ..RadauOptions::default() };
            let options = RadauOptions { dense_output: false, ..options };
            let mut solver = radau(RectifierWithResistor)
                .options(options)
                .build(0.0, &[0.0; 2], &[0.0, rate])
                .unwrap();
            let outcome = solver.integrate_to(0.1).unwrap();
            assert_eq!(outcome, Outcome::Reached { t: 0.1 });
            // The bound is the same as below for the other rectifier.
            let error = (solver.y()[0] - 7.938737).abs();
            assert!(error < 1e3 * tolerance + 1e-6, "{stages} stages, {tolerance:e}: {error:e}");
        }
    }
}

/// Regression test: steps of 45 ms skipped whole periods. The reference was computed with BDF and with SciPy's Radau.
#[test]
fn no_conduction_of_a_rectifier_is_skipped() {
    for stages in [3, 5, 7] {
        for tolerance in [1e-4, 1e-5, 1e-6, 1e-8] {
            let options = RadauOptions {
                stages,
                tolerances: Tolerances::vector(tolerance, vec![tolerance, 0.01 * tolerance]),
                dense_output: false,
                ..RadauOptions::default()
            };
            let mut solver =
                radau(Rectifier).options(options).build(0.0, &[0.0; 2], &[0.0; 2]).unwrap();
            let outcome = solver.integrate_to(0.1).unwrap();
            assert_eq!(outcome, Outcome::Reached { t: 0.1 });
            // The error of each charging pulse is at most 100 tolerances of 10 V and decays by exp(-0.2) per period. A
            // skipped period would cause an error of 1.5 V. The reference has six digits.
            let error = (solver.y()[0] - 8.108698).abs();
            assert!(error < 1e3 * tolerance + 1e-6, "{stages} stages, {tolerance:e}: {error:e}");
        }
    }
}

/// Regression test: smaller relative tolerances increased the absolute tolerance more, up to an error of 100 % without
/// a failed step.
#[test]
fn absolute_tolerances_hold_for_any_smaller_relative_tolerance() {
    const END: f64 = 20.0;
    let exact = Oscillator.exact(END).unwrap();
    for stages in [3, 5, 7] {
        for (absolute, relative) in [
            (1e-8, [1e-8, 1e-13, 1e-30]),
            (1e-6, [1e-6, 1e-14, 1e-16]),
            (1e-4, [1e-6, 1e-9, 1e-13]),
            (1e-3, [1e-6, 1e-9, 1e-12]),
        ] {
            for relative in relative {
                let options = RadauOptions {
                    stages,
                    tolerances: Tolerances::scalar(relative, absolute),
                    ..RadauOptions::default()
                };
                let solver = run(Oscillator, END, options);
                let errors = solver.y().iter().zip(&exact).map(|(y, exact)| (y - exact).abs());
                let error = errors.fold(0.0, f64::max);
                // According to the guide, errors are about as large as the tolerance, and at most 100 times as large.
                assert!(error < 100.0 * absolute, "{stages} {absolute} {relative}: {error:e}");
            }
        }
    }
}

/// ẏ = max(sin t − threshold, 0), from y = 0.
struct Pulses {
    threshold: f64,
}

impl Problem for Pulses {
    fn n_unknowns(&self) -> usize {
        1
    }

    fn residual(&mut self, t: f64, _: &[f64], v: &[f64], r: &mut [f64]) -> Result<(), StepError> {
        r[0] = v[0] - (t.sin() - self.threshold).max(0.0);
        Ok(())
    }
}

/// Regression test: a step of five periods, eight times as long as the previous step, was checked at ten points, which
/// were all between pulses of 0.19 periods.
#[test]
fn no_pulse_after_a_pause_is_skipped() {
    let period = 2.0 * std::f64::consts::PI;
    let mut skipped = Vec::new();
    // The pulses last 0.20 and 0.19 periods. If a step begins within a period after the last pulse, the points are less
    // than 0.09 periods apart, so each pulse contains two points.
    for threshold in [0.8, 0.835] {
        let half_width = f64::acos(threshold);
        let area = 2.0 * (half_width.sin() - threshold * half_width);
        for periods in 2..25 {
            for (stages, relative) in [3, 5, 7].iter().flat_map(|s| [1e-4, 1e-6].map(|r| (*s, r))) {
                let tolerances = Tolerances::scalar(relative, relative * area);
                let options = RadauOptions { stages, tolerances, ..RadauOptions::default() };
                let mut solver = radau(Pulses { threshold })
                    .options(options)
                    .build(0.0, &[0.0], &[0.0])
                    .unwrap();
                let t = period * f64::from(periods);
                assert_eq!(solver.integrate_to(t).unwrap(), Outcome::Reached { t });
                let missed = f64::from(periods) - solver.y()[0] / area;
                // The total error of all pulses is much smaller than half a pulse.
                if missed.abs() > 0.5 {
                    skipped.push((threshold, periods, stages, relative, missed));
                }
            }
        }
    }
    assert!(skipped.is_empty(), "{} skipped: {skipped:?}", skipped.len());
}
