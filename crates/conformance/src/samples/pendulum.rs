use std::f64::consts::FRAC_1_SQRT_2;

use super::{FullMatrix, MechanicalForm, ParametricSample, Sample, Start};
use myovib_dae::Parameter;
use myovib_dae::{Problem, StepError, VariableKind};

/// A pendulum of length ℓ in Cartesian coordinates, released from the horizontal position.
///
/// ```text
/// ẋ = u, ẏ = v, u̇ = −λ x, v̇ = −λ y − g
/// index 3:    x² + y² = ℓ²
/// index 2:    x u + y v = 0 instead
/// index 1:    x u̇ + y v̇ + u² + v² = 0 instead
/// stabilized: both, with ẋ = u − μ x, ẏ = v − μ y
/// ```
///
/// The unknowns are (x, y, u, v, λ), followed by μ in the stabilized form. The exact solution contains elliptic
/// functions: θ = 2 asin(k sn(K − w t, k)) with w = √(g/ℓ) and k = sin(π/4), x = ℓ sin θ, y = −ℓ cos θ, λ = 3 g cos
/// θ/ℓ, μ = 0; θ̇ = −2 k w cn(K − w t, k).
///
/// The parameters are ℓ and g.
///
/// Source: the textbook example of constrained mechanics, for instance Hairer & Wanner, Solving
/// Ordinary Differential Equations II, VII.1.
#[derive(Debug, Clone, Copy)]
pub struct Pendulum {
    form: MechanicalForm,
    length: f64,
    gravity: f64,
}

impl Pendulum {
    /// Creates a pendulum of length 1 under a gravity of 9.81, with the constraint in the given form.
    pub fn new(form: MechanicalForm) -> Self {
        Self { form, length: 1.0, gravity: 9.81 }
    }

    /// Returns the same pendulum with the length ℓ and the gravity g.
    #[must_use]
    pub fn with(self, length: f64, gravity: f64) -> Self {
        Self { length, gravity, ..self }
    }

    fn is_stabilized(&self) -> bool {
        self.form == MechanicalForm::Stabilized
    }

    /// Returns μ, or zero if μ is not an unknown.
    fn mu(&self, y: &[f64]) -> f64 {
        if self.is_stabilized() { y[5] } else { 0.0 }
    }
}

impl Sample for Pendulum {
    fn start(&self) -> Start {
        let mut start = Start {
            t: 0.0,
            y: vec![self.length, 0.0, 0.0, 0.0, 0.0],
            // The derivative λ̇ = −3 g θ̇ sin θ/ℓ is 0 at rest.
            y_dot: vec![0.0, 0.0, 0.0, -self.gravity, 0.0],
        };
        start.y.resize(self.n_unknowns(), 0.0);
        start.y_dot.resize(self.n_unknowns(), 0.0);
        start
    }

    fn exact(&self, t: f64) -> Option<Vec<f64>> {
        let (length, [theta, theta_dot]) = (self.length, self.swing(t));
        let (sin, cos) = theta.sin_cos();
        let speed = length * theta_dot;
        let tension = 3.0 * self.gravity * cos / length;
        let mut y = vec![length * sin, -length * cos, cos * speed, sin * speed, tension];
        y.resize(self.n_unknowns(), 0.0);
        Some(y)
    }
}

impl Pendulum {
    /// Returns w = √(g/ℓ).
    fn frequency(&self) -> f64 {
        (self.gravity / self.length).sqrt()
    }

    /// Returns θ and θ̇.
    fn swing(&self, t: f64) -> [f64; 2] {
        let (k, w) = (FRAC_1_SQRT_2, self.frequency());
        let (sn, cn) = jacobi_sn_cn(quarter_period(k) - w * t, k);
        [2.0 * (k * sn).asin(), -2.0 * k * w * cn]
    }
}

impl ParametricSample for Pendulum {
    fn parameters(&self) -> Vec<Parameter> {
        vec![Parameter::new("length", self.length), Parameter::new("gravity", self.gravity)]
    }

    fn set(&mut self, j: usize, value: f64) {
        match j {
            0 => self.length = value,
            _ => self.gravity = value,
        }
    }

    /// The angle θ depends only on w t. With w' = dw/dp, dθ/dp = w' t θ̇/w and dθ̇/dp = w' (θ̇ + t θ̈)/w, where θ̈ =
    /// −w² sin θ.
    fn exact_sensitivity(&self, j: usize, t: f64) -> Vec<f64> {
        let (l, g, w) = (self.length, self.gravity, self.frequency());
        let (of_l, of_g, relative) = match j {
            0 => (1.0, 0.0, -0.5 / l),
            _ => (0.0, 1.0, 0.5 / g),
        };
        let [theta, rate] = self.swing(t);
        let (sin, cos) = theta.sin_cos();
        let d_theta = relative * t * rate;
        let d_rate = relative * (rate - t * w * w * sin);
        let (speed, d_speed) = (l * rate, of_l * rate + l * d_rate);
        let mut s = vec![
            of_l * sin + l * cos * d_theta,
            -of_l * cos + l * sin * d_theta,
            -sin * d_theta * speed + cos * d_speed,
            cos * d_theta * speed + sin * d_speed,
            3.0 * (of_g * cos / l - g * sin * d_theta / l - g * cos * of_l / (l * l)),
        ];
        s.resize(self.n_unknowns(), 0.0);
        s
    }
}

impl Problem for Pendulum {
    fn n_unknowns(&self) -> usize {
        if self.is_stabilized() { 6 } else { 5 }
    }

    fn residual(
        &mut self,
        _t: f64,
        unknowns: &[f64],
        dot: &[f64],
        residual: &mut [f64],
    ) -> Result<(), StepError> {
        let (x, y, u, v) = (unknowns[0], unknowns[1], unknowns[2], unknowns[3]);
        let (lambda, mu) = (unknowns[4], self.mu(unknowns));
        residual[0] = dot[0] - u + mu * x;
        residual[1] = dot[1] - v + mu * y;
        residual[2] = dot[2] + lambda * x;
        residual[3] = dot[3] + lambda * y + self.gravity;
        let (length, speed) = (x * x + y * y - self.length * self.length, x * u + y * v);
        residual[4] = match self.form {
            MechanicalForm::Index1 => x * dot[2] + y * dot[3] + u * u + v * v,
            MechanicalForm::Index2 => speed,
            MechanicalForm::Index3 | MechanicalForm::Stabilized => length,
        };
        if self.is_stabilized() {
            residual[5] = speed;
        }
        Ok(())
    }

    fn jacobian(
        &mut self,
        _t: f64,
        unknowns: &[f64],
        dot: &[f64],
        a: f64,
        b: f64,
        values: &mut [f64],
    ) -> Result<(), StepError> {
        use MechanicalForm::{Index1, Index2, Index3, Stabilized};
        let (position, velocity) = (&unknowns[..2], &unknowns[2..4]);
        let (lambda, mu) = (unknowns[4], self.mu(unknowns));
        let mut matrix = FullMatrix::zeroed(self.n_unknowns(), values);
        let speed_row = if self.is_stabilized() { 5 } else { 4 };
        for i in 0..2 {
            matrix.add(i, i, b + a * mu);
            matrix.add(i, 2 + i, -a);
            matrix.add(2 + i, 2 + i, b);
            matrix.add(2 + i, i, a * lambda);
            matrix.add(2 + i, 4, a * position[i]);
            if self.is_stabilized() {
                matrix.add(i, 5, a * position[i]);
            }
            if self.form == Index1 {
                matrix.add(4, i, a * dot[2 + i]);
                matrix.add(4, 2 + i, 2.0 * a * velocity[i] + b * position[i]);
            }
            if matches!(self.form, Index3 | Stabilized) {
                matrix.add(4, i, 2.0 * a * position[i]);
            }
            if matches!(self.form, Index2 | Stabilized) {
                matrix.add(speed_row, i, a * velocity[i]);
                matrix.add(speed_row, 2 + i, a * position[i]);
            }
        }
        Ok(())
    }

    fn kinds(&self) -> Option<Vec<VariableKind>> {
        let mut kinds = vec![VariableKind::Differential; 4];
        kinds.resize(self.n_unknowns(), VariableKind::Algebraic);
        Some(kinds)
    }

    fn n_constraints(&self) -> usize {
        2
    }

    /// Evaluates the constraint on the length and its time derivative in all formulations.
    fn constraints(&mut self, _: f64, y: &[f64], out: &mut [f64]) -> Result<(), StepError> {
        out[0] = y[0] * y[0] + y[1] * y[1] - self.length * self.length;
        out[1] = y[0] * y[2] + y[1] * y[3];
        Ok(())
    }

    fn indices(&self) -> Option<Vec<u8>> {
        Some(self.form.indices(2, 1))
    }
}

/// Returns the arithmetic-geometric means a_i of 1 and √(1 − k²), with c_i = (a_{i−1} − b_{i−1})/2, until c consists
/// only of rounding errors. The convergence is quadratic, so eight iterations are sufficient.
fn means(k: f64) -> Vec<(f64, f64)> {
    let (mut a, mut b) = (1.0_f64, (1.0 - k * k).sqrt());
    let mut pairs = vec![(a, k)];
    while pairs.len() < 9 && (a - b).abs() > f64::EPSILON {
        let c = 0.5 * (a - b);
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
        pairs.push((a, c));
    }
    pairs
}

/// Returns K(k), the complete elliptic integral of the first kind.
fn quarter_period(k: f64) -> f64 {
    let pairs = means(k);
    std::f64::consts::FRAC_PI_2 / pairs[pairs.len() - 1].0
}

/// Returns Jacobi's sn(w, k) and cn(w, k), which are computed by descending Landen transformations (Abramowitz & Stegun
/// 16.4): φ_n = 2ⁿ a_n w, then sin(2 φ_{i−1} − φ_i) = (c_i / a_i) sin φ_i down to φ_0.
fn jacobi_sn_cn(w: f64, k: f64) -> (f64, f64) {
    let pairs = means(k);
    let n = pairs.len() - 1;
    let mut phi = 2.0_f64.powi(n as i32) * pairs[n].0 * w;
    for &(a, c) in pairs[1..].iter().rev() {
        phi = 0.5 * (phi + (c / a * phi.sin()).asin());
    }
    phi.sin_cos()
}
