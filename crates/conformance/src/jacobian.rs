//! Comparison of a problem's Jacobian with difference quotients of its residual.

use myovib_dae::Problem;

/// Step of the difference quotients, relative to the direction.
const EPSILON: f64 = 1e-5;

/// Compares the Jacobian J = a ∂F/∂y + b ∂F/∂ẏ with difference quotients along the direction δ. Returns max_i |J δ −
/// dF/dε|_i, relative to Σ_j |J_ij δ_j|.
///
/// The error of central differences is ε²/6 times the third derivative, plus the rounding errors of the terms divided
/// by ε. If the size of a row is below 1e-9, 1e-9 is used instead.
///
/// # Shapes
/// y, ẏ and δ have the length `n_unknowns`.
///
/// # Panics
/// Panics if the problem cannot be evaluated at this point.
pub fn jacobian_error<P: Problem + ?Sized>(
    problem: &mut P,
    t: f64,
    [y, y_dot, direction]: [&[f64]; 3],
    [a, b]: [f64; 2],
) -> f64 {
    let n = problem.n_unknowns();
    let pattern = problem.jacobian_pattern();
    let mut values = vec![f64::NAN; pattern.nnz()];
    problem.jacobian(t, y, y_dot, a, b, &mut values).unwrap();
    let (mut product, mut scale) = (vec![0.0; n], vec![0.0_f64; n]);
    for ((column, row), value) in pattern.entries().zip(&values) {
        product[row] += value * direction[column];
        scale[row] += (value * direction[column]).abs();
    }
    let mut shifted = |sign: f64| {
        let shift = |x: &[f64], c: f64| -> Vec<f64> {
            let moved = x.iter().zip(direction);
            moved.map(|(x, d)| x + sign * EPSILON * c * d).collect()
        };
        let mut residual = vec![0.0; n];
        problem.residual(t, &shift(y, a), &shift(y_dot, b), &mut residual).unwrap();
        residual
    };
    let (plus, minus) = (shifted(1.0), shifted(-1.0));
    let errors = (0..n).map(|i| {
        let difference = (plus[i] - minus[i]) / (2.0 * EPSILON);
        (product[i] - difference).abs() / scale[i].max(1e-9)
    });
    // A NaN counts as larger than every number.
    errors.fold(0.0, |m, e| if e > m || e.is_nan() { e } else { m })
}
