//! Driven systems with exact solutions. They have several time scales, or inputs with discontinuities.

use super::Start;
use super::dual::Differentiable;
use super::equations::Equations;

/// Three relaxation equations with the rates 1, 10³ and 10⁶, whose unknowns follow signals with the frequencies 1, 5
/// and 20. An algebraic unknown depends on these unknowns.
///
/// ```text
/// ẏ_i = φ̇_i − λ_i (e_i + e_i³),   e_i = y_i − φ_i(t),   φ_i = sin ω_i t
/// 0 = z + z³ − Σ y_i²
/// ```
///
/// The exact solution is y_i = φ_i. The index is 1.
#[derive(Debug, Clone, Copy, Default)]
pub struct TimeScales;

impl TimeScales {
    const RATES: [f64; 3] = [1.0, 1e3, 1e6];
    const FREQUENCIES: [f64; 3] = [1.0, 5.0, 20.0];
}

/// Returns the real z with z + z³ = s.
fn cubic_root(s: f64) -> f64 {
    // Cardano's formula for the only real root.
    let d = (0.25 * s * s + 1.0 / 27.0).sqrt();
    (0.5 * s + d).cbrt() + (0.5 * s - d).cbrt()
}

impl Equations for TimeScales {
    fn n_unknowns(&self) -> usize {
        4
    }

    fn residual<S: Differentiable>(&self, t: f64, y: &[S], y_dot: &[S], residual: &mut [S]) {
        let mut sum = S::from(0.0);
        for i in 0..3 {
            let (sin, cos) = (Self::FREQUENCIES[i] * t).sin_cos();
            let e = y[i] - S::from(sin);
            residual[i] = y_dot[i] - S::from(Self::FREQUENCIES[i] * cos)
                + (e + e * e * e).times(Self::RATES[i]);
            sum = sum + y[i] * y[i];
        }
        residual[3] = y[3] + y[3] * y[3] * y[3] - sum;
    }

    fn n_differential(&self) -> usize {
        3
    }

    fn start(&self) -> Start {
        let mut y_dot = Self::FREQUENCIES.to_vec();
        y_dot.push(0.0);
        Start { t: 0.0, y: vec![0.0; 4], y_dot }
    }

    fn exact(&self, t: f64) -> Option<Vec<f64>> {
        let mut y = Self::FREQUENCIES.map(|omega| (omega * t).sin()).to_vec();
        let sum = y.iter().map(|y| y * y).sum();
        y.push(cubic_root(sum));
        Some(y)
    }
}

/// A two-stage low-pass filter driven by pulses with steep edges, and a nonlinear function of its output.
///
/// ```text
/// τ1 ẏ1 = w(t) − y1,  τ2 ẏ2 = y1 − y2,  0 = z + z³ − y2
/// ```
///
/// w rises within 1 ms at t = 0.1, falls within 1 ms at 0.2, and jumps up at 0.3 and down at 0.302. The exact solution
/// is computed piece by piece, because w is piecewise linear. The index is 1.
#[derive(Debug, Clone, Copy, Default)]
pub struct Pulses;

/// Pieces of w, each with its start time, initial value and slope. The last piece has no end.
const PIECES: [(f64, f64, f64); 7] = [
    (0.0, 0.0, 0.0),
    (0.1, 0.0, 1e3),
    (0.101, 1.0, 0.0),
    (0.2, 1.0, -1e3),
    (0.201, 0.0, 0.0),
    (0.3, 2.0, 0.0),
    (0.302, 0.0, 0.0),
];

impl Pulses {
    /// Time constants τ1 and τ2, s.
    const TIMES: [f64; 2] = [3e-3, 2e-2];

    /// Returns the times at which w or its slope jumps.
    pub fn breakpoints(&self) -> Vec<f64> {
        PIECES[1..].iter().map(|piece| piece.0).collect()
    }

    fn input(t: f64) -> f64 {
        let &(from, w, slope) =
            PIECES.iter().rev().find(|piece| piece.0 <= t).unwrap_or(&PIECES[0]);
        w + slope * (t - from)
    }

    /// Returns y1 and y2 after the time `d` if they start from `y` and w is linear with the initial value `w` and the
    /// slope `slope`.
    fn advance([y1, y2]: [f64; 2], (w, slope): (f64, f64), d: f64) -> [f64; 2] {
        let [a, b] = Self::TIMES;
        // The solution consists of the particular solutions w − slope τ1 and w − slope (τ1 + τ2) and of decaying terms.
        let (fast, slow) = (y1 - (w - slope * a), a / (a - b));
        let rest = y2 - (w - slope * (a + b)) - slow * fast;
        let (decay_a, decay_b) = ((-d / a).exp(), (-d / b).exp());
        let end = w + slope * d;
        [
            end - slope * a + fast * decay_a,
            end - slope * (a + b) + slow * fast * decay_a + rest * decay_b,
        ]
    }
}

impl Equations for Pulses {
    fn n_unknowns(&self) -> usize {
        3
    }

    fn residual<S: Differentiable>(&self, t: f64, y: &[S], y_dot: &[S], residual: &mut [S]) {
        let [a, b] = Self::TIMES;
        residual[0] = y_dot[0].times(a) - S::from(Self::input(t)) + y[0];
        residual[1] = y_dot[1].times(b) - y[0] + y[1];
        residual[2] = y[2] + y[2] * y[2] * y[2] - y[1];
    }

    fn n_differential(&self) -> usize {
        2
    }

    fn start(&self) -> Start {
        Start { t: 0.0, y: vec![0.0; 3], y_dot: vec![0.0; 3] }
    }

    fn exact(&self, t: f64) -> Option<Vec<f64>> {
        let mut y = [0.0, 0.0];
        for (i, &(from, w, slope)) in PIECES.iter().enumerate() {
            let to = PIECES.get(i + 1).map_or(f64::INFINITY, |next| next.0);
            if from < t {
                y = Self::advance(y, (w, slope), to.min(t) - from);
            }
        }
        Some(vec![y[0], y[1], cubic_root(y[1])])
    }
}
