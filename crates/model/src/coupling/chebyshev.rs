//! Interpolation at Chebyshev points of the second kind on [0, 1].

use std::f64::consts::PI;

/// Returns point `k` of `n`, ordered from 0 to 1.
pub(super) fn point(k: usize, n: usize) -> f64 {
    let angle = PI * k as f64 / (n - 1) as f64;
    (1.0 - angle.cos()) / 2.0
}

/// Calls `add(k, w)` for each point k with its weight w: the interpolating polynomial has the value
/// Σ w f_k at `x` (barycentric formula).
pub(super) fn weights(x: f64, n: usize, mut add: impl FnMut(usize, f64)) {
    let barycentric = |k: usize| {
        let half = if k == 0 || k == n - 1 { 0.5 } else { 1.0 };
        let sign = if k.is_multiple_of(2) { 1.0 } else { -1.0 };
        half * sign / (x - point(k, n))
    };
    if let Some(k) = (0..n).find(|k| x == point(*k, n)) {
        return add(k, 1.0);
    }
    let sum: f64 = (0..n).map(barycentric).sum();
    (0..n).for_each(|k| add(k, barycentric(k) / sum));
}

/// Evaluates the polynomial through `values` at the points.
pub(super) fn interpolate(values: &[f64], x: f64) -> f64 {
    let mut value = 0.0;
    weights(x, values.len(), |k, weight| value += weight * values[k]);
    value
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_polynomial_of_degree_eight_is_reproduced() {
        let coefficients = [1.0, 2.0, -3.0, 0.5, 4.0, -2.5, 1.0, -3.0, 2.0];
        let p = |x: f64| coefficients.iter().rev().fold(0.0, |sum, c| sum * x + c);
        let values: [f64; 9] = std::array::from_fn(|k| p(point(k, 9)));
        for x in [0.0, 0.1, 0.37, 0.5, 0.93, 1.0] {
            // The values are of size 1; the condition number of interpolation at nine points is
            // below 3.
            assert!((interpolate(&values, x) - p(x)).abs() < 20.0 * f64::EPSILON);
        }
    }
}
