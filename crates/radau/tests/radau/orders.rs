//! Observed orders of convergence with fixed steps, including the orders of dense output (shared cases S4).

use myovib_conformance::samples::{JayIndex2, LinearIndex1, MechanicalForm, Pendulum, Sample};
use myovib_dae::IntegratorError::{NoDenseOutput, WrongLength};
use myovib_dae::{Problem, Tolerances};
use myovib_radau::{IndexScaling, RadauError, RadauOptions, StepSize};

use crate::common::{Oscillator, radau, run, solver};
use crate::failures::well_behaved;

/// Returns options with fixed steps, in which Newton's method converges up to rounding errors.
fn fixed(h: f64) -> RadauOptions {
    RadauOptions {
        tolerances: Tolerances::scalar(1e-12, 1e-12),
        tolerances_for_solution: false,
        newton_tolerance: Some(0.003),
        max_newton_iterations: Some(30),
        index_scaling: IndexScaling::All,
        step_size: StepSize::Fixed(h),
        ..RadauOptions::default()
    }
}

/// Returns the errors at `t_end` after n steps.
fn errors<S: Sample + 'static>(sample: S, t_end: f64, options: RadauOptions) -> Vec<f64> {
    let exact = sample.exact(t_end).expect("the sample has an exact solution");
    let solver = run(sample, t_end, options);
    solver.y().iter().zip(exact).map(|(y, exact)| (y - exact).abs()).collect()
}

/// Returns log2 of the ratio of the errors with n steps to the errors with 2n steps, component by component.
fn orders(errors: impl Fn(f64) -> Vec<f64>, n: f64) -> Vec<f64> {
    let (coarse, fine) = (errors(n), errors(2.0 * n));
    coarse.iter().zip(fine).map(|(coarse, fine)| (coarse / fine).log2()).collect()
}

/// Compares orders with a tolerance of ±0.25. If the step sizes are halved, the difference between the observed order
/// and the limiting order is halved. The errors for the chosen step sizes are much larger than rounding errors.
fn assert_orders(observed: &[f64], expected: &[f64]) {
    println!("{observed:.2?}");
    for (i, (observed, expected)) in observed.iter().zip(expected).enumerate() {
        assert!((observed - expected).abs() < 0.25, "y[{i}]: order {observed}, not {expected}");
    }
}

#[test]
fn linear_index_1_has_the_order_of_the_method() {
    for (stages, n) in [(1, 160.0), (3, 10.0), (5, 20.0)] {
        let errors = |n: f64| {
            let options = RadauOptions { stages, ..fixed(10.0 / n) };
            // y2 is determined by an algebraic equation and is exact.
            errors(LinearIndex1, 10.0, options)[..1].to_vec()
        };
        assert_orders(&orders(errors, n), &[(2 * stages - 1) as f64]);
    }
}

#[test]
fn an_ode_has_the_order_of_the_method() {
    for (stages, n) in [(1, 2000.0), (3, 40.0), (5, 10.0), (7, 5.0)] {
        let errors = |n: f64| {
            let options = RadauOptions { stages, ..fixed(10.0 / n) };
            errors(Oscillator, 10.0, options)
        };
        assert_orders(&orders(errors, n), &[(2 * stages - 1) as f64; 2]);
    }
}

/// The multiplier has order 3 with collocation alone, and order 4 after removal of the leading error.
#[test]
fn jay_index_2_has_orders_5_and_4() {
    for n in [20.0, 40.0] {
        let errors = |n: f64| errors(JayIndex2, 1.0, fixed(1.0 / n));
        assert_orders(&orders(errors, n), &[5.0, 5.0, 4.0]);
    }
}

/// The multiplier has order 2 with collocation alone, and order 3 after removal of the leading error.
#[test]
fn pendulum_index_3_has_orders_5_and_3() {
    let pendulum = Pendulum::new(MechanicalForm::Index3);
    for n in [25.0, 50.0] {
        let states = |n: f64| errors(pendulum, 1.0, fixed(1.0 / n))[..4].to_vec();
        assert_orders(&orders(states, n), &[5.0, 5.0, 3.0, 3.0]);
        // With twice as many steps, positions are already exact.
        let multiplier = |n: f64| errors(pendulum, 1.0, fixed(0.5 / n))[4..].to_vec();
        assert_orders(&orders(multiplier, n), &[3.0]);
    }
}

/// Velocities have order s, and multipliers have order s + 1 for index 2 and s for index 3. Variables of order 2s − 1
/// are exact up to rounding errors with these steps.
#[test]
fn five_stages_have_orders_6_and_5_in_higher_index() {
    let five = |n: f64| RadauOptions { stages: 5, ..fixed(1.0 / n) };
    let jay = |n: f64| errors(JayIndex2, 1.0, five(n))[2..].to_vec();
    assert_orders(&orders(jay, 16.0), &[6.0]);
    let pendulum = Pendulum::new(MechanicalForm::Index3);
    // Because of rounding errors of λ, Newton's method cannot reach the tolerance of 3e-15 in `fixed`.
    let pendulum = |n: f64| {
        let options = RadauOptions { newton_tolerance: Some(0.1), ..five(n) };
        errors(pendulum, 1.0, options)[2..].to_vec()
    };
    assert_orders(&orders(pendulum, 20.0), &[5.0, 5.0, 5.0]);
}

/// Returns the largest errors of the dense output and of its derivative in the last of n steps up to `t_end`. The
/// points are far from the roots of the ramp (0.4 for three stages).
fn dense_errors<P: Problem + 'static>(
    problem: P,
    (y0, y_dot0): (&[f64], &[f64]),
    (stages, n): (usize, f64),
    t_end: f64,
    exact: impl Fn(f64) -> [f64; 2],
) -> Vec<f64> {
    let h = t_end / n;
    let mut solver =
        radau(problem).options(RadauOptions { stages, ..fixed(h) }).build(0.0, y0, y_dot0).unwrap();
    solver.integrate_to(t_end).unwrap();
    let mut out = vec![0.0; y0.len()];
    let mut largest = vec![0.0; 2];
    for theta in [0.1, 0.2, 0.55, 0.8] {
        let t = t_end - (1.0 - theta) * h;
        for (derivative, largest) in largest.iter_mut().enumerate() {
            solver.dense_output(t, derivative, &mut out).unwrap();
            *largest = f64::max(*largest, (out[0] - exact(t)[derivative]).abs());
        }
    }
    largest
}

#[test]
fn dense_output_of_an_ode_has_two_orders_more_than_stages() {
    let errors = |n: f64| {
        dense_errors(well_behaved(), (&[0.0], &[1.0]), (3, n), 0.5, |t| {
            let y = (2f64.sqrt() * t).tanh() / 2f64.sqrt();
            [y, 1.0 - 2.0 * y * y]
        })
    };
    assert_orders(&orders(errors, 16.0), &[5.0, 4.0]);
}

#[test]
fn dense_output_of_a_dae_has_one_order_more_than_stages_at_least() {
    // At the ends of steps, ẏ1 has only the stage order here, because it contains the algebraic variable y2 through ẏ2.
    for (stages, n) in [(3, 16.0), (5, 16.0)] {
        let errors = |n: f64| {
            let start = LinearIndex1.start();
            let initial = (&start.y[..], &start.y_dot[..]);
            dense_errors(LinearIndex1, initial, (stages, n), 2.0, |t| {
                [(-t).exp() + t * t.sin(), t.sin() + t * t.cos() - (-t).exp()]
            })
        };
        let order = stages as f64 + 1.0;
        assert_orders(&orders(errors, n), &[order, order - 1.0]);
    }
}

#[test]
fn dense_output_joins_steps_with_a_continuous_derivative() {
    let mut solver = solver(JayIndex2, fixed(0.05));
    let mut ends = [[0.0; 3], [0.0; 3]];
    for end in &mut ends {
        solver.step(1.0).unwrap();
        let before = solver.y_dot().to_vec();
        solver.step(1.0).unwrap();
        solver.dense_output(solver.t() - 0.05, 1, end).unwrap();
        // Only differential variables are compared.
        for (a, b) in end.iter().zip(&before).take(2) {
            // The bound covers rounding errors divided by h and amplified by the derivatives of the basis polynomials.
            assert!((a - b).abs() < 1e-12 * (1.0 + b.abs()), "{a} {b}");
        }
    }
}

/// In Jay's problem, z is algebraic. As ż does not occur in the equations, it may be 0 at the start.
#[test]
fn dense_output_of_the_first_step_needs_no_derivative_of_algebraic_variables() {
    let errors = |n: f64| {
        let h = 1.0 / n;
        let start = JayIndex2.start();
        let mut solver = radau(JayIndex2)
            .options(fixed(h))
            .build(0.0, &start.y, &[start.y_dot[0], start.y_dot[1], 0.0])
            .unwrap();
        solver.step(1.0).unwrap();
        let mut out = [0.0; 3];
        let mut error = |derivative, exact: f64| {
            solver.dense_output(0.4 * h, derivative, &mut out).unwrap();
            (out[2] - exact).abs()
        };
        let z = JayIndex2.exact(0.4 * h).unwrap()[2];
        vec![error(0, z), error(1, 2.0 * z)]
    };
    // The exact derivative is ż = 2z. The values have the same order as at the ends of steps, s + 1, and the order of
    // the derivatives is lower by one. With longer steps, Newton's method would initially diverge because of the
    // inconsistent ż.
    assert_orders(&orders(errors, 160.0), &[4.0, 3.0]);
}

#[test]
fn dense_output_is_refused_outside_the_last_step_and_beyond_the_first_derivative() {
    let solver = run(JayIndex2, 1.0, fixed(0.05));
    let mut out = [0.0; 3];
    for (t, derivative) in [(0.94, 0), (1.01, 0), (0.97, 2)] {
        let refused = solver.dense_output(t, derivative, &mut out);
        assert!(
            matches!(refused, Err(RadauError::Common(NoDenseOutput { to: 1.0, .. }))),
            "{refused:?}"
        );
    }
    let refused = solver.dense_output(0.97, 0, &mut out[..2]);
    assert!(matches!(refused, Err(RadauError::Common(WrongLength { expected: 3, got: 2, .. }))));
}
