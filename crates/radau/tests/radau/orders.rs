//! Observed orders at fixed steps, and of the dense output (shared cases S4).

use myovib_radau::{RadauError, RadauOptions, StepSize};
use sundials_wrap::Tolerances;
use sundials_wrap::samples::{JayIndex2, LinearIndex1, MechanicalForm, Pendulum, Sample};

use crate::common::run;

/// Fixed steps, Newton converged as far as rounding allows.
fn fixed(h: f64) -> RadauOptions {
    RadauOptions {
        tolerances: Tolerances::scalar(1e-12, 1e-12),
        tolerances_for_solution: false,
        newton_tolerance: Some(0.003),
        max_newton_iterations: Some(30),
        step_size: StepSize::Fixed(h),
        ..RadauOptions::default()
    }
}

/// The errors at `t_end` after n steps.
fn errors<S: Sample>(sample: S, t_end: f64, options: RadauOptions) -> Vec<f64> {
    let exact = sample
        .exact(t_end)
        .expect("the sample has an exact solution");
    let solver = run(sample, t_end, options);
    solver
        .y()
        .iter()
        .zip(exact)
        .map(|(y, exact)| (y - exact).abs())
        .collect()
}

/// log2 of the ratio of errors with n and with 2n steps, component by component.
fn orders(errors: impl Fn(f64) -> Vec<f64>, n: f64) -> Vec<f64> {
    let (coarse, fine) = (errors(n), errors(2.0 * n));
    coarse
        .iter()
        .zip(fine)
        .map(|(coarse, fine)| (coarse / fine).log2())
        .collect()
}

/// The distance to the limit falls by half from one pair of steps to the next; ± 0.25 holds at the
/// steps chosen, far enough from rounding.
fn assert_orders(observed: &[f64], expected: &[f64]) {
    for (i, (observed, expected)) in observed.iter().zip(expected).enumerate() {
        assert!(
            (observed - expected).abs() < 0.25,
            "y[{i}]: order {observed}, not {expected}"
        );
    }
}

#[test]
fn linear_index_1_has_the_order_of_the_method() {
    for (stages, n) in [(1, 160.0), (3, 10.0), (5, 20.0)] {
        let errors = |n: f64| {
            let options = RadauOptions {
                stages,
                ..fixed(10.0 / n)
            };
            // y2 is given by an algebraic equation: it is exact.
            errors(LinearIndex1, 10.0, options)[..1].to_vec()
        };
        assert_orders(&orders(errors, n), &[(2 * stages - 1) as f64]);
    }
}

#[test]
fn jay_index_2_has_orders_5_and_3() {
    for n in [20.0, 40.0] {
        let errors = |n: f64| errors(JayIndex2, 1.0, fixed(1.0 / n));
        assert_orders(&orders(errors, n), &[5.0, 5.0, 3.0]);
    }
}

#[test]
fn pendulum_index_3_has_orders_5_3_and_2() {
    for n in [25.0, 50.0] {
        let pendulum = Pendulum::new(MechanicalForm::Index3);
        let errors = |n: f64| errors(pendulum, 1.0, fixed(1.0 / n));
        assert_orders(&orders(errors, n), &[5.0, 5.0, 3.0, 3.0, 2.0]);
    }
}

#[test]
fn dense_output_over_two_steps_has_order_6() {
    // y2 = sin t is exact at the ends and so are its derivatives there, to the order of the stages.
    let errors = |n: f64| {
        let h = 1.0 / n;
        let solver = run(LinearIndex1, 3.0 * h, fixed(h));
        let t = 2.4 * h;
        let mut out = [0.0; 2];
        solver.dense_output(t, 0, &mut out).unwrap();
        vec![(out[0] - LinearIndex1.exact(t).unwrap()[0]).abs()]
    };
    println!("{:?} {:?}", errors(8.0), orders(errors, 8.0));
    assert_orders(&orders(errors, 8.0), &[6.0]);
}

#[test]
fn dense_output_of_the_first_step_has_the_order_of_the_stages() {
    // Within one step the value errs by O(h⁴), the derivative by O(h³).
    let errors = |n: f64| {
        let h = 1.0 / n;
        let solver = run(JayIndex2, h, fixed(h));
        let mut out = [0.0; 3];
        let mut error = |derivative| {
            solver.dense_output(0.4 * h, derivative, &mut out).unwrap();
            (out[0] - (0.4 * h).exp()).abs()
        };
        vec![error(0), error(1)]
    };
    assert_orders(&orders(errors, 20.0), &[4.0, 3.0]);
}

#[test]
fn dense_output_is_refused_outside_the_last_step_and_beyond_the_first_derivative() {
    let solver = run(JayIndex2, 1.0, fixed(0.05));
    let mut out = [0.0; 3];
    for (t, derivative) in [(0.94, 0), (1.01, 0), (0.97, 2)] {
        let refused = solver.dense_output(t, derivative, &mut out);
        assert!(
            matches!(refused, Err(RadauError::NoDenseOutput { to: 1.0, .. })),
            "{refused:?}"
        );
    }
    let refused = solver.dense_output(0.97, 0, &mut out[..2]);
    assert!(matches!(
        refused,
        Err(RadauError::WrongLength {
            expected: 3,
            got: 2,
            ..
        })
    ));
}
