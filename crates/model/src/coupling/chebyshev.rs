//! Interpolation at Chebyshev points of the second kind on [0, 1].

use std::array;
use std::f64::consts::PI;
use std::sync::LazyLock;

const MAX_POINTS: usize = 9;

/// Returns the `n` points in ascending order from 0 to 1; `n` is at most nine.
pub(super) fn points(n: usize) -> &'static [f64] {
    static POINTS: LazyLock<[Vec<f64>; MAX_POINTS + 1]> = LazyLock::new(|| {
        array::from_fn(|n| {
            let angle = |k: usize| PI * k as f64 / (n - 1) as f64;
            (0..n).map(|k| (1.0 - angle(k).cos()) / 2.0).collect()
        })
    });
    &POINTS[n]
}

/// Returns the times of the `n` points over the step `[from, to]`.
pub(super) fn times(n: usize, [from, to]: [f64; 2]) -> impl Iterator<Item = f64> {
    let inner = points(n)[..n - 1].iter().map(move |point| from + point * (to - from));
    inner.chain([to])
}

/// Calls `add(k, w)` with the weight w of each point k. The interpolating polynomial has the value Σ w f_k at `x`
/// (barycentric formula).
pub(super) fn weights(x: f64, n: usize, mut add: impl FnMut(usize, f64)) {
    let points = points(n);
    if let Some(k) = points.iter().position(|point| *point == x) {
        return add(k, 1.0);
    }
    let mut barycentric = [0.0; MAX_POINTS];
    for (k, (weight, point)) in barycentric.iter_mut().zip(points).enumerate() {
        let half = if k == 0 || k == n - 1 { 0.5 } else { 1.0 };
        let sign = if k.is_multiple_of(2) { 1.0 } else { -1.0 };
        *weight = half * sign / (x - point);
    }
    let sum: f64 = barycentric[..n].iter().sum();
    (0..n).for_each(|k| add(k, barycentric[k] / sum));
}

/// Evaluates at `x` the polynomial that has the `values` at the Chebyshev points.
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
        let values: [f64; 9] = array::from_fn(|k| p(points(9)[k]));
        for x in [0.0, 0.1, 0.37, 0.5, 0.93, 1.0] {
            // The values are of magnitude 1, and the condition number of interpolation at nine points is below 3.
            assert!((interpolate(&values, x) - p(x)).abs() < 20.0 * f64::EPSILON);
        }
    }
}
