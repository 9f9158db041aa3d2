//! Collocation polynomial of a step. It provides the initial guess for the next step and, with one more condition,
//! dense output.

use myovib_dae::IntegratorError;
use myovib_dae::checks::{expect_finite, expect_vector};
use pulp::{Arch, Simd, WithSimd};
use serde::{Deserialize, Serialize};

use crate::method::Method;

/// Polynomial u of degree s through y_0 at t_0 and y_0 + z_j at t_0 + c_j h.
///
/// Its derivative equals the derivative of the solution at the nodes, but not at t_0. Dense output
/// corrects the derivative at t_0:
///
/// ```text
/// û(t_0 + θh) = u(t_0 + θh) + h (ẏ_0 − u'(t_0)) r(θ),
/// ```
///
/// with the ramp r of degree s + 1, r(0) = 0, r'(0) = 1, r'(c_j) = 0. To leading order, the errors of h u'(t_0) and of
/// u are multiples of h^(s+1) and of the same derivative of the solution. Therefore, removing the first error also
/// removes the second. The error of û is O(h^(s+2)), and û continues the previous step with a continuous derivative.
/// Since r(1) = 0, the values at the two ends do not change.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Collocation {
    pub(crate) t0: f64,
    pub(crate) h: f64,
    pub(crate) y0: Vec<f64>,
    /// ẏ_0, known from the end of the previous step.
    pub(crate) y_dot0: Vec<f64>,
    /// Stage increments z_j, one after the other.
    pub(crate) increments: Vec<f64>,
}

impl Collocation {
    /// Validates a step of `n` components from a saved state.
    pub(crate) fn validate(
        &self,
        what: &'static str,
        n: usize,
        stages: usize,
    ) -> Result<(), IntegratorError> {
        expect_finite(what, &[self.t0, self.h])?;
        expect_vector(what, n, &self.y0)?;
        expect_vector(what, n, &self.y_dot0)?;
        expect_vector(what, stages * n, &self.increments)
    }

    /// Returns the straight line y_0 + (t − t_0) ẏ_0, which is used before the first step.
    pub(crate) fn line(method: &Method, t0: f64, y0: &[f64], y_dot0: &[f64]) -> Self {
        let increments =
            method.nodes().iter().flat_map(|c| y_dot0.iter().map(move |v| c * v)).collect();
        Self { t0, h: 1.0, y0: y0.to_vec(), y_dot0: y_dot0.to_vec(), increments }
    }

    /// Extends a [`line`](Self::line) to the size `h` of a first step, because an extrapolation far beyond the end of
    /// the line would be dominated by rounding errors.
    pub(crate) fn stretch_line(&mut self, h: f64) {
        if h > self.h {
            self.increments.iter_mut().for_each(|z| *z *= h / self.h);
            self.h = h;
        }
    }

    /// Copies another polynomial of the same dimensions.
    pub(crate) fn copy_from(&mut self, other: &Self) {
        (self.t0, self.h) = (other.t0, other.h);
        self.y0.copy_from_slice(&other.y0);
        self.y_dot0.copy_from_slice(&other.y_dot0);
        self.increments.copy_from_slice(&other.increments);
    }

    /// Returns the total length of the vectors.
    pub(crate) fn n_numbers(&self) -> usize {
        self.y0.len() + self.y_dot0.len() + self.increments.len()
    }

    /// Sets the slope of û at t_0 to the slope of u for the given `components`, so that û equals u. This is required,
    /// for example, in a first step, in which the initial derivatives of algebraic variables are unknown.
    pub(crate) fn free_start(
        &mut self,
        method: &Method,
        components: impl IntoIterator<Item = usize>,
    ) {
        let n = self.y0.len();
        for i in components {
            let z_i = self.increments[i..].iter().step_by(n).enumerate();
            let slope: f64 = z_i.map(|(j, z)| method.basis_derivative(j, 0.0) * z).sum();
            self.y_dot0[i] = slope / self.h;
        }
    }

    /// Changes y_0 and keeps the values at the stages.
    pub(crate) fn change_start(&mut self, component: usize, change: f64) {
        let n = self.y0.len();
        self.y0[component] += change;
        let z_i = self.increments[component..].iter_mut().step_by(n);
        z_i.for_each(|z| *z -= change);
    }

    /// Writes u'(t_0), which differs from ẏ_0.
    pub(crate) fn start_slope(&self, method: &Method, out: &mut [f64]) {
        start_slope(method, self.h, &self.increments, out);
    }

    /// Evaluates û (`derivative` = 0) or its first derivative (`derivative` = 1).
    pub(crate) fn evaluate(&self, method: &Method, t: f64, derivative: usize, out: &mut [f64]) {
        match derivative {
            0 => out.copy_from_slice(&self.y0),
            _ => out.fill(0.0),
        }
        let (of_slope, of_stages) = self.coefficients(method, t, derivative);
        add_scaled(out, of_slope, &self.y_dot0);
        let stages = self.increments.chunks_exact(self.y0.len());
        stages.zip(of_stages).for_each(|(z, b)| add_scaled(out, b, z));
    }

    /// Returns the factors of ẏ_0 and of the increments in û (`derivative` = 0) or in its first derivative
    /// (`derivative` = 1).
    pub(crate) fn coefficients(
        &self,
        method: &Method,
        t: f64,
        derivative: usize,
    ) -> (f64, impl Iterator<Item = f64>) {
        let theta = (t - self.t0) / self.h;
        let (ramp, scale) = match derivative {
            0 => (method.ramp(theta), 1.0),
            _ => (method.ramp_derivative(theta), 1.0 / self.h),
        };
        let of_stage = move |j| {
            let basis = match derivative {
                0 => method.basis(j, theta),
                _ => method.basis_derivative(j, theta),
            };
            scale * (basis - ramp * method.basis_derivative(j, 0.0))
        };
        (scale * ramp * self.h, (0..method.stages()).map(of_stage))
    }

    /// Evaluates one of `n_columns` columns whose values are stored row by row.
    pub(crate) fn evaluate_column(
        &self,
        method: &Method,
        t: f64,
        derivative: usize,
        (j, n_columns): (usize, usize),
        out: &mut [f64],
    ) {
        let column = |of: &'_ [f64], i: usize| of[i * n_columns + j];
        let (of_slope, of_stages) = self.coefficients(method, t, derivative);
        let of_stages: Vec<f64> = of_stages.collect();
        for (i, out) in out.iter_mut().enumerate() {
            let stages = self.increments.chunks_exact(self.y0.len());
            let terms = stages.zip(&of_stages).map(|(z, b)| b * column(z, i));
            *out = of_slope * column(&self.y_dot0, i) + terms.sum::<f64>();
            if derivative == 0 {
                *out += column(&self.y0, i);
            }
        }
    }

    /// Extrapolates the polynomial to the next step, which starts at `t` and has size `h`. Writes the stage increments,
    /// relative to the solution `y` at `t`, to `z`.
    pub(crate) fn extrapolate(&self, method: &Method, t: f64, h: f64, y: &[f64], z: &mut [f64]) {
        let n = y.len();
        for (z_i, c) in z.chunks_exact_mut(n).zip(method.nodes()) {
            let theta = (t + c * h - self.t0) / self.h;
            for ((z, y0), y) in z_i.iter_mut().zip(&self.y0).zip(y) {
                *z = y0 - y;
            }
            add_combined(z_i, n, |_, j| method.basis(j, theta), &self.increments);
        }
    }
}

/// Writes h⁻¹ Σ_j ℓ_j'(0) z_j, the initial slope of the polynomial through the increments `z`.
pub(crate) fn start_slope(method: &Method, h: f64, z: &[f64], out: &mut [f64]) {
    let slope = |_, j| method.basis_derivative(j, 0.0) / h;
    write_combined(out, out.len(), slope, z);
}

/// Returns the value at t_0, minus y_0, of the polynomial of degree s − 1 through the values of component i at the
/// stages. `z` contains the stage increments relative to y_0. The polynomial itself does not depend on y_0.
pub(crate) fn change_of_start(method: &Method, n: usize, z: &[f64], i: usize) -> f64 {
    let z_i = z[i..].iter().step_by(n).zip(method.nodes()).enumerate();
    z_i.map(|(j, (z, c))| c * method.basis_derivative(j, 0.0) * z).sum()
}

/// Computes y ← y + a x.
#[inline(always)]
pub(crate) fn add_scaled(y: &mut [f64], a: f64, x: &[f64]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y += a * x;
    }
}

/// Computes y ← a x.
#[inline(always)]
fn write_scaled(y: &mut [f64], a: f64, x: &[f64]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y = a * x;
    }
}

/// Number of entries of each vector to combine at a time, so that the entries of all vectors remain in the cache.
pub(crate) const AT_A_TIME: usize = 256;

/// Computes out_i ← out_i + Σ_j `coefficient`(i, j) z_j with vector instructions. The vectors have
/// length `n` and are stored one after the other in `z` and in `out`.
pub(crate) fn add_combined(
    out: &mut [f64],
    n: usize,
    coefficient: impl Fn(usize, usize) -> f64,
    z: &[f64],
) {
    combine::<false>(out, n, coefficient, z);
}

/// Computes out_i ← Σ_j `coefficient`(i, j) z_j with vector instructions.
pub(crate) fn write_combined(
    out: &mut [f64],
    n: usize,
    coefficient: impl Fn(usize, usize) -> f64,
    z: &[f64],
) {
    combine::<true>(out, n, coefficient, z);
}

fn combine<const OVER: bool>(
    out: &mut [f64],
    n: usize,
    coefficient: impl Fn(usize, usize) -> f64,
    z: &[f64],
) {
    Arch::new().dispatch(Combine::<_, OVER> { out, n, coefficient, z });
}

/// Sums computed with vector instructions.
struct Combine<'a, F, const OVER: bool> {
    out: &'a mut [f64],
    n: usize,
    coefficient: F,
    z: &'a [f64],
}

impl<F: Fn(usize, usize) -> f64, const OVER: bool> WithSimd for Combine<'_, F, OVER> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { out, n, coefficient, z } = self;
        let (n_out, n_in) = (out.len() / n, z.len() / n);
        let mut start = 0;
        while start < n {
            let end = n.min(start + AT_A_TIME);
            for i in 0..n_out {
                let out = &mut out[i * n + start..i * n + end];
                for j in 0..n_in {
                    let z = &z[j * n + start..j * n + end];
                    match OVER && j == 0 {
                        true => write_scaled(out, coefficient(i, j), z),
                        false => add_scaled(out, coefficient(i, j), z),
                    }
                }
            }
            start = end;
        }
    }
}
