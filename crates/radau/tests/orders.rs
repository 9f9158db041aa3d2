//! Observed orders at fixed steps, and of the dense output (shared cases S4).

mod problems;

use myovib_radau::{RadauError, RadauOptions, RadauSolver, StepSize};
use problems::Small;
use sundials_wrap::{Outcome, Tolerances};

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

fn run(problem: Small, t_end: f64, options: RadauOptions) -> RadauSolver<Small> {
    let (y0, y_dot0) = (problem.y0.clone(), problem.y_dot0.clone());
    let mut radau = RadauSolver::builder(problem)
        .options(options)
        .build(0.0, &y0, &y_dot0)
        .expect("the options are good");
    assert_eq!(
        radau
            .integrate_to(t_end)
            .expect("the problem raises no errors"),
        Outcome::Reached { t: t_end }
    );
    radau
}

/// Errors of a run with n steps.
fn orders<const N: usize>(errors: impl Fn(f64) -> [f64; N], n: f64) -> [f64; N] {
    let (coarse, fine) = (errors(n), errors(2.0 * n));
    std::array::from_fn(|i| (coarse[i] / fine[i]).log2())
}

/// The distance to the limit falls by half from one pair of steps to the next; ± 0.25 holds at the
/// steps chosen, far enough from rounding.
fn assert_orders<const N: usize>(observed: [f64; N], expected: [f64; N]) {
    for (observed, expected) in observed.iter().zip(expected) {
        assert!(
            (observed - expected).abs() < 0.25,
            "order {observed}, expected {expected}"
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
            let solver = run(problems::linear_index_1(), 10.0, options);
            let exact = problems::linear_index_1_exact(10.0);
            [solver.y()[0] - exact[0]].map(f64::abs)
        };
        assert_orders(orders(errors, n), [(2 * stages - 1) as f64]);
    }
}

#[test]
fn jay_index_2_has_orders_5_and_3() {
    let errors = |n: f64| {
        let solver = run(problems::jay(), 1.0, fixed(1.0 / n));
        let exact = [1f64, -2.0, 2.0].map(f64::exp);
        std::array::from_fn(|i| (solver.y()[i] - exact[i]).abs())
    };
    assert_orders(orders(errors, 20.0), [5.0, 5.0, 3.0]);
    assert_orders(orders(errors, 40.0), [5.0, 5.0, 3.0]);
}

#[test]
fn pendulum_index_3_has_orders_5_3_and_2() {
    // x and λ at t = 1 from Jacobi elliptic functions (S4 C); the velocity by energy.
    let (x, lambda) = (-0.986_291_751_131_875_3_f64, 4.856_269_407_484_676);
    let cos = lambda / (3.0 * problems::GRAVITY);
    let u = -(2.0 * problems::GRAVITY * cos).sqrt() * cos;
    let errors = |n: f64| {
        let solver = run(problems::pendulum(), 1.0, fixed(1.0 / n));
        let y = solver.y();
        [y[0] - x, y[2] - u, y[4] - lambda].map(f64::abs)
    };
    assert_orders(orders(errors, 25.0), [5.0, 3.0, 2.0]);
    assert_orders(orders(errors, 50.0), [5.0, 3.0, 2.0]);
}

#[test]
fn dense_output_has_the_order_of_the_stages() {
    // Within one step the value errs by O(h⁴), the derivative by O(h³).
    let errors = |n: f64| {
        let h = 1.0 / n;
        let solver = run(problems::jay(), h, fixed(h));
        let mut out = [0.0; 3];
        [0, 1].map(|derivative| {
            solver.dense_output(0.4 * h, derivative, &mut out).unwrap();
            (out[0] - (0.4 * h).exp()).abs()
        })
    };
    assert_orders(orders(errors, 20.0), [4.0, 3.0]);
}

#[test]
fn dense_output_is_refused_outside_the_last_step_and_beyond_the_first_derivative() {
    let solver = run(problems::jay(), 1.0, fixed(0.05));
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
