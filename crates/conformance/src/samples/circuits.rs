//! Nonlinear circuits whose equations are formulated by nodal analysis.

use super::Start;
use super::dual::Differentiable;
use super::equations::Equations;

/// Returns the current of a diode, I_s (exp(u/U_T) − 1).
pub(super) fn diode<S: Differentiable>([saturation, thermal]: [f64; 2], u: S) -> S {
    (u.times(1.0 / thermal).exp() - S::from(1.0)).times(saturation)
}

/// The voltage doubler of Greinacher: two diodes, two capacitors and a load are supplied by a source of 50 Hz.
///
/// ```text
/// (V − u1)/R_s − C1 (u̇1 − u̇2) = 0
/// C1 (u̇1 − u̇2) + i_D(−u2) − i_D(u2 − u3) = 0
/// i_D(u2 − u3) − C2 u̇3 − u3/R_l = 0
/// i_D(u) = I_s (exp(u/U_T) − 1),  V = U sin(2π 50 t)
/// ```
///
/// The index is 1. The coefficient matrix of u̇ is singular, although all derivatives occur.
#[derive(Debug, Clone, Copy, Default)]
pub struct Doubler;

impl Doubler {
    /// Amplitude (V) and angular frequency (1/s) of the source.
    const SOURCE: [f64; 2] = [10.0, 100.0 * std::f64::consts::PI];
    /// Resistances R_s and R_l, Ω.
    const RESISTORS: [f64; 2] = [20.0, 5e3];
    /// Capacitances C1 and C2, F.
    const CAPACITORS: [f64; 2] = [20e-6, 50e-6];
    /// I_s (A) and U_T (V).
    const DIODE: [f64; 2] = [1e-9, 0.045];
}

impl Equations for Doubler {
    fn n_unknowns(&self) -> usize {
        3
    }

    fn residual<S: Differentiable>(&self, t: f64, y: &[S], y_dot: &[S], residual: &mut [S]) {
        let ([size, frequency], [source, load]) = (Self::SOURCE, Self::RESISTORS);
        let [c1, c2] = Self::CAPACITORS;
        let charging = (y_dot[0] - y_dot[1]).times(c1);
        let across = diode(Self::DIODE, y[1] - y[2]);
        let driving = S::from(size * (frequency * t).sin());
        residual[0] = (driving - y[0]).times(1.0 / source) - charging;
        residual[1] = charging + diode(Self::DIODE, -y[1]) - across;
        residual[2] = across - y_dot[2].times(c2) - y[2].times(1.0 / load);
    }

    /// Returns a state in which all voltages are 0. The derivative of the sum of the first two equations gives u̇1 =
    /// u̇2.
    fn start(&self) -> Start {
        let ([size, frequency], [source, _]) = (Self::SOURCE, Self::RESISTORS);
        let [saturation, thermal] = Self::DIODE;
        let rate = size * frequency / (1.0 + 2.0 * source * saturation / thermal);
        Start { t: 0.0, y: vec![0.0; 3], y_dot: vec![rate, rate, 0.0] }
    }
}

/// I_s (A), U_T (V) and α of the transistors.
const TRANSISTOR: [f64; 3] = [1e-6, 0.026, 0.99];

/// Returns the current i(u) of a transistor.
fn emitter<S: Differentiable>(u: S) -> S {
    let [saturation, thermal, _] = TRANSISTOR;
    diode([saturation, thermal], u)
}

/// A pair of transistors with a common emitter resistor. Capacitors couple the pair to a source and to a load.
///
/// ```text
/// (V − u1)/R0 − C1 (u̇1 − u̇2) = 0
/// C1 (u̇1 − u̇2) + (U_b − u2)/R1 − (1 − α) i(u2 − u3) = 0
/// i(u2 − u3) + i(U_b − u3) − u3/R_e − C_e u̇3 = 0
/// (U − u4)/R_c − α i(u2 − u3) − C2 (u̇4 − u̇5) = 0
/// C2 (u̇4 − u̇5) − u5/R_l = 0
/// i(u) = I_s (exp(u/U_T) − 1),  V = 0.1 sin(200π t) + 0.05 sin(470π t)
/// ```
///
/// The index is 1. Two algebraic equations are hidden, because they are linear combinations of the rows.
#[derive(Debug, Clone, Copy, Default)]
pub struct Amplifier;

impl Amplifier {
    /// Voltages U and U_b, V.
    const SUPPLY: [f64; 2] = [9.0, 3.0];
    /// Resistances R0, R1, R_e, R_c and R_l, Ω.
    const RESISTORS: [f64; 5] = [1e3, 2e4, 2.4e3, 4e3, 1e4];
    /// Capacitances C1, C_e and C2, F.
    const CAPACITORS: [f64; 3] = [2e-6, 1e-7, 3e-6];
}

impl Equations for Amplifier {
    fn n_unknowns(&self) -> usize {
        5
    }

    fn residual<S: Differentiable>(&self, t: f64, y: &[S], y_dot: &[S], residual: &mut [S]) {
        let ([supply, base], [r0, r1, r_e, r_c, r_l]) = (Self::SUPPLY, Self::RESISTORS);
        let ([c1, c_e, c2], [.., alpha]) = (Self::CAPACITORS, TRANSISTOR);
        let pi = std::f64::consts::PI;
        let driving = 0.1 * (200.0 * pi * t).sin() + 0.05 * (470.0 * pi * t).sin();
        let (input, output) = ((y_dot[0] - y_dot[1]).times(c1), (y_dot[3] - y_dot[4]).times(c2));
        let (first, second) = (emitter(y[1] - y[2]), emitter(S::from(base) - y[2]));
        residual[0] = (S::from(driving) - y[0]).times(1.0 / r0) - input;
        residual[1] = input + (S::from(base) - y[1]).times(1.0 / r1) - first.times(1.0 - alpha);
        residual[2] = first + second - y[2].times(1.0 / r_e) - y_dot[2].times(c_e);
        residual[3] = (S::from(supply) - y[3]).times(1.0 / r_c) - first.times(alpha) - output;
        residual[4] = output - y[4].times(1.0 / r_l);
    }

    /// Returns a state in which the currents into the bases are balanced and the voltage of the load is 0. The two
    /// hidden equations and their derivatives determine the other values.
    fn start(&self) -> Start {
        let ([supply, base], [r0, r1, r_e, r_c, r_l]) = (Self::SUPPLY, Self::RESISTORS);
        let ([c1, c_e, _], [saturation, thermal, alpha]) = (Self::CAPACITORS, TRANSISTOR);
        let (u2, u3) = (base, base - 0.16);
        let current = emitter(u2 - u3);
        let slope = (current + saturation) / thermal;
        let u1 = -r0 * (1.0 - alpha) * current;
        let u4 = supply - r_c * alpha * current;
        let u3_dot = (2.0 * current - u3 / r_e) / c_e;
        // This is u̇1 − u̇2, while u̇4 = u̇5.
        let input = -u1 / (r0 * c1);
        let driving = std::f64::consts::PI * (0.1 * 200.0 + 0.05 * 470.0);
        // The derivative of the sum of the first two equations.
        let base_slope = (1.0 - alpha) * slope;
        let sum = (driving - input) / r0 + base_slope * u3_dot;
        let u2_dot = sum / (1.0 / r0 + 1.0 / r1 + base_slope);
        // The derivative of the sum of the last two equations.
        let u5_dot = -alpha * slope * (u2_dot - u3_dot) / (1.0 / r_c + 1.0 / r_l);
        Start {
            t: 0.0,
            y: vec![u1, u2, u3, u4, 0.0],
            y_dot: vec![u2_dot + input, u2_dot, u3_dot, u5_dot, u5_dot],
        }
    }
}

/// The transistor amplifier of the Test Set for IVP Solvers, which has two stages and five coupling and bypass
/// capacitors.
///
/// ```text
/// (V − u1)/R0 − C1 (u̇1 − u̇2) = 0
/// C1 (u̇1 − u̇2) + (U_b − 2 u2)/R − (1 − α) i(u2 − u3) = 0
/// i(u2 − u3) − u3/R − C2 u̇3 = 0
/// (U_b − u4)/R − α i(u2 − u3) − C3 (u̇4 − u̇5) = 0
/// C3 (u̇4 − u̇5) + (U_b − 2 u5)/R − (1 − α) i(u5 − u6) = 0
/// i(u5 − u6) − u6/R − C4 u̇6 = 0
/// (U_b − u7)/R − α i(u5 − u6) − C5 (u̇7 − u̇8) = 0
/// C5 (u̇7 − u̇8) − u8/R = 0
/// i(u) = I_s (exp(u/U_T) − 1),  V = 0.1 sin(200π t)
/// ```
///
/// The index is 1. Three algebraic equations are hidden, because they are linear combinations of the rows.
#[derive(Debug, Clone, Copy, Default)]
pub struct TwoStageAmplifier;

impl TwoStageAmplifier {
    /// Voltage U_b, V.
    const SUPPLY: f64 = 6.0;
    /// Resistances R0 and R, Ω.
    const RESISTORS: [f64; 2] = [1e3, 9e3];
    /// Capacitances C1 to C5, F.
    const CAPACITORS: [f64; 5] = [1e-6, 2e-6, 3e-6, 4e-6, 5e-6];
}

impl Equations for TwoStageAmplifier {
    fn n_unknowns(&self) -> usize {
        8
    }

    fn residual<S: Differentiable>(&self, t: f64, y: &[S], y_dot: &[S], residual: &mut [S]) {
        let (supply, [r0, r]) = (S::from(Self::SUPPLY), Self::RESISTORS);
        let [c1, c2, c3, c4, c5] = Self::CAPACITORS;
        let [.., alpha] = TRANSISTOR;
        let driving = 0.1 * (200.0 * std::f64::consts::PI * t).sin();
        let charging = |c: f64, i: usize| (y_dot[i] - y_dot[i + 1]).times(c);
        let [input, middle, output] = [charging(c1, 0), charging(c3, 3), charging(c5, 6)];
        let [first, second] = [emitter(y[1] - y[2]), emitter(y[4] - y[5])];
        residual[0] = (S::from(driving) - y[0]).times(1.0 / r0) - input;
        residual[1] = input + (supply - y[1].times(2.0)).times(1.0 / r) - first.times(1.0 - alpha);
        residual[2] = first - y[2].times(1.0 / r) - y_dot[2].times(c2);
        residual[3] = (supply - y[3]).times(1.0 / r) - first.times(alpha) - middle;
        residual[4] =
            middle + (supply - y[4].times(2.0)).times(1.0 / r) - second.times(1.0 - alpha);
        residual[5] = second - y[5].times(1.0 / r) - y_dot[5].times(c4);
        residual[6] = (supply - y[6]).times(1.0 / r) - second.times(alpha) - output;
        residual[7] = output - y[7].times(1.0 / r);
    }

    /// Returns a state in which no current flows through the transistors and the coupling capacitors. The derivatives
    /// of the three hidden equations determine the other values.
    fn start(&self) -> Start {
        let (supply, [r0, r]) = (Self::SUPPLY, Self::RESISTORS);
        let [_, c2, _, c4, _] = Self::CAPACITORS;
        let [saturation, thermal, alpha] = TRANSISTOR;
        let slope = saturation / thermal;
        let base_slope = (1.0 - alpha) * slope;
        let half = supply / 2.0;
        let [u3_dot, u6_dot] = [-half / (c2 * r), -half / (c4 * r)];
        let driving = 0.1 * 200.0 * std::f64::consts::PI;
        let u2_dot = (driving / r0 + base_slope * u3_dot) / (1.0 / r0 + 2.0 / r + base_slope);
        let load = alpha * slope * (u2_dot - u3_dot);
        let u5_dot = (base_slope * u6_dot - load) / (3.0 / r + base_slope);
        let u8_dot = -alpha * slope * (u5_dot - u6_dot) * r / 2.0;
        Start {
            t: 0.0,
            y: vec![0.0, half, half, supply, half, half, supply, 0.0],
            y_dot: vec![u2_dot, u2_dot, u3_dot, u5_dot, u5_dot, u6_dot, u8_dot, u8_dot],
        }
    }
}

/// A loop of a voltage source, a linear capacitor and a nonlinear capacitor at 1 MHz. The index is 2.
///
/// ```text
/// u1 = V(t)
/// i + C1 u̇1 + q̇(u1 − u2) = 0,     q(u) = C2 u + C3 u³
/// −q̇(u1 − u2) + i_D(u2) = J(t)
/// ```
///
/// The current i of the source depends on V̇, so its index is 2. Steps are about 1e-8 s long. J is chosen such that the
/// exact solution is u1 = U sin ωt, u2 = ½ U (1 − cos 2ωt).
#[derive(Debug, Clone, Copy, Default)]
pub struct CapacitorLoop;

impl CapacitorLoop {
    /// U (V) and ω (1/s).
    const SOURCE: [f64; 2] = [1.0, 2e6 * std::f64::consts::PI];
    /// C1 (F), C2 (F) and C3 (F/V²).
    const CAPACITORS: [f64; 3] = [1e-9, 2e-9, 5e-10];
    /// I_s (A) and U_T (V).
    const DIODE: [f64; 2] = [1e-6, 0.1];

    /// Returns q̇(u) for a voltage u and its derivative.
    fn charging<S: Differentiable>(u: S, rate: S) -> S {
        let [_, c2, c3] = Self::CAPACITORS;
        (S::from(c2) + (u * u).times(3.0 * c3)) * rate
    }

    /// Returns u1, u2 and their derivatives.
    fn voltages(t: f64) -> ([f64; 2], [f64; 2]) {
        let [size, omega] = Self::SOURCE;
        let (sin, cos) = (omega * t).sin_cos();
        let u = [size * sin, size * sin * sin];
        (u, [size * omega * cos, 2.0 * size * omega * sin * cos])
    }

    /// Returns the current i.
    fn current(t: f64) -> f64 {
        let (u, rate) = Self::voltages(t);
        -Self::CAPACITORS[0] * rate[0] - Self::charging(u[0] - u[1], rate[0] - rate[1])
    }
}

impl Equations for CapacitorLoop {
    fn n_unknowns(&self) -> usize {
        3
    }

    fn residual<S: Differentiable>(&self, t: f64, y: &[S], y_dot: &[S], residual: &mut [S]) {
        let (u, rate) = Self::voltages(t);
        let source = diode(Self::DIODE, u[1]) - Self::charging(u[0] - u[1], rate[0] - rate[1]);
        let charging = Self::charging(y[0] - y[1], y_dot[0] - y_dot[1]);
        residual[0] = y[0] - S::from(u[0]);
        residual[1] = y[2] + y_dot[0].times(Self::CAPACITORS[0]) + charging;
        residual[2] = diode(Self::DIODE, y[1]) - charging - S::from(source);
    }

    fn n_differential(&self) -> usize {
        2
    }

    fn indices(&self) -> Vec<u8> {
        vec![1, 1, 2]
    }

    fn start(&self) -> Start {
        let (u, rate) = Self::voltages(0.0);
        Start {
            t: 0.0,
            y: vec![u[0], u[1], Self::current(0.0)],
            y_dot: vec![rate[0], rate[1], 0.0],
        }
    }

    fn exact(&self, t: f64) -> Option<Vec<f64>> {
        let (u, _) = Self::voltages(t);
        Some(vec![u[0], u[1], Self::current(t)])
    }
}
