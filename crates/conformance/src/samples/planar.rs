//! Planar linkages with one degree of freedom.

use super::dual::Differentiable;
use super::mechanism::Mechanism;

/// Gravity, m/s².
const G: f64 = 9.81;

/// A slider-crank: a rod connects the pin of a rotating crank to a slider on the x-axis. A spring and a damper act on
/// the slider.
///
/// The positions are (φ, x, y, θ, s): the angle of the crank, the center and angle of the rod, and the position of the
/// slider. The ends of the rod coincide with the pin and the slider, which gives four constraints.
#[derive(Debug, Clone, Copy, Default)]
pub struct SliderCrank;

impl SliderCrank {
    /// Lengths of the crank and the rod, m.
    const LENGTHS: [f64; 2] = [0.15, 0.4];
    /// Moment of inertia of the crank about its bearing, kg m².
    const CRANK: f64 = 2e-3;
    /// Mass of the rod, kg.
    const ROD: f64 = 0.6;
    /// Mass of the slider, kg.
    const SLIDER: f64 = 0.9;
    /// Stiffness (N/m), damping (N s/m) and rest position (m) of the spring and the damper at the slider.
    const SPRING: [f64; 3] = [800.0, 2.0, 0.35];
}

impl Mechanism for SliderCrank {
    fn n_positions(&self) -> usize {
        5
    }

    fn n_constraints(&self) -> usize {
        4
    }

    fn inertia<S: Differentiable>(&self, _q: &[S], a: &[S], out: &mut [S]) {
        let turning = Self::ROD * Self::LENGTHS[1].powi(2) / 12.0;
        let masses = [Self::CRANK, Self::ROD, Self::ROD, turning, Self::SLIDER];
        for ((out, a), mass) in out.iter_mut().zip(a).zip(masses) {
            *out = a.times(mass);
        }
    }

    fn force<S: Differentiable>(&self, q: &[S], v: &[S], out: &mut [S]) {
        let [stiffness, damping, rest] = Self::SPRING;
        out.fill(S::from(0.0));
        out[2] = S::from(-G * Self::ROD);
        out[4] = (S::from(rest) - q[4]).times(stiffness) - v[4].times(damping);
    }

    fn constraint<S: Differentiable>(&self, q: &[S], out: &mut [S]) {
        let [crank, rod] = Self::LENGTHS;
        let (half_x, half_y) = (q[3].cos().times(0.5 * rod), q[3].sin().times(0.5 * rod));
        out[0] = q[1] - half_x - q[0].cos().times(crank);
        out[1] = q[2] - half_y - q[0].sin().times(crank);
        out[2] = q[1] + half_x - q[4];
        out[3] = q[2] + half_y;
    }

    /// Returns a state in which the crank is at 1 rad and turns at 12 rad/s.
    fn start(&self) -> (Vec<f64>, Vec<f64>) {
        let [crank, rod] = Self::LENGTHS;
        let (phi, speed) = (1.0_f64, 12.0);
        let theta = (-crank / rod * phi.sin()).asin();
        let turning = -crank * phi.cos() * speed / (rod * theta.cos());
        let slider = crank * phi.cos() + rod * theta.cos();
        let sliding = -crank * phi.sin() * speed - rod * theta.sin() * turning;
        let (x, y) = (slider - 0.5 * rod * theta.cos(), -0.5 * rod * theta.sin());
        let x_speed = sliding + 0.5 * rod * theta.sin() * turning;
        let y_speed = -0.5 * rod * theta.cos() * turning;
        let velocities = vec![speed, x_speed, y_speed, turning, sliding];
        (vec![phi, x, y, theta, slider], velocities)
    }
}

/// A four-bar linkage: a crank, a coupler and a rocker between bearings at (0, 0) and (d, 0), of which one is damped.
/// The linkage is released at rest and moves under gravity.
///
/// The nine positions are (x, y, θ) of each bar, where (x, y) is the center. Each of the four joints gives two
/// constraints.
#[derive(Debug, Clone, Copy, Default)]
pub struct FourBar;

impl FourBar {
    /// Lengths of the crank, the coupler and the rocker, m.
    const LENGTHS: [f64; 3] = [0.3, 0.9, 0.7];
    /// Distance between the bearings, m.
    const BASE: f64 = 0.8;
    /// Mass per length of the bars, kg/m.
    const DENSITY: f64 = 2.0;
    /// Damping in the bearing of the crank, N m s.
    const DAMPING: f64 = 0.02;
}

impl Mechanism for FourBar {
    fn n_positions(&self) -> usize {
        9
    }

    fn n_constraints(&self) -> usize {
        8
    }

    fn inertia<S: Differentiable>(&self, _q: &[S], a: &[S], out: &mut [S]) {
        for (bar, length) in Self::LENGTHS.into_iter().enumerate() {
            let mass = Self::DENSITY * length;
            let of_bar = [mass, mass, mass * length * length / 12.0];
            for (k, mass) in of_bar.into_iter().enumerate() {
                out[3 * bar + k] = a[3 * bar + k].times(mass);
            }
        }
    }

    fn force<S: Differentiable>(&self, _q: &[S], v: &[S], out: &mut [S]) {
        out.fill(S::from(0.0));
        for (bar, length) in Self::LENGTHS.into_iter().enumerate() {
            out[3 * bar + 1] = S::from(-G * Self::DENSITY * length);
        }
        out[2] = v[2].times(-Self::DAMPING);
    }

    fn constraint<S: Differentiable>(&self, q: &[S], out: &mut [S]) {
        // The ends of bar k are its center plus and minus half of the bar.
        let end = |bar: usize, sign: f64| {
            let (q, half) = (&q[3 * bar..], 0.5 * sign * Self::LENGTHS[bar]);
            [q[0] + q[2].cos().times(half), q[1] + q[2].sin().times(half)]
        };
        let fixed = |x: f64| [S::from(x), S::from(0.0)];
        let joints = [
            (end(0, -1.0), fixed(0.0)),
            (end(0, 1.0), end(1, -1.0)),
            (end(1, 1.0), end(2, 1.0)),
            (end(2, -1.0), fixed(Self::BASE)),
        ];
        for (out, (a, b)) in out.chunks_exact_mut(2).zip(joints) {
            out[0] = a[0] - b[0];
            out[1] = a[1] - b[1];
        }
    }

    /// Returns a state in which the crank is at 1.2 rad.
    fn start(&self) -> (Vec<f64>, Vec<f64>) {
        let [crank, coupler, rocker] = Self::LENGTHS;
        let (bearing, far) = ([0.0, 0.0], [Self::BASE, 0.0]);
        let pin = [crank * 1.2_f64.cos(), crank * 1.2_f64.sin()];
        let joint = meeting((pin, coupler), (far, rocker));
        let bars = [(bearing, pin), (pin, joint), (far, joint)];
        let placed = bars.map(|(a, b)| {
            let angle = (b[1] - a[1]).atan2(b[0] - a[0]);
            [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1]), angle]
        });
        (placed.concat(), vec![0.0; 9])
    }
}

/// A linkage with three loops through one joint. A torque drives the linkage against a stiff spring. The problem has
/// the same difficulties as Andrews' squeezing mechanism, but different data.
///
/// The positions are the absolute angles q of five uniform bars. Three chains connect the joint P to fixed points: a
/// crank (0) and a bar (1) to the origin, a rocker (2) to A, and two bars (3, 4) to B. The condition that the chains
/// meet at P gives four constraints. A spring pulls the elbow of the last two bars toward C.
///
/// ```text
/// T = ½ Σ a_ij cos(q_i − q_j) q̇_i q̇_j
/// ```
#[derive(Debug, Clone, Copy, Default)]
pub struct Press;

impl Press {
    /// Lengths of the bars, m.
    const LENGTHS: [f64; 5] = [0.008, 0.03, 0.035, 0.02, 0.025];
    /// Masses of the bars, kg.
    const MASSES: [f64; 5] = [0.05, 0.02, 0.03, 0.02, 0.025];
    /// Positions of A, B and C, m.
    const PLACES: [[f64; 2]; 3] = [[0.02, -0.03], [-0.012, 0.015], [-0.04, 0.02]];
    /// Pairs (inner, outer) of bars in which the outer bar is attached to the inner bar.
    const CHAINS: [(usize, usize); 2] = [(0, 1), (3, 4)];
    /// Torque that drives the crank, N m.
    const TORQUE: f64 = 0.04;
    /// Stiffness (N/m) and rest length (m) of the spring.
    const SPRING: [f64; 2] = [4000.0, 0.012];

    /// Returns the coefficient a_ij.
    fn coefficient(i: usize, j: usize) -> f64 {
        let moment = |k: usize| Self::MASSES[k] * Self::LENGTHS[k];
        if i == j {
            let carried = Self::CHAINS.iter().find(|(inner, _)| *inner == i);
            let carried = carried.map_or(0.0, |&(_, outer)| Self::MASSES[outer]);
            return (Self::MASSES[i] / 3.0 + carried) * Self::LENGTHS[i].powi(2);
        }
        let chain = Self::CHAINS.iter().find(|&&c| c == (i, j) || c == (j, i));
        chain.map_or(0.0, |&(inner, outer)| 0.5 * moment(outer) * Self::LENGTHS[inner])
    }

    /// Returns the vector along bar k.
    fn bar<S: Differentiable>(q: &[S], k: usize) -> [S; 2] {
        [q[k].cos(), q[k].sin()].map(|c| c.times(Self::LENGTHS[k]))
    }
}

impl Mechanism for Press {
    fn n_positions(&self) -> usize {
        5
    }

    fn n_constraints(&self) -> usize {
        4
    }

    fn inertia<S: Differentiable>(&self, q: &[S], a: &[S], out: &mut [S]) {
        for (i, out) in out.iter_mut().enumerate() {
            *out = S::from(0.0);
            for (j, &a) in a.iter().enumerate() {
                *out = *out + ((q[i] - q[j]).cos() * a).times(Self::coefficient(i, j));
            }
        }
    }

    fn force<S: Differentiable>(&self, q: &[S], v: &[S], out: &mut [S]) {
        for (i, out) in out.iter_mut().enumerate() {
            *out = S::from(0.0);
            for j in 0..v.len() {
                let centrifugal = (q[i] - q[j]).sin() * v[j] * v[j];
                *out = *out - centrifugal.times(Self::coefficient(i, j));
            }
        }
        out[0] = out[0] + S::from(Self::TORQUE);
        // The spring connects C to the elbow at B + bar 3.
        let [_, b, c] = Self::PLACES;
        let [stiffness, rest] = Self::SPRING;
        let bar = Self::bar(q, 3);
        let reach = [0, 1].map(|k| bar[k] + S::from(b[k] - c[k]));
        let length = (reach[0] * reach[0] + reach[1] * reach[1]).sqrt();
        let pull = (S::from(rest) / length - S::from(1.0)).times(stiffness);
        out[3] = out[3] + pull * (reach[1] * bar[0] - reach[0] * bar[1]);
    }

    fn constraint<S: Differentiable>(&self, q: &[S], out: &mut [S]) {
        let [a, b, _] = Self::PLACES;
        let bars = [0, 1, 2, 3, 4].map(|k| Self::bar(q, k));
        for k in 0..2 {
            let joint = bars[0][k] + bars[1][k];
            out[k] = joint - bars[2][k] - S::from(a[k]);
            out[2 + k] = joint - bars[3][k] - bars[4][k] - S::from(b[k]);
        }
    }

    /// Returns a state at rest in which the crank is at 0.3 rad.
    fn start(&self) -> (Vec<f64>, Vec<f64>) {
        let [a, b, _] = Self::PLACES;
        let length = Self::LENGTHS;
        let pin = [length[0] * 0.3_f64.cos(), length[0] * 0.3_f64.sin()];
        let joint = meeting((a, length[2]), (pin, length[1]));
        let elbow = meeting((b, length[3]), (joint, length[4]));
        let angle = |from: [f64; 2], to: [f64; 2]| (to[1] - from[1]).atan2(to[0] - from[0]);
        let bars = [([0.0, 0.0], pin), (pin, joint), (a, joint), (b, elbow), (elbow, joint)];
        let angles = bars.map(|(from, to)| angle(from, to));
        (angles.to_vec(), vec![0.0; 5])
    }
}

/// Returns the intersection of two circles, each given by its center and radius. Of the two intersections, it is the
/// one to the left of the line from the first center to the second.
fn meeting((p, r): ([f64; 2], f64), (q, s): ([f64; 2], f64)) -> [f64; 2] {
    let (dx, dy) = (q[0] - p[0], q[1] - p[1]);
    let distance = dx.hypot(dy);
    let along = (r * r - s * s + distance * distance) / (2.0 * distance);
    let across = (r * r - along * along).sqrt();
    let (ex, ey) = (dx / distance, dy / distance);
    [p[0] + along * ex - across * ey, p[1] + along * ey + across * ex]
}
