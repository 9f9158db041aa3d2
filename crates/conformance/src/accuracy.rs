//! Tests of the accuracy of solutions.

use super::problems::Circle;
use super::{ABSOLUTE, Method, RELATIVE, Request};
use crate::samples::{LinearIndex1, Sample};
use myovib_dae::{ConsistencyMode, Integrator, Outcome};

/// Allowed error after several periods, as a multiple of the tolerance per step. Errors accumulate over a hundred steps
/// or more.
const ADDED_UP: f64 = 300.0;

fn error(y: &[f64], exact: &[f64]) -> f64 {
    let errors = y.iter().zip(exact).map(|(y, e)| (y - e).abs());
    errors.fold(0.0, f64::max)
}

/// Checks that problems of index 0 and 1 are solved to their tolerance.
pub fn solves_exact_problems_to_tolerance<M: Method>(method: &M) {
    let mut solver = method.build(Circle::new().request());
    for t in [0.1, 3.0, 10.0] {
        assert_eq!(solver.integrate_to(t).unwrap(), Outcome::Reached { t });
        let off = error(solver.y(), &Circle::exact(t));
        assert!(off < 1e-6 * ADDED_UP, "t = {t}: {off:e}");
    }
    let start = LinearIndex1.start();
    let request = Request::new(LinearIndex1, start.t, &start.y, &start.y_dot);
    let mut solver = method.build(request);
    assert_eq!(solver.integrate_to(10.0).unwrap(), Outcome::Reached { t: 10.0 });
    let exact = LinearIndex1.exact(10.0).unwrap();
    let off = error(solver.y(), &exact);
    assert!(off < 1e-6 * ADDED_UP, "{off:e}");
}

/// Checks that the tolerances r and a lead to nearly as many steps as the error weights 1/(r |y| + a).
pub fn treats_tolerances_as_error_weights<M: Method>(method: &M) {
    let factor = method.weight_factor(RELATIVE);
    let steps = |is_weighted: bool| {
        let mut request = Circle::new().request();
        if is_weighted {
            request.weights = Some(Box::new(move |_, y, weights| {
                for (weight, y) in weights.iter_mut().zip(y) {
                    *weight = 1.0 / (factor * (RELATIVE * y.abs() + ABSOLUTE));
                }
                Ok(())
            }));
        }
        let mut solver = method.build(request);
        solver.integrate_to(20.0).unwrap();
        solver.statistics().steps as f64
    };
    let (of_tolerances, of_weights) = (steps(false), steps(true));
    // The two runs differ only in the tolerance of Newton's method. If the allowed errors were ten times as large, a
    // method of order 6 would save 32 % of the steps.
    assert!(
        (of_tolerances / of_weights - 1.0).abs() < 0.1,
        "{of_tolerances} and {of_weights} steps"
    );
}

/// Checks that the number of steps is nearly unchanged if the problem provides only a residual, and neither a Jacobian
/// nor the kinds and indices of variables.
pub fn works_without_jacobian_kinds_and_indices<M: Method>(method: &M) {
    let mut with = method.build(Circle::new().request());
    let mut without = method.build(Circle::without_jacobian().request());
    for solver in [&mut with, &mut without] {
        solver.integrate_to(5.0).unwrap();
        let off = error(solver.y(), &Circle::exact(5.0));
        assert!(off < 1e-6 * ADDED_UP, "{off:e}");
    }
    assert_eq!(with.statistics().difference_evaluations, 0);
    let statistics = without.statistics();
    // A Jacobian requires at least one evaluation at the state itself and one for each column.
    assert!(statistics.difference_evaluations >= 4 * statistics.jacobian_evaluations);
    // Difference quotients are accurate to half of the digits, which rarely affects Newton's method.
    let steps = with.statistics().steps as f64;
    assert!(
        (statistics.steps as f64 / steps - 1.0).abs() < 0.05,
        "{} and {steps} steps",
        statistics.steps
    );
}

/// Checks that inconsistent algebraic values and derivatives are corrected, and that consistent values are kept.
pub fn corrects_inconsistent_initial_values<M: Method>(method: &M) {
    for problem in [Circle::new(), Circle::without_jacobian()] {
        let (y, y_dot) = Circle::start();
        let wrong = ([y[0], y[1], 7.0], [3.0, -5.0, y_dot[2]]);
        let mut solver = method.build(Request::new(problem, 0.0, &wrong.0, &wrong.1));
        solver.correct_initial_values(ConsistencyMode::AlgebraicAndDerivatives, 1.0).unwrap();
        assert_eq!(solver.y()[..2], y[..2]);
        // Newton's method stops at a fraction of the tolerance of 1e-6.
        let off = error(solver.y(), &y).max(error(&solver.y_dot()[..2], &y_dot[..2]));
        assert!(off < 1e-5, "{off:e}");
        solver.integrate_to(1.0).unwrap();
        let off = error(solver.y(), &Circle::exact(1.0));
        assert!(off < 1e-6 * ADDED_UP, "{off:e}");
        let late = solver.correct_initial_values(ConsistencyMode::AlgebraicAndDerivatives, 2.0);
        let message = late.unwrap_err().to_string();
        assert!(message.contains("only before the first step"), "{message}");
    }
}
