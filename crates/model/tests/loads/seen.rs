//! No method passes over a load, without any setting by the user.

use myovib_dae::Problem;
use myovib_model::{
    ErrorEstimate, Field, Formulation, IntegratorKind, MuscleDae, Outcome, SampleTimes, Sampler,
    Settings, Signal, Spline, Statistics, StepOptions, formula, loosening, run, start_at_rest,
};

use crate::common::{beam, tolerances};

/// A beam whose motions, and the accumulated errors of BDF, decay within a few tenths of a second.
fn damped(signal: Signal) -> MuscleDae {
    beam(Formulation::ImplicitRate, 1e5, signal)
}

fn settings(integrator: IntegratorKind, rtol: f64) -> Settings {
    Settings {
        integrator,
        t_end: 2.0,
        relative_tolerance: rtol,
        absolute_tolerances: tolerances(rtol),
        suppressed: Vec::new(),
        max_order: 5,
        ..Settings::paper(Formulation::ImplicitRate)
    }
}

/// The displacements every 10 ms.
fn motion(signal: &Signal, settings: &Settings) -> (Vec<Vec<f64>>, Statistics) {
    let dae = damped(signal.clone());
    let n = dae.n_unknowns();
    let range = dae.layout().range(Field::Displacement).unwrap();
    let mut integrator = start_at_rest(dae, settings).unwrap();
    let mut motion = Vec::new();
    let times = SampleTimes::new(0.01, settings.t_end);
    let mut sampler = Sampler::new(times, n, |_: &mut MuscleDae, _, y: &[f64]| {
        motion.push(y[range.clone()].to_vec());
        Ok(())
    });
    let statistics = run(integrator.as_mut(), &mut [&mut sampler]).unwrap();
    assert_eq!(statistics.outcome, Outcome::Finished);
    drop(sampler);
    (motion, statistics)
}

/// Returns the motion computed with steps much shorter than all changes of the load.
fn reference(signal: &Signal) -> Vec<Vec<f64>> {
    let settings = Settings {
        steps: StepOptions { max_step: Some(1e-3), ..StepOptions::default() },
        ..settings(IntegratorKind::Radau5, 1e-6)
    };
    motion(signal, &settings).0
}

/// Returns the largest displacement, and the largest difference.
fn compare(a: &[Vec<f64>], b: &[Vec<f64>]) -> (f64, f64) {
    let pairs = || a.iter().flatten().zip(b.iter().flatten());
    assert_eq!(a.len(), b.len());
    (
        pairs().fold(0.0, |m, (a, _)| m.max(a.abs())),
        pairs().fold(0.0, |m, (a, b)| m.max((a - b).abs())),
    )
}

fn step(value: f64, start: f64, rise: f64) -> Signal {
    Signal::from(formula::StepFunction { value, start, rise })
}

fn pulse(value: f64, start: f64, length: f64, rise: f64) -> Signal {
    Signal::sum(vec![step(value, start, rise), step(-value, start + length, rise)])
}

fn table(rows: impl Iterator<Item = (f64, f64)>) -> Signal {
    let (times, values) = rows.unzip();
    Signal::from(Spline::new(times, values).unwrap())
}

fn every_millisecond(value: impl Fn(usize) -> f64) -> Signal {
    table((0..=2000).map(|i| (1e-3 * i as f64, value(i))))
}

fn check(name: &str, signal: &Signal) {
    let reference = reference(signal);
    for integrator in IntegratorKind::ALL {
        let (motion, statistics) = motion(signal, &settings(integrator, 1e-4));
        let (size, difference) = compare(&reference, &motion);
        // Local errors of 1e-4 accumulate to this value until they decay; a missed load would cause an error of its
        // full size.
        assert!(
            difference < 1e-2 * size,
            "{name}, {integrator:?}: off by {difference:e} of {size:e} in {} steps",
            statistics.counts.steps
        );
    }
}

/// Regression: steps passed over pulses that begin after a period of rest, and the run was reported as finished.
#[test]
fn pulses_ramps_and_tables_after_a_rest_are_seen() {
    check("a pulse of 100 ms", &pulse(100.0, 1.0, 0.1, 0.02));
    check("a pulse of 2 ms", &pulse(1000.0, 1.3, 2e-3, 5e-4));
    let steep = Signal::from(formula::Ramp { value: 20.0, start: 1.1, end: 1.1 + 1e-4 });
    check("a steep ramp", &steep);
    let tapped = every_millisecond(|i| if (1500..1502).contains(&i) { 1000.0 } else { 0.0 });
    check("a table with a pulse of 2 ms", &tapped);
    let burst = Signal::product(vec![
        pulse(1.0, 1.2, 0.2, 1e-2),
        Signal::from(formula::Sine { amplitude: 300.0, frequency: 100.0, phase: 0.0 }),
    ]);
    check("a burst of 100 Hz", &burst);
}

/// Returns a random load: jumps, pulses, ramps and a table with a bump, within the first 1.5 s.
fn random_load(draw: &mut impl FnMut() -> f64) -> Signal {
    let parts = (0..1 + (3.0 * draw()) as usize).map(|_| {
        let (value, start) = (40.0 * (draw() - 0.5), 0.1 + 1.3 * draw());
        // From 1 ms to 100 ms.
        let mut duration = || 1e-3 * 100f64.powf(draw());
        match (duration(), duration()) {
            (long, rise) if long > 3.0 * rise => pulse(value, start, long, 0.0),
            (long, rise) if long > rise => pulse(value, start, long, rise),
            (long, _) if value > 0.0 => {
                Signal::from(formula::Ramp { value, start, end: start + long })
            }
            (long, rise) => {
                let shape = |t: f64| value * (-((t - start) / (long + rise)).powi(2)).exp();
                every_millisecond(|i| shape(1e-3 * i as f64))
            }
        }
    });
    Signal::sum(parts.collect())
}

/// Checks random loads: each method agrees with a solution computed with small steps.
#[test]
fn random_loads_are_seen_by_all_methods() {
    // A linear congruential generator is sufficient (Knuth's MMIX).
    let mut state = 1_u64;
    let mut draw = || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    for k in 0..12 {
        let signal = random_load(&mut draw);
        check(&format!("load {k}"), &signal);
    }
}

/// Checks that the estimate of a second run at looser tolerances bounds the error of the first. Errors
/// decrease with the tolerance, although not always in proportion: the estimate is at most ten times
/// the ratio of the tolerances times the error.
#[test]
fn a_second_run_bounds_the_error_of_the_first() {
    let signal = pulse(100.0, 1.0, 0.1, 0.02);
    let exact = reference(&signal);
    for integrator in [IntegratorKind::Bdf, IntegratorKind::Radau5] {
        let settings = settings(integrator, 1e-4);
        let (found, _) = motion(&signal, &settings);
        let rtol = settings.relative_tolerance;
        let ratio = loosening(integrator, rtol);
        let (looser, _) = motion(&signal, &settings.with_relative_tolerance(ratio * rtol));
        let column = |k: usize| found.iter().zip(&looser).map(move |(a, b)| (a[k], b[k]));
        let estimates: Vec<_> =
            (0..found[0].len()).map(|k| ErrorEstimate::between(column(k))).collect();
        let (size, off) = compare(&exact, &found);
        let most = estimates.iter().fold(0.0_f64, |m, e| m.max(e.difference));
        assert!(off < most && most < 10.0 * ratio * off, "{integrator:?}: {off:e} {most:e}");
        let largest = estimates.iter().fold(0.0_f64, |m, e| m.max(e.size));
        // Difference of the runs.
        assert!((largest - size).abs() <= off, "{largest} {size}");
    }
}

/// The measured motion of a support is nonzero at the start. A step over a given time introduces it
/// with two continuous derivatives, and does not change it afterwards.
#[test]
fn a_measured_motion_under_way_is_introduced_smoothly() {
    let measured = every_millisecond(|i| 1e-3 * (50.0 * 1e-3 * i as f64 + 1.0).cos());
    assert!(measured.at(0.0).value.abs() > 1e-4 && measured.at(0.0).d1.abs() > 1e-2);
    let introduced = Signal::product(vec![step(1.0, 0.0, 0.1), measured.clone()]);
    let start = introduced.at(0.0);
    assert_eq!([start.value, start.d1, start.d2], [0.0; 3]);
    assert_eq!(introduced.lowest_jump(), 3);
    for t in [0.1, 0.7, 1.9] {
        assert_eq!(introduced.at(t), measured.at(t));
    }
}
