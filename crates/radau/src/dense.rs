//! The collocation polynomial of a step: dense output, and the next step's starting values.

use crate::Method;

/// The polynomial of degree s through y_0 at t_0 and y_0 + z_j at t_0 + c_j h.
#[derive(Debug, Clone)]
pub(crate) struct Collocation {
    pub(crate) t0: f64,
    pub(crate) h: f64,
    pub(crate) y0: Vec<f64>,
    /// The stage increments z_j, one after the other.
    pub(crate) increments: Vec<f64>,
}

impl Collocation {
    /// The straight line y_0 + (t − t_0) ẏ_0: what is known before the first step.
    pub(crate) fn line(method: &Method, t0: f64, y0: &[f64], y_dot0: &[f64]) -> Self {
        let increments = method
            .nodes()
            .iter()
            .flat_map(|c| y_dot0.iter().map(move |v| c * v))
            .collect();
        Self {
            t0,
            h: 1.0,
            y0: y0.to_vec(),
            increments,
        }
    }

    /// Evaluates the polynomial (`derivative` 0) or its derivative (1), also outside the step.
    pub(crate) fn evaluate(&self, method: &Method, t: f64, derivative: usize, out: &mut [f64]) {
        let theta = (t - self.t0) / self.h;
        match derivative {
            0 => out.copy_from_slice(&self.y0),
            _ => out.fill(0.0),
        }
        for (j, z) in self.increments.chunks_exact(self.y0.len()).enumerate() {
            let weight = match derivative {
                0 => method.basis(j, theta),
                _ => method.basis_derivative(j, theta) / self.h,
            };
            add_scaled(out, weight, z);
        }
    }

    /// Continues the polynomial to a step of size `h` from the end of this one, as stage
    /// increments over the solution `y` there.
    pub(crate) fn extrapolate(&self, method: &Method, t: f64, h: f64, y: &[f64], z: &mut [f64]) {
        let n = y.len();
        for (z_i, c) in z.chunks_exact_mut(n).zip(method.nodes()) {
            let theta = (t + c * h - self.t0) / self.h;
            for ((z, y0), y) in z_i.iter_mut().zip(&self.y0).zip(y) {
                *z = y0 - y;
            }
            for (j, increment) in self.increments.chunks_exact(n).enumerate() {
                add_scaled(z_i, method.basis(j, theta), increment);
            }
        }
    }
}

/// y ← y + a x
pub(crate) fn add_scaled(y: &mut [f64], a: f64, x: &[f64]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y += a * x;
    }
}
