//! Compares the discrete adjoint with forward sensitivities, difference quotients and closed forms.

use myovib_conformance::samples::{
    MechanicalForm, Oscillator, ParametricSample, Pendulum, ScaledJay, ScaledLinear,
};
use myovib_dae::IntegratorError::AfterTheStart;
use myovib_dae::{Differenced, Parameter, Tolerances};
use myovib_radau::{
    Adjoint, Cotangents, ForwardSensitivities, Gradient, IndexScaling, RadauError, RadauOptions,
    RadauSolver, Recording, StepSize,
};

use crate::common::{run, solver_of, tolerance};

/// Times at which the misfit uses the solution and its derivative, at the ends of steps and within steps.
const TIMES: [f64; 4] = [0.0, 0.21, 0.5, 1.0];

fn pendulum() -> Pendulum {
    Pendulum::new(MechanicalForm::Index3).with(0.6, 9.81)
}

/// Returns ∂J/∂y(t) (`derivative` = 0) or ∂J/∂ẏ(t) (`derivative` = 1) for a misfit J that is a sum over [`TIMES`]. The
/// values are arbitrary and different from each other. The misfit uses only derivatives of the first half of the
/// unknowns, such as positions, because other derivatives would amplify rounding by another factor of 1/h.
fn cotangent(n: usize, t: f64, derivative: usize) -> Vec<f64> {
    let of = |i| (1.0 + i as f64 + t + 2.0 * derivative as f64).sin();
    let counting = if derivative == 0 { n } else { n / 2 };
    let mut cotangent: Vec<f64> = (0..n).map(of).collect();
    cotangent[counting..].fill(0.0);
    cotangent
}

/// Returns the orders of the derivatives in the misfit. At the start, ẏ is excluded, because the initial slope of the
/// polynomial of the first step is proportional to 1/h or 1/h² and would dominate all other terms.
fn derivatives(t: f64) -> std::ops::Range<usize> {
    0..if t > 0.0 { 2 } else { 1 }
}

fn add(step: &mut Cotangents<'_>, n: usize) {
    for t in TIMES {
        if step.covers(t) {
            for derivative in derivatives(t) {
                step.add(t, derivative, &cotangent(n, t, derivative));
            }
        }
    }
}

/// Returns the gradient, computed from stored stages or from checkpoints, and a record of the stages in the backward
/// pass.
fn adjoint<S: ParametricSample + Copy + 'static>(
    sample: S,
    options: RadauOptions,
    with_checkpoints: bool,
) -> (Gradient, Vec<f64>) {
    let mut solver = solver_of(sample, options);
    let mut recording = match with_checkpoints {
        true => Recording::of_checkpoints(&solver),
        false => Recording::of_stages(&solver),
    }
    .unwrap();
    recording.integrate_to(&mut solver, 1.0).unwrap();
    let (before, n) = (solver.save(), solver.y().len());
    let mut adjoint = Adjoint::new(&solver, sample.differenced()).with_tolerance(1e-13);
    let mut seen = Vec::new();
    let gradient = adjoint.gradient(&mut solver, &recording, &mut |step| {
        add(step, n);
        for stage in 0..step.quadrature().count() {
            let mut y = vec![0.0; n];
            step.stage(stage, &mut y);
            seen.append(&mut y);
        }
        Ok(())
    });
    // The statistics are also restored, except for the evaluations that the restoration itself requires.
    assert_eq!(solver.t(), before.t());
    let gradient = gradient.unwrap();
    assert_eq!(adjoint.work().steps, recording.n_steps() as u64);
    (gradient, seen)
}

/// Returns ∂y_0/∂p_j for each parameter.
fn starts<S: ParametricSample>(sample: S) -> Vec<Vec<f64>> {
    let of = |j| sample.exact_sensitivity(j, 0.0);
    (0..sample.parameters().len()).map(of).collect()
}

/// Returns the gradient, including the effect of the parameters on the initial values.
fn total<S: ParametricSample>(sample: S, gradient: &Gradient) -> Vec<f64> {
    let of = |(start, p): (Vec<f64>, &f64)| {
        let by_start = start.iter().zip(&gradient.start).map(|(s, g)| s * g);
        p + by_start.sum::<f64>()
    };
    starts(sample).into_iter().zip(&gradient.parameters).map(of).collect()
}

/// Returns the gradient computed from forward sensitivities, with respect to the parameters (including their effect on
/// the initial values) or only with respect to the initial value of the unknown `moved`.
fn forward<S: ParametricSample + Copy + 'static>(
    sample: S,
    options: RadauOptions,
    moved: Option<usize>,
) -> Vec<f64> {
    let mut solver = solver_of(sample, options);
    let n = solver.y().len();
    let unit = |i| f64::from(u8::from(Some(i) == moved));
    let start: Vec<f64> = (0..n).map(unit).collect();
    let (parameters, starts) = match moved {
        None => (sample.differenced(), starts(sample)),
        Some(_) => {
            let list = vec![Parameter::new("a start", 1.0)];
            (Differenced::new(list, |_: &S, _| 1.0, |_: &mut S, _, _| {}), vec![start])
        }
    };
    let count = starts.len();
    let mut followed =
        ForwardSensitivities::new(&solver, parameters, starts).unwrap().with_tolerance(1e-11);
    solver.set_stop_time(1.0).unwrap();
    let mut sums = vec![0.0; count];
    let mut s = vec![0.0; n];
    while solver.t() < 1.0 {
        let from = solver.t();
        solver.step(1.0).unwrap();
        followed.follow(&mut solver).unwrap();
        for t in TIMES {
            let is_start = t == 0.0 && solver.statistics().steps == 1;
            let is_covered = is_start || (from < t && t <= solver.t());
            if !is_covered {
                continue;
            }
            for (j, sum) in sums.iter_mut().enumerate() {
                for derivative in derivatives(t) {
                    followed.dense_output(&solver, j, t, derivative, &mut s).unwrap();
                    let g = cotangent(n, t, derivative);
                    *sum += g.iter().zip(&s).map(|(g, s)| g * s).sum::<f64>();
                }
            }
        }
    }
    sums
}

/// Agreement required by issue 19.
const AGREEMENT: f64 = 1e-10;

fn expect_agreement(name: &str, forward: &[f64], adjoint: &[f64]) {
    for (f, a) in forward.iter().zip(adjoint) {
        println!("{name}: {f:e} {:.1e}", (f - a) / f);
        assert!((f - a).abs() <= AGREEMENT * f.abs(), "{name}: {f:e} {a:e}");
    }
}

/// Compares the two methods for the parameters of a sample and for the initial values of the first `differential`
/// unknowns.
fn compare<S: ParametricSample + Copy + 'static>(
    name: &str,
    sample: S,
    differential: usize,
    step_size: StepSize,
) {
    for stages in [3, 5, 7] {
        let options = || RadauOptions {
            stages,
            step_size,
            max_newton_iterations: Some(30),
            ..tolerance(1e-4)
        };
        let (stored, _) = adjoint(sample, options(), false);
        let name = format!("{name}, {stages} stages");
        let expected = forward(sample, options(), None);
        expect_agreement(&name, &expected, &total(sample, &stored));
        let by_start = (0..differential).map(|i| forward(sample, options(), Some(i))[0]);
        let by_start: Vec<f64> = by_start.collect();
        expect_agreement(&name, &by_start, &stored.start[..differential]);
        let (repeated, _) = adjoint(sample, options(), true);
        expect_agreement(&name, &expected, &total(sample, &repeated));
    }
}

/// Steps for index 2 and 3. With first steps of 1e-3, ten digits would not be possible, because rounding errors are
/// amplified by 1/h and 1/h².
const LONG: StepSize = StepSize::Fixed(0.02);

#[test]
fn forward_and_adjoint_agree_on_an_ordinary_differential_equation() {
    compare("oscillator", Oscillator { omega: 3.0 }, 2, StepSize::Adaptive);
}

#[test]
fn forward_and_adjoint_agree_at_index_1() {
    compare("linear", ScaledLinear { p: 2.0, q: 0.6 }, 1, StepSize::Adaptive);
}

#[test]
fn forward_and_adjoint_agree_at_index_2() {
    compare("jay", ScaledJay { c: 1.5, w: 0.8 }, 2, LONG);
}

#[test]
fn forward_and_adjoint_agree_at_index_3() {
    // A single initial value cannot be changed, because consistent initial values depend on each other.
    compare("pendulum", pendulum(), 0, LONG);
}

/// Checks adaptive steps. For index 3, these include steps with old factors, rejected steps, and multipliers that
/// depend on previous steps.
#[test]
fn steps_from_checkpoints_are_the_same_bit_by_bit() {
    fn expect_same<S: ParametricSample + Copy + 'static>(sample: S) {
        for stages in [3, 5, 7] {
            let options = || RadauOptions { stages, ..tolerance(1e-6) };
            let [stored, repeated] = [false, true].map(|how| adjoint(sample, options(), how).1);
            assert!(stored.len() > 10 && stored == repeated, "{stages} stages");
        }
    }
    expect_same(Oscillator { omega: 3.0 });
    expect_same(ScaledLinear { p: 2.0, q: 0.6 });
    expect_same(ScaledJay { c: 1.5, w: 0.8 });
    expect_same(pendulum());
}

/// Checks that J(p + δ) − J(p) − δ ∂J/∂p decreases as δ². Here, p is the length of a pendulum, and J depends on the
/// first coordinate at the end of a run with fixed steps, in which Newton's method converges up to rounding errors.
#[test]
fn the_taylor_remainder_has_order_2() {
    let options = || RadauOptions {
        tolerances: Tolerances::scalar(1e-12, 1e-12),
        tolerances_for_solution: false,
        newton_tolerance: Some(0.003),
        max_newton_iterations: Some(30),
        index_scaling: IndexScaling::All,
        step_size: StepSize::Fixed(0.02),
        ..RadauOptions::default()
    };
    let of = |g: f64| {
        let sample = Pendulum::new(MechanicalForm::Index3).with(0.6, g);
        run(sample, 1.0, options()).y()[0].powi(2) / 2.0
    };
    let mut solver = solver_of(pendulum(), options());
    let mut recording = Recording::of_stages(&solver).unwrap();
    recording.integrate_to(&mut solver, 1.0).unwrap();
    let (mut adjoint, n) = (Adjoint::new(&solver, pendulum().differenced()), solver.y().len());
    let gradient = adjoint
        .gradient(&mut solver, &recording, &mut |step| {
            if step.covers(1.0) {
                let mut y = vec![0.0; n];
                step.evaluate(1.0, 0, &mut y);
                y[1..].fill(0.0);
                step.add(1.0, 0, &y);
            }
            Ok(())
        })
        .unwrap();
    let slope = gradient.parameters[1];
    let remainder = |delta: f64| (of(9.81 + delta) - of(9.81) - delta * slope).abs();
    // The remainders range from 1e-4 to 6e-6 of g. The remaining error of Newton's method is 3e-15.
    for delta in [0.01, 0.005, 0.0025] {
        let order = (remainder(delta) / remainder(0.5 * delta)).log2();
        println!("{delta}: {:e}, order {order}", remainder(delta));
        assert!((order - 2.0).abs() < 0.05, "{delta}: order {order}");
    }
}

/// Integrates J = ∫ x² dt over [0, 1] with the weights of the stages. The exact results are x = cos ωt and J = 1/2 +
/// sin 2ω/(4ω).
#[test]
fn integrals_are_summed_over_the_stages() {
    let omega = 3.0;
    let sample = Oscillator { omega };
    let mut solver = solver_of(sample, tolerance(1e-9));
    let mut recording = Recording::of_stages(&solver).unwrap();
    recording.integrate_to(&mut solver, 1.0).unwrap();
    let mut integral = 0.0;
    let gradient = Adjoint::new(&solver, sample.differenced())
        .gradient(&mut solver, &recording, &mut |step| {
            let weights: Vec<f64> = step.quadrature().map(|(_, weight)| weight).collect();
            for (i, weight) in weights.into_iter().enumerate() {
                let mut y = [0.0; 2];
                step.stage(i, &mut y);
                integral += weight * y[0].powi(2);
                step.add_to_stage(i, &[2.0 * weight * y[0], 0.0]);
            }
            Ok(())
        })
        .unwrap();
    let (sin, cos) = (2.0 * omega).sin_cos();
    let slope = cos / (2.0 * omega) - sin / (4.0 * omega * omega);
    // The values at the stages have the order s + 1, and the quadrature has the order of the method. The bound is about
    // ten tolerances.
    assert!((integral - 0.5 - sin / (4.0 * omega)).abs() < 1e-8);
    assert!((gradient.parameters[0] - slope).abs() < 1e-7);
}

/// Checks that four times as many steps require twice the memory, and that each step is computed twice, except for the
/// steps that are still stored when the run ends.
#[test]
fn checkpoints_need_the_memory_of_the_root_of_the_steps() {
    let record = |h: f64, t_end: f64, last: u64| {
        let options = RadauOptions { step_size: StepSize::Fixed(h), ..tolerance(1e-4) };
        let sample = Oscillator { omega: 3.0 };
        let mut solver = solver_of(sample, options);
        let mut recording = Recording::of_checkpoints(&solver).unwrap();
        recording.integrate_to(&mut solver, t_end).unwrap();
        let mut adjoint = Adjoint::new(&solver, sample.differenced());
        let gradient = adjoint.gradient(&mut solver, &recording, &mut |step| {
            add(step, 2);
            Ok(())
        });
        gradient.unwrap();
        let steps = recording.n_steps();
        assert_eq!(adjoint.work().repeated_steps, steps as u64 - last);
        // The arguments of a step require 40 bytes, in addition to the states.
        recording.n_bytes() - 40 * steps
    };
    // For 16² and 64² steps, 9 and 33 states are stored, with 32 and 128 steps between two states. At the last step,
    // every other state was discarded, and half of the stages of previous steps were released.
    let ratio = record(1.0 / 4096.0, 1.0, 0) as f64 / record(1.0 / 256.0, 1.0, 0) as f64;
    assert!((ratio - 4.0).abs() < 0.5, "{ratio}");
    // For 320 and 300 steps, with 32 steps between two states, the last 32 and 12 steps are stored.
    record(1.0 / 256.0, 1.25, 32);
    record(1.0 / 256.0, 300.0 / 256.0, 12);
}

#[test]
fn misuse_is_rejected() {
    let sample = Oscillator { omega: 3.0 };
    let mut solver = solver_of(sample, tolerance(1e-4));
    let mut recording = Recording::of_checkpoints(&solver).unwrap();
    solver.step(1.0).unwrap();
    recording.follow(&mut solver).unwrap();
    assert!(matches!(
        Recording::of_stages(&solver).err(),
        Some(RadauError::Common(AfterTheStart { .. }))
    ));
    // If the solver is changed between steps, the steps cannot be repeated.
    for _ in 0..20 {
        solver.restart();
        solver.step(1.0).unwrap();
        recording.follow(&mut solver).unwrap();
    }
    let mut adjoint = Adjoint::new(&solver, sample.differenced());
    let mut gradient =
        |solver: &mut RadauSolver<_>| adjoint.gradient(solver, &recording, &mut |_| Ok(()));
    assert!(matches!(gradient(&mut solver), Err(RadauError::NotRepeated { .. })));
    solver.step(1.0).unwrap();
    solver.step(1.0).unwrap();
    assert!(matches!(recording.follow(&mut solver), Err(RadauError::StartedAgain { .. })));
}
