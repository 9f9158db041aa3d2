//! Integrations, compared with published and exact solutions.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use myovib_conformance::samples::{
    Akzo, CarAxis, Heat2d, JayIndex2, LinearIndex1, MechanicalForm, Pendulum, Sample, VanDerPol,
};
use myovib_dae::{Outcome, StopReason, Suppressed, Tolerances};

use sundials_wrap::{ConsistencyMode, Constraint, IdaOptions, IdaSolver};

use crate::common::{HAS_KLU, numbers, reference};

/// Returns a solver that starts from the initial values of a sample, with an unlimited number of steps.
fn solver<S: Sample>(sample: S, options: IdaOptions) -> IdaSolver<S> {
    let start = sample.start();
    let options = IdaOptions { max_steps: None, ..options };
    IdaSolver::builder(sample).options(options).build(start.t, &start.y, &start.y_dot).unwrap()
}

fn tolerance(tolerance: f64) -> IdaOptions {
    IdaOptions { tolerances: Tolerances::scalar(tolerance, tolerance), ..IdaOptions::default() }
}

/// Returns the number of significant correct digits: −log10 of the largest relative error.
fn scd(y: &[f64], reference: &[f64]) -> f64 {
    -y.iter().zip(reference).map(|(y, r)| ((y - r) / r).abs()).fold(0.0, f64::max).log10()
}

/// The allowed ranges are based on runs of IDA 7.9 with a difference Jacobian: 58, 141 and 266 steps with 2.97, 4.97
/// and 6.47 digits. The exact Jacobian changes the number of steps by a few percent. The error of a single run may vary
/// by a factor of several, so the number of digits may differ by one.
#[test]
fn akzo_has_the_digits_of_published_runs() {
    let digits = numbers(&reference("s1_akzo")["ref"]);
    for (tol, steps, accuracy) in [(1e-4, 58.0, 2.97), (1e-6, 141.0, 4.97), (1e-8, 266.0, 6.47)] {
        let mut solver = solver(Akzo, tolerance(tol));
        assert_eq!(solver.integrate_to(180.0).unwrap(), Outcome::Reached { t: 180.0 });
        let ours = scd(solver.y(), &digits);
        assert!((ours - accuracy).abs() < 1.0, "tolerance {tol}: {ours} digits");
        let ratio = solver.statistics().steps as f64 / steps;
        assert!(
            (0.8..1.2).contains(&ratio),
            "tolerance {tol}: {} steps",
            solver.statistics().steps
        );
    }
}

/// SUNDIALS' example idasAkzoNob_dns, with the quadrature in the error test. The example uses a dense solver and a
/// difference Jacobian. Its counters are the same as with KLU and the exact Jacobian here.
#[test]
fn akzo_quadrature_agrees_with_the_published_run() {
    let reference = reference("s1_akzo");
    let run = reference["published_run"].clone();
    let setting = |key: &str| run[key].as_f64().unwrap();
    let start = Akzo.start();
    let mut solver = IdaSolver::builder(Akzo)
        .options(IdaOptions {
            tolerances: Tolerances::scalar(setting("rtol"), setting("atol")),
            max_steps: None,
            ..IdaOptions::default()
        })
        .quadrature([0.0], Some((setting("rtol_q"), setting("atol_q"))), |_, _, y, _, rates| {
            rates[0] = y[0];
            Ok(())
        })
        .build(start.t, &start.y, &start.y_dot)
        .unwrap();
    assert_eq!(solver.integrate_to(180.0).unwrap(), Outcome::Reached { t: 180.0 });
    let mut integral = [f64::NAN];
    solver.quadrature(&mut integral).unwrap();
    let exact = reference["G_180"].as_f64().unwrap();
    // At this tolerance, y has about seven digits, and so does its integral.
    assert!((integral[0] / exact - 1.0).abs() < 1e-7, "{integral:?} ≠ {exact}");
    let mut rate = [f64::NAN];
    solver.quadrature_dense_output(180.0, 1, &mut rate).unwrap();
    assert!((rate[0] / solver.y()[0] - 1.0).abs() < 1e-5, "q̇ = {rate:?} is the integrand");
    // The numbers of residual evaluations are not compared, because the published numbers include evaluations for
    // difference Jacobians.
    let stats = solver.statistics();
    let counters = [
        ("steps", stats.steps),
        ("newton_iterations", stats.newton_iterations),
        ("jacobian_evaluations", stats.jacobian_evaluations),
        ("error_test_failures", stats.error_test_failures),
        ("newton_failures", stats.newton_failures),
    ];
    for (key, ours) in counters {
        assert_eq!(ours, run[key].as_u64().unwrap(), "{key}");
    }
}

/// SUNDIALS' example idaHeat2D_klu: with the same settings (default KLU, constraints u ≥ 0), the printed digits and the
/// counters agree.
#[test]
fn heat_equation_reproduces_the_published_run() {
    let reference = reference("s5_heat2d");
    let published = &reference["published_klu"];
    let options = IdaOptions {
        tolerances: Tolerances::scalar(0.0, published["atol"].as_f64().unwrap()),
        constraints: vec![Constraint::NonNegative; 100],
        ..IdaOptions::default()
    };
    let mut solver = solver(Heat2d::new(10), options);
    solver.correct_initial_values(ConsistencyMode::AlgebraicAndDerivatives, 0.01).unwrap();
    let maximum = |u: &[f64]| u.iter().copied().fold(f64::MIN, f64::max);
    let (times, maxima) = (numbers(&published["t"]), numbers(&published["umax"]));
    for (row, (&t, &umax)) in times.iter().zip(&maxima).enumerate().skip(1) {
        assert_eq!(solver.integrate_to(t).unwrap(), Outcome::Reached { t });
        // The published values are printed with six digits.
        let ours = maximum(solver.y());
        assert!((ours / umax - 1.0).abs() < 5e-6, "t = {t}: {ours} ≠ {umax}");
        let stats = solver.statistics();
        assert_eq!(stats.steps, published["nst"][row].as_u64().unwrap(), "t = {t}");
        // The published count includes two evaluations by IDACalcIC, which this crate does not use here.
        let published = published["nje"][row].as_u64().unwrap();
        assert_eq!(stats.jacobian_evaluations + 2, published, "t = {t}");
    }
    let stats = solver.statistics();
    assert_eq!(stats.error_test_failures, published["netf"].as_u64().unwrap());
    assert_eq!(stats.newton_failures, published["ncfn"].as_u64().unwrap());
}

/// Compares the solution with the matrix exponential of the same semi-discrete system.
#[test]
fn heat_equation_is_accurate_at_a_tight_tolerance() {
    let tol = 1e-12;
    let mut solver = solver(Heat2d::new(10), tolerance(tol));
    for row in reference("s5_heat2d")["exact"].as_array().unwrap() {
        solver.integrate_to(row["t"].as_f64().unwrap()).unwrap();
        let maximum = solver.y().iter().copied().fold(f64::MIN, f64::max);
        for (ours, key) in [(maximum, "umax"), (solver.y()[11], "u_1_1")] {
            let error = (ours - row[key].as_f64().unwrap()).abs();
            // The local errors of several hundred steps are damped by diffusion.
            assert!(error < 1e2 * tol, "{row}: error {error:e} in {key}");
        }
    }
}

/// The published errors are reproduced to three digits, or to a factor of 2 where rounding dominates. KLU scales the
/// rows. Without KLU, rounding differs, and the error (7.6e-12 at 1e-11, with 6.4.1 and 7.1.1) is thirty times smaller.
#[test]
fn linear_index_1_errors_are_the_published_ones() {
    let published = reference("s4_exact_daes")["A"]["published_ida_errors"].clone();
    let runs = numbers(&published["rtol"]).into_iter().zip(numbers(&published["error"]));
    let exact = LinearIndex1.exact(10.0).unwrap();
    for (tol, theirs) in runs.step_by(4) {
        let mut solver = solver(LinearIndex1, tolerance(tol));
        assert_eq!(solver.integrate_to(10.0).unwrap(), Outcome::Reached { t: 10.0 });
        let ours = distance(solver.y(), &exact);
        let factor = if tol > 1e-8 { 1.001 } else { 2.0 };
        let is_theirs = theirs < factor * ours || (tol < 1e-8 && !HAS_KLU);
        assert!(
            ours < factor * theirs && is_theirs,
            "{tol}: {ours} ≠ {theirs}: {:?}",
            solver.statistics()
        );
    }
}

/// For a short smooth problem of index 2, the errors of y are within two powers of ten of the tolerance (a few hundred
/// steps) and decrease with the tolerance. The error of z, which is excluded from the error test, decreases more
/// slowly.
#[test]
fn index_2_errors_follow_the_tolerance() {
    let exact = JayIndex2.exact(1.0).unwrap();
    let (mut last_y, mut last_z) = (f64::INFINITY, f64::INFINITY);
    for tol in [1e-4, 1e-6, 1e-8] {
        let options = IdaOptions { suppressed: Suppressed::Algebraic, ..tolerance(tol) };
        let mut solver = solver(JayIndex2, options);
        assert_eq!(solver.integrate_to(1.0).unwrap(), Outcome::Reached { t: 1.0 });
        let error_y = distance(&solver.y()[..2], &exact[..2]);
        let error_z = (solver.y()[2] - exact[2]).abs();
        assert!(error_y < 1e2 * allowed(tol, &exact), "tolerance {tol}: error {error_y:e}");
        assert!(error_y < 0.1 * last_y, "tolerance {tol}: error {error_y:e} after {last_y:e}");
        assert!(error_z < 0.5 * last_z, "tolerance {tol}: error {error_z:e} after {last_z:e}");
        (last_y, last_z) = (error_y, error_z);
    }
}

/// Returns the allowed error, relative to the largest component.
fn allowed(tol: f64, y: &[f64]) -> f64 {
    tol * (1.0 + y.iter().fold(0.0, |m: f64, v| m.max(v.abs())))
}

fn distance(y: &[f64], exact: &[f64]) -> f64 {
    y.iter().zip(exact).map(|(y, e)| (y - e).powi(2)).sum::<f64>().sqrt()
}

/// If the multiplier is included in the error test, BDF cannot integrate the index-3 form: the estimate of the local
/// error of λ does not decrease with the step size. The solver must stop early and report the reason.
#[test]
fn the_index_3_pendulum_stops_with_a_reason() {
    for tol in [1e-4, 1e-6, 1e-8] {
        let mut solver = solver(Pendulum::new(MechanicalForm::Index3), tolerance(tol));
        let Outcome::Stopped(stop) = solver.integrate_to(2.0).unwrap() else {
            panic!("tolerance {tol}: went through")
        };
        assert!(
            matches!(stop.reason, StopReason::ErrorTestFailures | StopReason::StepTooSmall),
            "{stop}"
        );
        assert!(stop.t < 0.1 && stop.t == solver.t(), "{stop}");
        assert_eq!(stop.statistics, solver.statistics());
        assert!(stop.statistics.error_test_failures >= 10, "{stop}");
        assert_eq!(stop.worst_components[0].index, 4, "λ is to blame: {stop}");
        assert!(stop.worst_components[0].weighted_error > 1.0, "{stop}");
    }
}

/// If λ is excluded from the error test, the run succeeds with loose tolerances. With tighter tolerances, the number of
/// steps becomes too large. Formulations of lower index are more accurate. The errors refer to the positions at t = 2.
#[test]
fn the_pendulum_goes_through_in_every_form_without_its_multiplier_in_the_error_test() {
    let tol = 1e-4;
    for form in [MechanicalForm::Index3, MechanicalForm::Index2, MechanicalForm::Stabilized] {
        let pendulum = Pendulum::new(form);
        let options = IdaOptions { suppressed: Suppressed::Algebraic, ..tolerance(tol) };
        let mut solver = solver(pendulum, options);
        assert_eq!(solver.integrate_to(2.0).unwrap(), Outcome::Reached { t: 2.0 });
        let error = distance(&solver.y()[..2], &pendulum.exact(2.0).unwrap()[..2]);
        // The bound covers the tolerance per step, for most of a period.
        assert!(error < 1e2 * tol, "{form:?}: {error:e}");
        let y = solver.y();
        let drift = (y[0] * y[0] + y[1] * y[1] - 1.0).abs();
        let bound = if form == MechanicalForm::Index2 { 1e2 * tol } else { tol };
        assert!(drift < bound, "{form:?}: drift {drift:e}");
    }
}

/// IDA 7.9 with a difference Jacobian and unweighted multipliers takes 846, 1876 and 3630 steps for index 2 (2.2, 3.9
/// and 6.1 mixed digits), and 866, 1780 and 3636 steps for the stabilized form (2.6, 3.6 and 6.0 digits). The
/// integration of the index-3 form fails at t = 0.23, or its step size collapses.
#[test]
fn car_axis_behaves_as_published_in_every_form() {
    let reference = numbers(&reference("s2_caraxis")["ref"]);
    let run = |form, tol: f64| {
        let car = CarAxis::new(form);
        let start = car.start();
        let mut absolute = vec![tol; 8];
        absolute.resize(start.y.len(), 1e10);
        let options = IdaOptions {
            tolerances: Tolerances::vector(tol, absolute),
            max_steps: Some(5000),
            ..IdaOptions::default()
        };
        let builder = IdaSolver::builder(car).options(options);
        let mut solver = builder.build(start.t, &start.y, &start.y_dot).unwrap();
        let outcome = solver.integrate_to(3.0).unwrap();
        let mixed = |(y, r): (&f64, &f64)| ((y - r) / (r.abs() + 1.0)).abs();
        let error = solver.y()[..8].iter().zip(&reference).map(mixed).fold(0.0, f64::max);
        (outcome, solver.statistics().steps as f64, -error.log10())
    };
    let published = [
        (MechanicalForm::Index2, 1e-4, 846.0, 2.2),
        (MechanicalForm::Index2, 1e-6, 1876.0, 3.9),
        (MechanicalForm::Index2, 1e-8, 3630.0, 6.1),
        (MechanicalForm::Stabilized, 1e-4, 866.0, 2.6),
        (MechanicalForm::Stabilized, 1e-6, 1780.0, 3.6),
        (MechanicalForm::Stabilized, 1e-8, 3636.0, 6.0),
    ];
    for (form, tol, steps, digits) in published {
        let (outcome, our_steps, our_digits) = run(form, tol);
        assert_eq!(outcome, Outcome::Reached { t: 3.0 }, "{form:?}, {tol}");
        assert!((0.8..1.2).contains(&(our_steps / steps)), "{form:?}, {tol}: {our_steps} steps");
        // The errors of single runs may vary by a factor of several.
        assert!((our_digits - digits).abs() < 1.0, "{form:?}, {tol}: {our_digits} digits");
    }
    let (outcome, ..) = run(MechanicalForm::Index3, 1e-4);
    let Outcome::Stopped(stop) = outcome else { panic!("index 3 went through") };
    assert!((0.2..0.3).contains(&stop.t), "{stop}");
    assert_eq!(stop.reason, StopReason::ErrorTestFailures);
}

/// Returns the number of steps and the error of the states. Multipliers are excluded from the error test. The error of
/// a variable of index i is weighted by (Ωh)^(i−1), also in Newton's method.
fn step_scaled<S: Sample + Clone>(
    sample: &S,
    (omega, tol): (f64, f64),
    t_end: f64,
    exact: &[f64],
) -> (f64, f64) {
    let h = Arc::new(AtomicU64::new(0));
    let size = Arc::clone(&h);
    let (start, indices) = (sample.start(), sample.indices().unwrap());
    let options = IdaOptions {
        suppressed: Suppressed::Algebraic,
        stop_time: Some(t_end),
        max_steps: Some(5000),
        ..IdaOptions::default()
    };
    let mut solver = IdaSolver::builder(sample.clone())
        .options(options)
        .error_weights(move |_, y, weights| {
            let h = f64::from_bits(size.load(Ordering::Relaxed));
            // The first step size has not been chosen yet.
            let scale = if h == 0.0 { 1.0 } else { (omega * h).min(1.0) };
            for (i, weight) in weights.iter_mut().enumerate() {
                *weight = scale.powi(i32::from(indices[i]) - 1) / (tol * (1.0 + y[i].abs()));
            }
            Ok(())
        })
        .build(start.t, &start.y, &start.y_dot)
        .unwrap();
    let outcome = loop {
        h.store(solver.current_step().to_bits(), Ordering::Relaxed);
        let outcome = solver.step(t_end).unwrap();
        if !matches!(outcome, Outcome::StepTaken { .. }) {
            break outcome;
        }
    };
    assert_eq!(outcome, Outcome::StopTime { t: t_end });
    let error = distance(&solver.y()[..exact.len()], exact);
    (solver.statistics().steps as f64, error)
}

/// Integrates the index-3 forms at order 5. With constant weights, the integrations fail or take tiny steps. With
/// scaled weights, the number of steps is within a factor of 1.5 of index 2, and the errors follow the tolerance.
#[test]
fn index_3_is_solved_with_weights_scaled_by_the_step() {
    fn check<S: Sample + Clone>(sample: &S, omega: f64, t: f64, exact: &[f64], index_2: [f64; 3]) {
        let mut errors = Vec::new();
        for (tol, index_2) in [1e-4, 1e-6, 1e-8].into_iter().zip(index_2) {
            let (steps, error) = step_scaled(sample, (omega, tol), t, exact);
            assert!(steps < 1.5 * index_2, "{tol}: {steps} steps");
            errors.push(error);
        }
        // The run must have at least half of the digits requested by the tolerances.
        assert!(errors[0] > errors[1] && errors[1] > errors[2], "{errors:?}");
        assert!(errors[2] < 1e-2 * errors[0], "{errors:?}");
    }
    // The angular frequency of the road is 10 rad/s. The numbers of steps for index 2 are the published numbers.
    let end = numbers(&reference("s2_caraxis")["ref"]);
    let car = CarAxis::new(MechanicalForm::Index3);
    check(&car, 10.0, 3.0, &end[..8], [846.0, 1876.0, 3630.0]);
    // A small oscillation has the angular frequency √g.
    let pendulum = Pendulum::new(MechanicalForm::Index3);
    let end = pendulum.exact(2.0).unwrap();
    let omega = 9.81_f64.sqrt();
    check(&pendulum, omega, 2.0, &end[..4], [181.0, 427.0, 861.0]);
}

#[test]
fn van_der_pol_reaches_the_published_state() {
    let published = reference("s9_oscillators")["vdpolm"].clone();
    let vdp_mu = published["vdp_mu"].as_f64().unwrap();
    let mut solver = solver(VanDerPol { vdp_mu }, tolerance(1e-10));
    let t = published["t"].as_f64().unwrap();
    assert_eq!(solver.integrate_to(t).unwrap(), Outcome::Reached { t });
    let digits = scd(solver.y(), &numbers(&published["y"]));
    assert!(digits > 6.0, "{digits} digits"); // jumps of 1/μ amplify the tolerance by about 1e3
}
