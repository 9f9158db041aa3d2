use super::dual::Differentiable;
use super::equations::{Differentiated, Equations};
use super::{MechanicalForm, Start};

const EPS: f64 = 0.01;
const M: f64 = 10.0;
const L: f64 = 1.0;
const L0: f64 = 0.5;
const R: f64 = 0.1;
const W: f64 = 10.0;
const GRAVITY: f64 = 1.0;
/// Coefficient K of v̇ in the equations of motion.
const K: f64 = EPS * EPS * M / 2.0;

/// A car axis on a bumpy road: two wheel joints at the distance L are supported by stiff springs. The right joint is
/// above a wheel that follows the bumps y_b = r sin(w t), x_b = √(L² − y_b²).
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
/// The unknowns are (p, v, λ), followed by μ in the stabilized form. The usual interval is [0, 3].
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
fn spring<S: Differentiable>(q: [S; 2]) -> [S; 2] {
    let length = (q[0] * q[0] + q[1] * q[1]).sqrt();
    q.map(|c| (S::from(L0) / length - S::from(1.0)) * c)
}

/// Returns Σ x_i y_i.
fn dot<S: Differentiable>(x: &[S], y: &[S]) -> S {
    x.iter().zip(y).fold(S::from(0.0), |sum, (&x, &y)| sum + x * y)
}

impl CarAxis {
    /// Creates the car axis with its constraints in the given form.
    pub fn new(form: MechanicalForm) -> Differentiated<Self> {
        Differentiated::new(Self { form })
    }
}

impl Equations for CarAxis {
    fn n_unknowns(&self) -> usize {
        if self.form == MechanicalForm::Stabilized { 12 } else { 10 }
    }

    fn residual<S: Differentiable>(&self, t: f64, y: &[S], y_dot: &[S], residual: &mut [S]) {
        let Road { at, speed, acceleration } = Road::new(t);
        let [at, speed, acceleration] = [at, speed, acceleration].map(|x| x.map(S::from));
        let (p, v, a, lambda, mu) = (&y[..4], &y[4..8], &y_dot[4..8], &y[8..10], &y[10..]);
        // The two rows of G(p, t).
        let d = [p[0] - p[2], p[1] - p[3]];
        let [dx, dy] = d.map(|d| d.times(2.0));
        let none = S::from(0.0);
        let slopes = [[at[0], at[1], none, none], [dx, dy, -dx, -dy]];
        let pull = [spring([p[0], p[1]]), spring([p[2] - at[0], p[3] - at[1]])];
        for i in 0..4 {
            let column = [slopes[0][i], slopes[1][i]];
            residual[i] = y_dot[i] - v[i] - dot(&column, mu);
            let weight = S::from(if i % 2 == 1 { K * GRAVITY } else { 0.0 });
            residual[4 + i] = a[i].times(K) - pull[i / 2][i % 2] + weight - dot(&column, lambda);
        }
        let position = [dot(&p[..2], &at), dot(&d, &d) - S::from(L * L)];
        let velocity = [dot(&slopes[0], v) + dot(&p[..2], &speed), dot(&slopes[1], v)];
        let difference = [v[0] - v[2], v[1] - v[3]];
        let second = dot(&v[..2], &speed).times(2.0) + dot(&p[..2], &acceleration);
        let acceleration = [
            dot(&slopes[0], a) + second,
            dot(&slopes[1], a) + dot(&difference, &difference).times(2.0),
        ];
        let primary = match self.form {
            MechanicalForm::Index1 => acceleration,
            MechanicalForm::Index2 => velocity,
            MechanicalForm::Index3 | MechanicalForm::Stabilized => position,
        };
        residual[8..10].copy_from_slice(&primary);
        if self.form == MechanicalForm::Stabilized {
            residual[10..].copy_from_slice(&velocity);
        }
    }

    fn n_differential(&self) -> usize {
        8
    }

    fn indices(&self) -> Vec<u8> {
        self.form.indices(4, 2)
    }

    fn start(&self) -> Start {
        let v = -L0 / L;
        let mut y = vec![0.0, L0, L, L0, v, 0.0, v, 0.0, 0.0, 0.0];
        let mut y_dot = vec![v, 0.0, v, 0.0, 0.0, -GRAVITY, 0.0, -GRAVITY, 0.0, 0.0];
        y.resize(self.n_unknowns(), 0.0);
        y_dot.resize(self.n_unknowns(), 0.0);
        Start { t: 0.0, y, y_dot }
    }
}
