//! Dense output over two steps, where the collocation polynomial is less accurate than the ends.

/// The polynomial of degree 5 through y and ẏ at the ends of the last two steps.
///
/// For three stages the collocation polynomial errs by O(h⁴) within a step while its ends err by
/// O(h⁶) locally; this one errs by O(h⁶) throughout, as far as the ends do. Their derivatives are
/// those of the collocation polynomials, so that stiffness does not enter them.
#[derive(Debug)]
pub(crate) struct Hermite {
    /// Times of the three ends; the first two are equal before there are two steps.
    times: [f64; 3],
    y: [Vec<f64>; 3],
    y_dot: [Vec<f64>; 3],
}

impl Hermite {
    pub(crate) fn new(t0: f64, y0: &[f64], y_dot0: &[f64]) -> Self {
        Self {
            times: [t0; 3],
            y: [(); 3].map(|()| y0.to_vec()),
            y_dot: [(); 3].map(|()| y_dot0.to_vec()),
        }
    }

    /// Appends the end of a step, and forgets the oldest.
    pub(crate) fn push(&mut self, t: f64, y: &[f64], y_dot: &[f64]) {
        self.times = [self.times[1], self.times[2], t];
        for (ends, new) in [(&mut self.y, y), (&mut self.y_dot, y_dot)] {
            ends.rotate_left(1);
            ends[2].copy_from_slice(new);
        }
    }

    /// Whether there are two steps to span.
    pub(crate) fn is_complete(&self) -> bool {
        self.times[0] < self.times[1]
    }

    /// Evaluates the polynomial (`derivative` 0) or its derivative (1).
    pub(crate) fn evaluate(&self, t: f64, derivative: usize, out: &mut [f64]) {
        out.fill(0.0);
        // In units of the last step from its start, to keep digits.
        let h = self.times[2] - self.times[1];
        let x = self.times.map(|time| (time - self.times[1]) / h);
        let theta = (t - self.times[1]) / h;
        for i in 0..3 {
            let [value, slope] = basis(&x, i, theta, derivative);
            let (value, slope) = match derivative {
                0 => (value, slope * h),
                _ => (value / h, slope),
            };
            for ((out, y), y_dot) in out.iter_mut().zip(&self.y[i]).zip(&self.y_dot[i]) {
                *out += value * y + slope * y_dot;
            }
        }
    }
}

/// The Hermite polynomials of node i, (1 − 2 (θ − x_i) ℓ_i'(x_i)) ℓ_i² and (θ − x_i) ℓ_i², or
/// their derivatives, with ℓ_i the Lagrange polynomials on the three nodes.
fn basis(x: &[f64; 3], i: usize, theta: f64, derivative: usize) -> [f64; 2] {
    let (a, b) = (x[(i + 1) % 3], x[(i + 2) % 3]);
    let scale = (x[i] - a) * (x[i] - b);
    let l = (theta - a) * (theta - b) / scale;
    let dl = |theta: f64| (2.0 * theta - a - b) / scale;
    let from = theta - x[i];
    let factor = 1.0 - 2.0 * from * dl(x[i]);
    match derivative {
        0 => [factor * l * l, from * l * l],
        _ => {
            let dl_theta = dl(theta);
            [
                -2.0 * dl(x[i]) * l * l + 2.0 * factor * l * dl_theta,
                l * l + 2.0 * from * l * dl_theta,
            ]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_of_degree_5_are_reproduced() {
        let p = |t: f64| 1.0 - t + 2.0 * t.powi(3) - 0.5 * t.powi(5);
        let dp = |t: f64| -1.0 + 6.0 * t.powi(2) - 2.5 * t.powi(4);
        let mut hermite = Hermite::new(0.2, &[p(0.2)], &[dp(0.2)]);
        assert!(!hermite.is_complete());
        for t in [0.5, 1.7] {
            hermite.push(t, &[p(t)], &[dp(t)]);
        }
        assert!(hermite.is_complete());
        let mut out = [0.0];
        for t in [0.5, 0.8, 1.3, 1.7] {
            hermite.evaluate(t, 0, &mut out);
            assert!((out[0] - p(t)).abs() < 1e-13, "{t}: {} {}", out[0], p(t));
            hermite.evaluate(t, 1, &mut out);
            assert!((out[0] - dp(t)).abs() < 1e-12, "{t}: {} {}", out[0], dp(t));
        }
    }
}
