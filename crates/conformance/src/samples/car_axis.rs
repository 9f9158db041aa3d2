use super::{FullMatrix, MechanicalForm, Sample, Start};
use myovib_dae::{Problem, StepError, VariableKind};

const EPS: f64 = 0.01;
const M: f64 = 10.0;
const L: f64 = 1.0;
const L0: f64 = 0.5;
const R: f64 = 0.1;
const W: f64 = 10.0;
const GRAVITY: f64 = 1.0;
/// Coefficient of p̈ in the equations of motion.
const K: f64 = EPS * EPS * M / 2.0;

/// A car axis on a bumpy road: two wheel joints at distance L, supported by stiff springs; the right joint is above a
/// wheel that follows the bumps y_b = r sin(w t), x_b = √(L² − y_b²).
///
/// ```text
/// ṗ = v                          p = (x_l, y_l, x_r, y_r)
/// K v̇ = f(p, t) + G(p, t)ᵀ λ     K = ε² M / 2
/// f_l = (L0/|q_l| − 1) q_l − (0, K g),   q_l = (x_l, y_l)
/// f_r = (L0/|q_r| − 1) q_r − (0, K g),   q_r = (x_r − x_b, y_r − y_b)
/// g1 = x_l x_b + y_l y_b,   g2 = (x_l − x_r)² + (y_l − y_r)² − L²,   G = ∂g/∂p
/// index 3:    g = 0
/// index 2:    G v + g_t = 0 instead
/// index 1:    the derivative of G v + g_t instead
/// stabilized: both, with ṗ = v + Gᵀ μ
/// ```
///
/// Unknowns (p, v, λ), then μ in the stabilized form. Usual interval: [0, 3].
///
/// Source: S. Schneider, Intégration de systèmes d'équations différentielles raides et
/// différentielles-algébriques, 1994; Test Set for IVP Solvers, problem caraxis.
#[derive(Debug, Clone, Copy)]
pub struct CarAxis {
    form: MechanicalForm,
}

/// Position (x_b, y_b), velocity and acceleration of the road under the right wheel.
struct Road {
    at: [f64; 2],
    speed: [f64; 2],
    acceleration: [f64; 2],
}

impl Road {
    fn new(t: f64) -> Self {
        let (yb, yb_dot) = (R * (W * t).sin(), R * W * (W * t).cos());
        let yb_ddot = -W * W * yb;
        let xb = (L * L - yb * yb).sqrt();
        let xb_dot = -yb * yb_dot / xb;
        Self {
            at: [xb, yb],
            speed: [xb_dot, yb_dot],
            acceleration: [-(yb_dot * yb_dot + yb * yb_ddot + xb_dot * xb_dot) / xb, yb_ddot],
        }
    }
}

/// Returns the spring force (L0/|q| − 1) q.
fn spring(q: [f64; 2]) -> [f64; 2] {
    q.map(|c| (L0 / q[0].hypot(q[1]) - 1.0) * c)
}

/// Returns ∂f_i/∂q_j of the spring force.
fn spring_slope(q: [f64; 2], i: usize, j: usize) -> f64 {
    let length = q[0].hypot(q[1]);
    let identity = if i == j { 1.0 } else { 0.0 };
    L0 * (identity / length - q[i] * q[j] / length.powi(3)) - identity
}

impl CarAxis {
    /// Creates the car axis with its constraints in the given form.
    pub fn new(form: MechanicalForm) -> Self {
        Self { form }
    }

    fn is_stabilized(&self) -> bool {
        self.form == MechanicalForm::Stabilized
    }

    /// Returns the two rows of G(p, t).
    fn constraint_slopes(p: &[f64], road: &Road) -> [[f64; 4]; 2] {
        let d = [2.0 * (p[0] - p[2]), 2.0 * (p[1] - p[3])];
        [[road.at[0], road.at[1], 0.0, 0.0], [d[0], d[1], -d[0], -d[1]]]
    }

    /// Returns the spring vectors q_l and q_r.
    fn springs(p: &[f64], road: &Road) -> [[f64; 2]; 2] {
        [[p[0], p[1]], [p[2] - road.at[0], p[3] - road.at[1]]]
    }

    /// Returns μ, or an empty slice if μ is not an unknown.
    fn mu<'a>(&self, y: &'a [f64]) -> &'a [f64] {
        if self.is_stabilized() { &y[10..12] } else { &[] }
    }

    /// Adds c ∂(Gᵀ m)/∂p to rows `row..row + 4`; only the second constraint is curved.
    fn add_curvature(matrix: &mut FullMatrix<'_>, row: usize, c: f64, m: &[f64]) {
        let Some(&second) = m.get(1) else { return };
        for i in 0..2 {
            for (side, other) in [(i, i + 2), (i + 2, i)] {
                matrix.add(row + side, side, 2.0 * c * second);
                matrix.add(row + side, other, -2.0 * c * second);
            }
        }
    }
}

impl Sample for CarAxis {
    fn start(&self) -> Start {
        let v = -L0 / L;
        let mut y = vec![0.0, L0, L, L0, v, 0.0, v, 0.0, 0.0, 0.0];
        let mut y_dot = vec![v, 0.0, v, 0.0, 0.0, -GRAVITY, 0.0, -GRAVITY, 0.0, 0.0];
        y.resize(self.n_unknowns(), 0.0);
        y_dot.resize(self.n_unknowns(), 0.0);
        Start { t: 0.0, y, y_dot }
    }
}

impl Problem for CarAxis {
    fn n_unknowns(&self) -> usize {
        if self.is_stabilized() { 12 } else { 10 }
    }

    fn residual(
        &mut self,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
        residual: &mut [f64],
    ) -> Result<(), StepError> {
        let road = Road::new(t);
        let (p, v, lambda, mu) = (&y[..4], &y[4..8], &y[8..10], self.mu(y));
        let slopes = Self::constraint_slopes(p, &road);
        let pull = Self::springs(p, &road).map(spring);
        let transposed = |i: usize, m: &[f64]| -> f64 {
            slopes.iter().zip(m).map(|(row, multiplier)| row[i] * multiplier).sum()
        };
        for i in 0..4 {
            residual[i] = y_dot[i] - v[i] - transposed(i, mu);
            let weight = if i % 2 == 1 { K * GRAVITY } else { 0.0 };
            residual[4 + i] =
                K * y_dot[4 + i] - pull[i / 2][i % 2] + weight - transposed(i, lambda);
        }
        let position = [
            p[0] * road.at[0] + p[1] * road.at[1],
            (p[0] - p[2]).powi(2) + (p[1] - p[3]).powi(2) - L * L,
        ];
        let rate = slopes.map(|row| row.iter().zip(v).map(|(g, v)| g * v).sum::<f64>());
        let velocity = [rate[0] + p[0] * road.speed[0] + p[1] * road.speed[1], rate[1]];
        let second =
            slopes.map(|row| row.iter().zip(&y_dot[4..8]).map(|(g, a)| g * a).sum::<f64>());
        let acceleration = [
            second[0]
                + 2.0 * (v[0] * road.speed[0] + v[1] * road.speed[1])
                + p[0] * road.acceleration[0]
                + p[1] * road.acceleration[1],
            second[1] + 2.0 * ((v[0] - v[2]).powi(2) + (v[1] - v[3]).powi(2)),
        ];
        let primary = match self.form {
            MechanicalForm::Index1 => acceleration,
            MechanicalForm::Index2 => velocity,
            MechanicalForm::Index3 | MechanicalForm::Stabilized => position,
        };
        residual[8..10].copy_from_slice(&primary);
        if self.is_stabilized() {
            residual[10..12].copy_from_slice(&velocity);
        }
        Ok(())
    }

    fn jacobian(
        &mut self,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
        a: f64,
        b: f64,
        values: &mut [f64],
    ) -> Result<(), StepError> {
        use MechanicalForm::{Index1, Index2, Index3, Stabilized};
        let road = Road::new(t);
        let (p, v, lambda, mu) = (&y[..4], &y[4..8], &y[8..10], self.mu(y));
        let slopes = Self::constraint_slopes(p, &road);
        let mut matrix = FullMatrix::zeroed(self.n_unknowns(), values);
        let velocity_row = if self.is_stabilized() { 10 } else { 8 };
        Self::add_curvature(&mut matrix, 0, -a, mu);
        Self::add_curvature(&mut matrix, 4, -a, lambda);
        for (side, q) in Self::springs(p, &road).into_iter().enumerate() {
            for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                matrix.add(4 + 2 * side + i, 2 * side + j, -a * spring_slope(q, i, j));
            }
        }
        // ∂(G v + g_t)/∂p, in addition to G.
        let slopes_of = |[x, y]: [f64; 2], v: &[f64]| {
            let d = [2.0 * (v[0] - v[2]), 2.0 * (v[1] - v[3])];
            [[x, y, 0.0, 0.0], [d[0], d[1], -d[0], -d[1]]]
        };
        let rate_slopes = slopes_of(road.speed, v);
        let second_slopes = slopes_of(road.acceleration, &y_dot[4..8]);
        for i in 0..4 {
            matrix.add(i, i, b);
            matrix.add(i, 4 + i, -a);
            matrix.add(4 + i, 4 + i, b * K);
            for c in 0..2 {
                matrix.add(4 + i, 8 + c, -a * slopes[c][i]);
                if self.is_stabilized() {
                    matrix.add(i, 10 + c, -a * slopes[c][i]);
                }
                if self.form == Index1 {
                    let rate = 2.0 * a * rate_slopes[c][i] + b * slopes[c][i];
                    matrix.add(8 + c, i, a * second_slopes[c][i]);
                    matrix.add(8 + c, 4 + i, rate);
                }
                if matches!(self.form, Index3 | Stabilized) {
                    matrix.add(8 + c, i, a * slopes[c][i]);
                }
                if matches!(self.form, Index2 | Stabilized) {
                    matrix.add(velocity_row + c, i, a * rate_slopes[c][i]);
                    matrix.add(velocity_row + c, 4 + i, a * slopes[c][i]);
                }
            }
        }
        Ok(())
    }

    fn kinds(&self) -> Option<Vec<VariableKind>> {
        let mut kinds = vec![VariableKind::Differential; 8];
        kinds.resize(self.n_unknowns(), VariableKind::Algebraic);
        Some(kinds)
    }

    fn indices(&self) -> Option<Vec<u8>> {
        Some(self.form.indices(4, 2))
    }

    fn component_name(&self, i: usize) -> String {
        const NAMES: [&str; 12] = [
            "x_l", "y_l", "x_r", "y_r", "v_xl", "v_yl", "v_xr", "v_yr", "lambda_1", "lambda_2",
            "mu_1", "mu_2",
        ];
        NAMES[i].to_owned()
    }
}
