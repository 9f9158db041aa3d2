//! Spatial mechanisms: two with holonomic constraints and one with a nonholonomic constraint.

use super::Start;
use super::dual::Differentiable;
use super::equations::Equations;
use super::mechanism::Mechanism;

/// Gravity, m/s².
const G: f64 = 9.81;

/// Two masses on rods with spherical joints, in Cartesian coordinates. The second mass hangs from the first.
///
/// The positions are (x1, y1, z1, x2, y2, z2), and the constraints are |p1|² = l1² and |p2 − p1|² = l2².
#[derive(Debug, Clone, Copy, Default)]
pub struct SphericalPendulums;

impl SphericalPendulums {
    const MASSES: [f64; 2] = [1.5, 0.8];
    const LENGTHS: [f64; 2] = [1.0, 0.7];
}

impl Mechanism for SphericalPendulums {
    fn n_positions(&self) -> usize {
        6
    }

    fn n_constraints(&self) -> usize {
        2
    }

    fn inertia<S: Differentiable>(&self, _q: &[S], a: &[S], out: &mut [S]) {
        for (i, (out, a)) in out.iter_mut().zip(a).enumerate() {
            *out = a.times(Self::MASSES[i / 3]);
        }
    }

    fn force<S: Differentiable>(&self, _q: &[S], _v: &[S], out: &mut [S]) {
        out.fill(S::from(0.0));
        for (body, mass) in Self::MASSES.into_iter().enumerate() {
            out[3 * body + 2] = S::from(-G * mass);
        }
    }

    fn constraint<S: Differentiable>(&self, q: &[S], out: &mut [S]) {
        let square = |p: [S; 3]| p[0] * p[0] + p[1] * p[1] + p[2] * p[2];
        let [l1, l2] = Self::LENGTHS;
        out[0] = (square([q[0], q[1], q[2]]) - S::from(l1 * l1)).times(0.5);
        let between = [q[3] - q[0], q[4] - q[1], q[5] - q[2]];
        out[1] = (square(between) - S::from(l2 * l2)).times(0.5);
    }

    /// Returns a state in which both rods are horizontal and perpendicular to each other. Each mass moves
    /// perpendicularly to its rod, relative to the other end of the rod.
    fn start(&self) -> (Vec<f64>, Vec<f64>) {
        let [l1, l2] = Self::LENGTHS;
        let positions = vec![l1, 0.0, 0.0, l1, l2, 0.0];
        (positions, vec![0.0, 1.0, 0.5, -1.5, 1.0, -0.5])
    }
}

/// Seven charges that repel each other on the unit sphere, with damping. They come to rest at large distances from each
/// other, as in the computation of Fekete points.
#[derive(Debug, Clone, Copy, Default)]
pub struct Charges;

impl Charges {
    const NUMBER: usize = 7;
    /// Damping coefficient per unit mass, 1/s.
    const DAMPING: f64 = 0.5;
}

impl Mechanism for Charges {
    fn n_positions(&self) -> usize {
        3 * Self::NUMBER
    }

    fn n_constraints(&self) -> usize {
        Self::NUMBER
    }

    fn inertia<S: Differentiable>(&self, _q: &[S], a: &[S], out: &mut [S]) {
        out.copy_from_slice(a);
    }

    fn force<S: Differentiable>(&self, q: &[S], v: &[S], out: &mut [S]) {
        for (out, v) in out.iter_mut().zip(v) {
            *out = v.times(-Self::DAMPING);
        }
        for i in 0..Self::NUMBER {
            for j in 0..i {
                let between = [0, 1, 2].map(|k| q[3 * i + k] - q[3 * j + k]);
                let [x, y, z] = between;
                let square = x * x + y * y + z * z;
                let cube = square * square.sqrt();
                for (k, between) in between.into_iter().enumerate() {
                    out[3 * i + k] = out[3 * i + k] + between / cube;
                    out[3 * j + k] = out[3 * j + k] - between / cube;
                }
            }
        }
    }

    fn constraint<S: Differentiable>(&self, q: &[S], out: &mut [S]) {
        for (out, p) in out.iter_mut().zip(q.chunks_exact(3)) {
            let square = p[0] * p[0] + p[1] * p[1] + p[2] * p[2];
            *out = (square - S::from(1.0)).times(0.5);
        }
    }

    /// Returns positions on a spiral from pole to pole and zero velocities.
    fn start(&self) -> (Vec<f64>, Vec<f64>) {
        let place = |i: usize| {
            let height = (2.0 * i as f64 + 1.0) / Self::NUMBER as f64 - 1.0;
            let (radius, angle) = ((1.0 - height * height).sqrt(), 2.0 * i as f64);
            [radius * angle.cos(), radius * angle.sin(), height]
        };
        let positions = (0..Self::NUMBER).flat_map(place).collect();
        (positions, vec![0.0; 3 * Self::NUMBER])
    }
}

/// A rotating skate on an inclined plane. It is a knife edge that cannot slide sideways.
///
/// ```text
/// ẋ = u, ẏ = v, φ̇ = ω,  u̇ = γ + λ sin φ,  v̇ = −λ cos φ,  ω̇ = 0
/// u sin φ − v cos φ = 0
/// ```
///
/// The constraint on the velocities cannot be integrated, so the index is 2. The unknowns are (x, y, φ, u, v, ω, λ).
/// The exact solution is φ = ω t, with the speed γ sin φ/ω along the edge, x = γ sin² φ/(2ω²), y = γ (φ − sin φ cos
/// φ)/(2ω²), λ = −2 γ sin φ.
///
/// Source: the textbook example of a nonholonomic system, for instance A. M. Bloch, Nonholonomic
/// Mechanics and Control, 1.6.
#[derive(Debug, Clone, Copy, Default)]
pub struct Skate;

impl Skate {
    /// Component of gravity along the plane, m/s².
    const GAMMA: f64 = 3.0;
    /// Angular velocity, rad/s.
    const OMEGA: f64 = 1.7;
}

impl Equations for Skate {
    fn n_unknowns(&self) -> usize {
        7
    }

    fn residual<S: Differentiable>(&self, _t: f64, y: &[S], y_dot: &[S], residual: &mut [S]) {
        let (sin, cos, lambda) = (y[2].sin(), y[2].cos(), y[6]);
        for k in 0..3 {
            residual[k] = y_dot[k] - y[3 + k];
        }
        residual[3] = y_dot[3] - S::from(Self::GAMMA) - lambda * sin;
        residual[4] = y_dot[4] + lambda * cos;
        residual[5] = y_dot[5];
        residual[6] = y[3] * sin - y[4] * cos;
    }

    fn n_differential(&self) -> usize {
        6
    }

    fn indices(&self) -> Vec<u8> {
        vec![1, 1, 1, 1, 1, 1, 2]
    }

    fn start(&self) -> Start {
        let (gamma, omega) = (Self::GAMMA, Self::OMEGA);
        Start {
            t: 0.0,
            y: vec![0.0, 0.0, 0.0, 0.0, 0.0, omega, 0.0],
            y_dot: vec![0.0, 0.0, omega, gamma, 0.0, 0.0, -2.0 * gamma * omega],
        }
    }

    fn exact(&self, t: f64) -> Option<Vec<f64>> {
        let (gamma, omega) = (Self::GAMMA, Self::OMEGA);
        let phi = omega * t;
        let (sin, cos) = phi.sin_cos();
        let (speed, size) = (gamma * sin / omega, 0.5 * gamma / (omega * omega));
        Some(vec![
            size * sin * sin,
            size * (phi - sin * cos),
            phi,
            speed * cos,
            speed * sin,
            omega,
            -2.0 * gamma * sin,
        ])
    }
}
