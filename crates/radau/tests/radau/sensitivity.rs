//! Compares forward sensitivities with closed forms and with difference quotients of runs at small tolerances.

use myovib_conformance::samples::{
    MechanicalForm, Oscillator, ParametricSample, Pendulum, Sample, ScaledJay, ScaledLinear,
};
use myovib_dae::IntegratorError::{NoDenseOutput, NotFinite, WithinStep, WrongLength};
use myovib_dae::{Differenced, Direction, Outcome, Parameter, Problem, StepError, Tolerances};
use myovib_radau::{
    ForwardSensitivities, IndexScaling, RadauError, RadauOptions, RadauSolver, Recording,
    SensitivityWork, StepSize,
};

use crate::common::{solver_of, tolerance};

/// Returns a solver after a run, and the sensitivities to all parameters of a sample.
fn run<S: ParametricSample + Copy + 'static>(
    sample: S,
    t_end: f64,
    options: RadauOptions,
) -> (RadauSolver<S>, ForwardSensitivities<Differenced<S>>) {
    let starts = (0..sample.parameters().len()).map(|j| sample.exact_sensitivity(j, 0.0)).collect();
    let mut solver = solver_of(sample, options);
    let mut sensitivities =
        ForwardSensitivities::new(&solver, sample.differenced(), starts).unwrap();
    sensitivities.integrate_to(&mut solver, t_end).unwrap();
    (solver, sensitivities)
}

/// Returns the largest error of p̄ S at the end, relative to 1 + |p̄ S|. The maximum is over all parameters and the
/// first `n` components.
fn error<S: ParametricSample + Copy + 'static>(
    sample: S,
    t_end: f64,
    n: usize,
    options: RadauOptions,
) -> f64 {
    let (_, sensitivities) = run(sample, t_end, options);
    let mut largest = 0.0_f64;
    for (j, parameter) in sample.parameters().iter().enumerate() {
        let exact = sample.exact_sensitivity(j, t_end);
        for (s, exact) in sensitivities.of(j).iter().zip(&exact).take(n) {
            let scale = parameter.scale;
            let error = scale * (s - exact).abs() / (1.0 + scale * exact.abs());
            assert!(!error.is_nan());
            largest = largest.max(error);
        }
    }
    largest
}

const PENDULUM: f64 = 0.6;

fn pendulum() -> Pendulum {
    Pendulum::new(MechanicalForm::Index3).with(PENDULUM, 9.81)
}

/// Checks the documented error of sensitivities, ten times the tolerance. This error is not controlled, but
/// sensitivities are as smooth as the solution.
#[test]
fn closed_forms_of_index_0_to_3_are_met_at_ten_times_the_tolerance() {
    for stages in [3, 5, 7] {
        for tol in [1e-4, 1e-6, 1e-8] {
            let options = || RadauOptions { stages, ..tolerance(tol) };
            for (name, error) in [
                ("oscillator", error(Oscillator { omega: 3.0 }, 2.0, 2, options())),
                ("linear", error(ScaledLinear { p: 2.0, q: 0.6 }, 2.0, 2, options())),
                ("jay", error(ScaledJay { c: 1.5, w: 0.8 }, 1.0, 2, options())),
                ("pendulum", error(pendulum(), 1.0, 4, options())),
            ] {
                println!("{name}, {stages} stages, {tol:e}: {error:.1e}");
                assert!(error <= 10.0 * tol, "{name}, {stages} stages, {tol:e}: {error:e}");
            }
        }
    }
}

/// Returns the error of the multiplier (the last component) and the largest error of its sensitivities p̄ S, each
/// relative to 1 plus the magnitude of the exact value.
fn multiplier_error<S: ParametricSample + Copy + 'static>(
    sample: S,
    options: RadauOptions,
) -> [f64; 2] {
    let (solver, sensitivities) = run(sample, 1.0, options);
    let last = solver.y().len() - 1;
    let exact = sample.exact(1.0).unwrap()[last];
    let own = (solver.y()[last] - exact).abs() / (1.0 + exact.abs());
    let of = (0..sample.parameters().len()).map(|j| {
        let (scale, exact) = (sample.parameters()[j].scale, sample.exact_sensitivity(j, 1.0)[last]);
        scale * (sensitivities.of(j)[last] - exact).abs() / (1.0 + scale * exact.abs())
    });
    [own, of.fold(0.0, f64::max)]
}

/// Checks that the errors of the sensitivities of multipliers are not larger than the error of collocation, which has
/// order s − 1. The solver removes the leading part of this error from the multiplier, which then has order s.
/// Therefore, if the multiplier has the error e, the error of the sensitivity is about e^((s−1)/s), with a factor of up
/// to ten.
#[test]
fn multipliers_of_index_3_have_sensitivities_as_good_as_their_own() {
    for stages in [3, 5, 7] {
        for tol in [1e-4, 1e-6, 1e-8] {
            let options = RadauOptions { stages, ..tolerance(tol) };
            let [own, of] = multiplier_error(pendulum(), options);
            println!("{stages} stages, {tol:e}: {own:.1e} {of:.1e}");
            let order_less = (stages as f64 - 1.0) / stages as f64;
            assert!(
                of <= 10.0 * own.max(tol).powf(order_less),
                "{stages} stages, {tol:e}: {own:e} {of:e}"
            );
        }
    }
}

/// The pendulum without its Jacobian.
#[derive(Clone, Copy)]
struct WithoutJacobian(Pendulum);

impl Problem for WithoutJacobian {
    fn n_unknowns(&self) -> usize {
        self.0.n_unknowns()
    }

    fn residual(&mut self, t: f64, y: &[f64], v: &[f64], r: &mut [f64]) -> Result<(), StepError> {
        self.0.residual(t, y, v, r)
    }

    fn indices(&self) -> Option<Vec<u8>> {
        self.0.indices()
    }
}

/// Regression test: errors of one-sided difference quotients, divided by h², caused an error of 20 % in the sensitivity
/// of the multiplier at a tolerance of 1e-11. With central differences, the errors are at most ten times as large as
/// with the exact Jacobian, or 1e-3.
#[test]
fn sensitivities_of_multipliers_do_not_need_a_jacobian() {
    let pendulum = pendulum();
    for stages in [3, 5, 7] {
        for tol in [1e-5, 1e-8, 1e-11] {
            let options = || RadauOptions { stages, ..tolerance(tol) };
            let [_, exact] = multiplier_error(pendulum, options());
            let start = pendulum.start();
            let mut solver = RadauSolver::builder(WithoutJacobian(pendulum))
                .options(options())
                .build(start.t, &start.y, &start.y_dot)
                .unwrap();
            let parameters = Differenced::new(
                pendulum.parameters(),
                |problem: &WithoutJacobian, j| problem.0.parameters()[j].value,
                |problem: &mut WithoutJacobian, j, value| problem.0.set(j, value),
            );
            let starts = (0..2).map(|j| pendulum.exact_sensitivity(j, 0.0)).collect();
            let mut own = ForwardSensitivities::new(&solver, parameters, starts).unwrap();
            own.integrate_to(&mut solver, 1.0).unwrap();
            for (j, parameter) in pendulum.parameters().iter().enumerate() {
                let expected = pendulum.exact_sensitivity(j, 1.0)[4];
                let error = parameter.scale * (own.of(j)[4] - expected).abs()
                    / (1.0 + parameter.scale * expected.abs());
                println!("{stages} stages, {tol:e}: {error:.1e}, exact Jacobian {exact:.1e}");
                assert!(error <= (10.0 * exact).max(1e-3), "{stages} {tol:e}: {error:e} {exact:e}");
            }
        }
    }
}

/// Returns options with fixed steps, in which Newton's method and the sensitivity equations converge up to rounding
/// errors.
fn fixed(stages: usize, h: f64) -> RadauOptions {
    RadauOptions {
        stages,
        tolerances: Tolerances::scalar(1e-12, 1e-12),
        tolerances_for_solution: false,
        newton_tolerance: Some(0.003),
        max_newton_iterations: Some(30),
        index_scaling: IndexScaling::All,
        step_size: StepSize::Fixed(h),
        ..RadauOptions::default()
    }
}

/// Checks that sensitivities in fixed steps have the same order as the states, because they are derivatives of the
/// discrete solution.
#[test]
fn orders_in_fixed_steps_are_those_of_the_states() {
    for (stages, n) in [(3, 10.0), (5, 1.0)] {
        let order = 2.0 * stages as f64 - 1.0;
        let of = |n: f64| error(ScaledLinear { p: 2.0, q: 0.6 }, 2.0, 1, fixed(stages, 2.0 / n));
        let observed = (of(n) / of(2.0 * n)).log2();
        println!("{stages} stages: {observed}, {:e}", of(2.0 * n));
        // If the step sizes are halved, the difference between the observed order and the limiting order is halved.
        assert!((observed - order).abs() < 1.0, "{stages} stages: {observed}");
    }
    // For index 3, positions and velocities have at least the stage order s.
    let of = |n: f64| error(pendulum(), 1.0, 4, fixed(3, 1.0 / n));
    let observed = (of(40.0) / of(80.0)).log2();
    assert!(observed > 2.5, "index 3: {observed}");
}

/// Checks that the sensitivities are derivatives of the computed solution: they agree with difference quotients of runs
/// with the same fixed steps much more closely than with the exact sensitivities.
#[test]
fn they_differentiate_the_computed_solution() {
    let (_, sensitivities) = run(pendulum(), 1.0, fixed(3, 0.02));
    let delta = 3e-4;
    let moved = |by: f64| {
        let sample = Pendulum::new(MechanicalForm::Index3).with(PENDULUM, 9.81 + by);
        crate::common::run(sample, 1.0, fixed(3, 0.02)).y().to_vec()
    };
    let (above, below) = (moved(delta), moved(-delta));
    let exact = pendulum().exact_sensitivity(1, 1.0);
    let (mut off, mut truth) = (0.0_f64, 0.0_f64);
    for i in 0..4 {
        let difference = (above[i] - below[i]) / (2.0 * delta);
        off = off.max((sensitivities.of(1)[i] - difference).abs());
        truth = truth.max((exact[i] - difference).abs());
    }
    println!("{off:e} {truth:e}");
    // For terms of size 1 to 10, three errors are below 1e-9: the truncation error (δ/g)², the error of Newton's
    // method, 3e-15, divided by δ, and the error of ∂F/∂p, 4e-11.
    assert!(off < 1e-8, "{off:e}");
    assert!(truth > 10.0 * off, "{truth:e} shows nothing");
}

/// Checks that all counters, including the number of factorizations, are the same as in a run without sensitivities.
#[test]
fn a_run_with_sensitivities_takes_the_steps_and_factors_of_the_plain_one() {
    let plain = crate::common::run(pendulum(), 1.0, tolerance(1e-6)).statistics();
    let (solver, sensitivities) = run(pendulum(), 1.0, tolerance(1e-6));
    assert_eq!(solver.statistics(), plain);
    let SensitivityWork { steps, jacobian_evaluations, parameter_derivatives, .. } =
        sensitivities.work();
    assert_eq!(steps, plain.steps);
    assert_eq!(jacobian_evaluations, 3 * steps);
    assert_eq!(parameter_derivatives, 2 * 3 * steps);
}

/// The equation ẏ = p sin 50t with p = 0. The state is at rest, and only its sensitivity (1 − cos 50t)/50 varies.
struct Resting(f64);

impl Problem for Resting {
    fn n_unknowns(&self) -> usize {
        1
    }

    fn residual(&mut self, t: f64, _: &[f64], v: &[f64], r: &mut [f64]) -> Result<(), StepError> {
        r[0] = v[0] - self.0 * (50.0 * t).sin();
        Ok(())
    }
}

/// Checks that the sensitivity of a state at rest is resolved only if the steps are also controlled by the sensitivity.
#[test]
fn sensitivities_optionally_limit_the_steps() {
    let run = |tol: f64, is_controlling: bool| {
        let mut solver = RadauSolver::builder(Resting(0.0))
            .options(tolerance(tol))
            .build(0.0, &[0.0], &[0.0])
            .unwrap();
        let list = vec![Parameter::new("p", 0.0)];
        let parameters = Differenced::new(
            list,
            |problem: &Resting, _| problem.0,
            |problem: &mut Resting, _, p| problem.0 = p,
        );
        let mut followed = ForwardSensitivities::new(&solver, parameters, vec![vec![0.0]]).unwrap();
        if is_controlling {
            followed = followed.controlling_steps(&solver);
        }
        let mut largest = 0.0_f64;
        while solver.t() < 2.0 {
            solver.step(2.0).unwrap();
            followed.follow(&mut solver).unwrap();
            let exact = (1.0 - (50.0 * solver.t()).cos()) / 50.0;
            largest = largest.max((followed.of(0)[0] - exact).abs());
        }
        largest
    };
    for tol in [1e-4, 1e-6, 1e-8] {
        let [alone, both] = [false, true].map(|is_controlling| run(tol, is_controlling));
        println!("{tol:e}: {alone:.1e} {both:.1e}");
        // The tolerance refers to a value of size 1. An error of a hundred tolerances is allowed.
        assert!(both < 100.0 * tol, "{tol:e}: {both:e}");
        assert!(alone > 1e-3, "{tol:e}: {alone:e} shows nothing");
    }
}

/// Checks that dense output agrees with the values at the ends of steps, and that it is accurate between them.
#[test]
fn dense_output_is_that_of_the_step() {
    let sample = Oscillator { omega: 3.0 };
    let mut solver = solver_of(sample, tolerance(1e-8));
    let mut sensitivities =
        ForwardSensitivities::new(&solver, sample.differenced(), vec![vec![0.0; 2]]).unwrap();
    let mut out = [0.0; 2];
    let mut before = vec![0.0; 2];
    while solver.t() < 1.0 {
        solver.step(1.0).unwrap();
        sensitivities.follow(&mut solver).unwrap();
        let [from, to] = solver.last_step_interval();
        sensitivities.dense_output(&solver, 0, from, 0, &mut out).unwrap();
        assert!((out[0] - before[0]).abs() < 1e-12);
        before = sensitivities.of(0).to_vec();
        let middle = 0.5 * (from + to);
        sensitivities.dense_output(&solver, 0, middle, 0, &mut out).unwrap();
        let exact = sample.exact_sensitivity(0, middle);
        // The order is s + 1, or s in the first step, whereas it is 2s − 1 at the ends of steps. Therefore, errors of
        // several hundred tolerances are allowed.
        assert!((out[0] - exact[0]).abs() < 1e-6, "{middle}: {}", out[0] - exact[0]);
    }
    let outside = sensitivities.dense_output(&solver, 0, 0.0, 0, &mut out);
    assert!(matches!(outside, Err(RadauError::Common(NoDenseOutput { .. }))));
}

#[test]
fn misuse_is_rejected() {
    let sample = Oscillator { omega: 3.0 };
    let mut solver = solver_of(sample, tolerance(1e-4));
    let new = |solver: &RadauSolver<_>, starts| {
        ForwardSensitivities::new(solver, sample.differenced(), starts)
    };
    assert!(matches!(
        new(&solver, vec![vec![0.0; 3]]).err(),
        Some(RadauError::Common(WrongLength { .. }))
    ));
    assert!(matches!(
        new(&solver, vec![vec![0.0, f64::NAN]]).err(),
        Some(RadauError::Common(NotFinite { .. }))
    ));
    let mut late = new(&solver, vec![vec![0.0; 2]]).unwrap();
    solver.step(1.0).unwrap();
    solver.step(1.0).unwrap();
    assert!(matches!(late.follow(&mut solver), Err(RadauError::Missed { steps: 2 })));
}

/// The Duffing equation ẍ + ẋ/5 + x + p x³ = cos 2t.
struct Duffing(f64);

impl Problem for Duffing {
    fn n_unknowns(&self) -> usize {
        2
    }

    fn residual(&mut self, t: f64, y: &[f64], v: &[f64], r: &mut [f64]) -> Result<(), StepError> {
        r[0] = v[0] - y[1];
        r[1] = v[1] + 0.2 * y[1] + y[0] + self.0 * y[0].powi(3) - (2.0 * t).cos();
        Ok(())
    }
}

/// Integrates a vibration over many periods with long steps. The sensitivities are nearly linear combinations of their
/// values in previous steps. With this initial guess, they need 1.2 corrections per step on average, compared with 2.05
/// corrections with an initial guess from polynomials.
#[test]
fn steps_of_a_vibration_start_from_those_before() {
    let options = RadauOptions { stages: 7, ..tolerance(1e-5) };
    let mut solver = RadauSolver::builder(Duffing(0.1))
        .options(options)
        .build(0.0, &[1.0, 0.0], &[0.0, -0.1])
        .unwrap();
    let list = vec![Parameter::new("p", 0.1)];
    let parameters = Differenced::new(
        list,
        |problem: &Duffing, _| problem.0,
        |problem: &mut Duffing, _, p| problem.0 = p,
    );
    let mut followed = ForwardSensitivities::new(&solver, parameters, vec![vec![0.0; 2]]).unwrap();
    followed.integrate_to(&mut solver, 200.0).unwrap();
    let SensitivityWork { steps, real_solves, .. } = followed.work();
    let corrections = real_solves as f64 / steps as f64;
    println!("{steps} steps, {corrections:.2} corrections each");
    assert!(steps > 50);
    assert!(corrections < 1.6, "{corrections}");
}

/// Returns a solver for the oscillator with steps of 0.1, and its sensitivity.
fn fixed_steps() -> (RadauSolver<Oscillator>, ForwardSensitivities<Differenced<Oscillator>>) {
    let oscillator = Oscillator { omega: 2.0 };
    let options = RadauOptions { step_size: StepSize::Fixed(0.1), ..RadauOptions::default() };
    run(oscillator, 0.0, options)
}

/// Regression test: after a `reinit`, the sensitivities missed steps or failed permanently, depending on the number of
/// previous steps.
#[test]
fn sensitivities_are_continued_over_a_reinit_on_request_only() {
    for steps in [1, 2, 5] {
        let (mut solver, mut followed) = fixed_steps();
        for _ in 0..steps {
            solver.step(10.0).unwrap();
            followed.follow(&mut solver).unwrap();
        }
        let (t, y, y_dot) = (solver.t(), solver.y().to_vec(), solver.y_dot().to_vec());
        let reached = vec![followed.of(0).to_vec()];
        solver.reinit(t, &y, &y_dot).unwrap();
        solver.step(10.0).unwrap();
        let refused = followed.follow(&mut solver);
        assert!(matches!(refused, Err(RadauError::StartedAgain { .. })), "{refused:?}");

        solver.reinit(t, &y, &y_dot).unwrap();
        followed.reinit(&solver, reached).unwrap();
        for _ in 0..3 {
            solver.step(10.0).unwrap();
            followed.follow(&mut solver).unwrap();
        }
        let exact = Oscillator { omega: 2.0 }.exact_sensitivity(0, solver.t());
        // The error of the method is 1e-6 for this step size.
        for (found, exact) in followed.of(0).iter().zip(exact) {
            assert!((found - exact).abs() < 1e-5, "{steps}: {found} {exact}");
        }
    }
}

/// Checks that sensitivities can start at the end of any step, for example from a restored state, but not within a
/// step.
#[test]
fn sensitivities_continue_from_a_restored_state() {
    let oscillator = Oscillator { omega: 2.0 };
    let (mut solver, mut followed) = run(oscillator, 0.5, tolerance(1e-8));
    while solver.t() < 1.0 {
        solver.step(10.0).unwrap();
        followed.follow(&mut solver).unwrap();
    }
    let (state, values) = (solver.save(), vec![followed.of(0).to_vec()]);
    followed.integrate_to(&mut solver, 3.0).unwrap();

    let (mut again, mut continued) = run(oscillator, 0.0, tolerance(1e-8));
    again.restore(&state).unwrap();
    continued.reinit(&again, values).unwrap();
    continued.integrate_to(&mut again, 3.0).unwrap();
    assert_eq!(solver.y(), again.y());
    for (one, other) in followed.of(0).iter().zip(continued.of(0)) {
        // The sensitivity equations are solved to a third of the tolerance, but with other initial guesses.
        assert!((one - other).abs() < 1e-7, "{one} {other}");
    }

    let start = oscillator.start();
    let root = |_: &mut Oscillator, _: f64, y: &[f64], _: &[f64], out: &mut [f64]| {
        out[0] = y[0];
        Ok(())
    };
    let mut paused = RadauSolver::builder(oscillator)
        .roots(vec![Direction::Both], root)
        .build(start.t, &start.y, &start.y_dot)
        .unwrap();
    assert!(matches!(paused.integrate_to(3.0).unwrap(), Outcome::Root { .. }));
    let refused = ForwardSensitivities::new(&paused, oscillator.differenced(), vec![vec![0.0; 2]]);
    assert!(matches!(refused.err(), Some(RadauError::Common(WithinStep { .. }))));
}

/// Checks that sensitivities and recordings cannot continue after a state was restored, which restarts the integration.
#[test]
fn a_restored_state_ends_what_follows_steps() {
    let (mut solver, mut followed) = fixed_steps();
    let mut recordings =
        [Recording::of_stages(&solver).unwrap(), Recording::of_checkpoints(&solver).unwrap()];
    let state = solver.save();
    for _ in 0..3 {
        solver.step(10.0).unwrap();
        followed.follow(&mut solver).unwrap();
        for recording in &mut recordings {
            recording.follow(&mut solver).unwrap();
        }
    }
    solver.restore(&state).unwrap();
    for _ in 0..3 {
        solver.step(10.0).unwrap();
    }
    let refused = followed.follow(&mut solver);
    assert!(matches!(refused, Err(RadauError::StartedAgain { .. })), "{refused:?}");
    for recording in &mut recordings {
        let refused = recording.follow(&mut solver);
        assert!(matches!(refused, Err(RadauError::StartedAgain { .. })), "{refused:?}");
    }
}

/// Regression test: parameters were reset to the values in a list created earlier.
#[test]
fn parameters_changed_before_the_start_keep_their_values() {
    let (before, after) = (Oscillator { omega: 2.0 }, Oscillator { omega: 3.0 });
    let mut solver = solver_of(before, tolerance(1e-8));
    let start = after.start();
    solver.problem_mut().omega = 3.0;
    solver.reinit(0.0, &start.y, &start.y_dot).unwrap();
    let starts = vec![after.exact_sensitivity(0, 0.0)];
    let mut followed = ForwardSensitivities::new(&solver, before.differenced(), starts).unwrap();
    followed.integrate_to(&mut solver, 1.0).unwrap();
    assert_eq!(solver.problem().omega, 3.0);
    // The error is 1e-8 per step, for several dozen steps, as in the tests above.
    assert!((solver.y()[0] - 3_f64.cos()).abs() < 1e-6);
    let exact = after.exact_sensitivity(0, 1.0);
    assert!((followed.of(0)[0] - exact[0]).abs() < 1e-6);
}
