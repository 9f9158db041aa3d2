//! Quadratures integrated together with the solution: order of convergence, and continuation from a saved state and
//! after a root.

use myovib_conformance::AnyProblem;
use myovib_conformance::samples::{JayIndex2, Sample};
use myovib_dae::{Direction, Outcome, Tolerances};
use myovib_radau::{RadauOptions, RadauSolver, RadauState, StepSize};

use crate::common::{Oscillator, radau};

fn solver(options: RadauOptions) -> RadauSolver<AnyProblem> {
    let start = Oscillator.start();
    radau(Oscillator)
        .options(options)
        .quadrature([0.0], |_, _, y, v, g| {
            g[0] = y[0] * y[0] * v[0];
            Ok(())
        })
        .build(0.0, &start.y, &start.y_dot)
        .unwrap()
}

/// ∫ x² ẋ dt = (x³(t) − x³(0))/3.
fn exact(t: f64) -> f64 {
    let x = |t: f64| Oscillator.exact(t).unwrap()[0];
    (x(t).powi(3) - x(0.0).powi(3)) / 3.0
}

/// Checks the order of a quadrature with fixed steps. At the ends of steps, it is the order of the method, 2s − 1.
/// Within a first step, it is the order of dense output, s + 1.
#[test]
fn quadratures_have_the_order_of_the_method() {
    // The steps are long, so that the error exceeds rounding. With seven stages and a step of 0.25, the error would be
    // 3e-16, and the observed order would be 10 instead of 13.
    for (stages, h) in [(3, 0.2), (5, 0.5), (7, 4.0 / 3.0)] {
        let errors = [h, 0.5 * h].map(|h| {
            let mut solver = solver(RadauOptions {
                stages,
                tolerances: Tolerances::scalar(1e-12, 1e-12),
                newton_tolerance: Some(1e-3),
                max_newton_iterations: Some(30),
                step_size: StepSize::Fixed(h),
                ..RadauOptions::default()
            });
            let (mut q, mut within) = ([0.0], 0.0_f64);
            while solver.t() < 4.0 - 0.1 * h {
                solver.step(4.0).unwrap();
                let [from, to] = solver.last_step_interval();
                for k in 1..10 {
                    let t = from + 0.1 * f64::from(k) * (to - from);
                    solver.quadrature_dense_output(t, 0, &mut q).unwrap();
                    within = within.max((q[0] - exact(t)).abs());
                }
            }
            solver.quadrature(&mut q).unwrap();
            let statistics = solver.statistics();
            assert_eq!(statistics.quadrature_evaluations, stages as u64 * statistics.steps);
            [(q[0] - exact(solver.t())).abs(), within]
        });
        let order = |k: usize| (errors[0][k] / errors[1][k]).log2();
        // With long steps, the observed order differs by up to a tenth.
        let (method, s) = (2.0 * stages as f64 - 1.0, stages as f64);
        println!("s = {stages}: {:.2} {:.2} {errors:?}", order(0), order(1));
        assert!(order(0) > 0.9 * method, "s = {stages}: {}", order(0));
        // There is no step before the first step, so the order is lower by one.
        let dense = s + 1.0;
        assert!(order(1) > 0.9 * dense, "s = {stages}: {}", order(1));
    }
}

/// The integrand uses the multiplier after removal of its leading error, as the output does: ∫ z = e² ᵗ/2.
#[test]
fn integrals_of_multipliers_use_their_output_values() {
    let start = JayIndex2.start();
    let mut solver = radau(JayIndex2)
        .tolerances(Tolerances::scalar(1e-6, 1e-6))
        .quadrature([0.5], |_, _, y, _, g| {
            g[0] = y[2];
            Ok(())
        })
        .build(0.0, &start.y, &start.y_dot)
        .unwrap();
    solver.integrate_to(1.0).unwrap();
    let mut q = [0.0];
    solver.quadrature(&mut q).unwrap();
    let exact = 0.5 * 2.0_f64.exp();
    let off = (solver.y()[2] - 2.0 * exact).abs();
    // The error is at most the error of the multiplier at the end or the tolerance, times the time of 1.
    assert!((q[0] - exact).abs() < off.max(1e-5), "{q:?} {exact}, z {off:e}");
}

/// Checks that quadratures are saved bitwise with the state, and that they continue after a root and after a restart at
/// a root.
#[test]
fn quadratures_go_on_from_saved_states_and_from_roots() {
    let options =
        || RadauOptions { tolerances: Tolerances::scalar(1e-8, 1e-8), ..RadauOptions::default() };
    let (mut whole, mut part) = (solver(options()), solver(options()));
    for _ in 0..7 {
        whole.step(10.0).unwrap();
        part.step(10.0).unwrap();
    }
    let text = serde_json::to_string(&part.save()).unwrap();
    let state: RadauState = serde_json::from_str(&text).unwrap();
    let mut part = solver(options());
    part.restore(&state).unwrap();
    let [mut of_whole, mut of_part] = [[0.0]; 2];
    for _ in 0..7 {
        whole.step(10.0).unwrap();
        part.step(10.0).unwrap();
        whole.quadrature(&mut of_whole).unwrap();
        part.quadrature(&mut of_part).unwrap();
        assert_eq!(of_whole, of_part);
    }

    let start = Oscillator.start();
    let mut watched = radau(Oscillator)
        .options(options())
        .quadrature([0.0], |_, _, y, v, g| {
            g[0] = y[0] * y[0] * v[0];
            Ok(())
        })
        .roots([Direction::Both], |_, _, y, _, g| {
            g[0] = y[0] - 0.5;
            Ok(())
        })
        .build(0.0, &start.y, &start.y_dot)
        .unwrap();
    let mut q = [0.0];
    for restarts in [false, true] {
        let Outcome::Root { t, .. } = watched.integrate_to(10.0).unwrap() else {
            panic!("no root");
        };
        watched.quadrature(&mut q).unwrap();
        // The bound covers about a hundred steps with an error of 1e-8 each, plus the error of dense output.
        assert!((q[0] - exact(t)).abs() < 1e-6, "{q:?} {}", exact(t));
        if restarts {
            watched.restart();
        }
    }
    watched.integrate_to(10.0).unwrap();
    let t = watched.t();
    watched.quadrature(&mut q).unwrap();
    assert!((q[0] - exact(t)).abs() < 1e-6, "{q:?} {}", exact(t));
}
