//! Switching circuits: diodes that block, gates driven by pulses, and a pump whose current jumps.

use super::Start;
use super::circuits::diode;
use super::dual::Differentiable;
use super::equations::Equations;

/// Piecewise linear signal through the points (t, value). The signal is constant before the first and after the last
/// point.
#[derive(Debug, Clone, Copy)]
struct Polyline(&'static [(f64, f64)]);

impl Polyline {
    fn value(self, t: f64) -> f64 {
        let after = self.0.partition_point(|point| point.0 <= t);
        match (after.checked_sub(1).map(|k| self.0[k]), self.0.get(after)) {
            (Some((t0, v0)), Some(&(t1, v1))) => v0 + (v1 - v0) * (t - t0) / (t1 - t0),
            (Some((_, last)), None) => last,
            (None, first) => first.map_or(0.0, |point| point.1),
        }
    }

    /// Returns the times at which the slope jumps.
    fn breakpoints(self) -> Vec<f64> {
        self.0.iter().map(|point| point.0).collect()
    }
}

/// A bridge of four diodes between an inductive source and a smoothed load.
///
/// ```text
/// L i̇ + R i = V(t) − (a − b)
/// i = j(a − p) − j(−a),  −i = j(b − p) − j(−b)
/// C ṗ = j(a − p) + j(b − p) − p/R_l
/// j(u) = I_s (exp(u/U_T) − 1) + G u
/// ```
///
/// The unknowns are (i, p, a, b). The index is 1. While all diodes block, only G determines a and b, and the system is
/// nearly of index 2.
#[derive(Debug, Clone, Copy, Default)]
pub struct Bridge;

impl Bridge {
    /// Amplitude (V) and angular frequency (1/s) of the source.
    const SOURCE: [f64; 2] = [12.0, 100.0 * std::f64::consts::PI];
    /// L (H) and R (Ω).
    const CHOKE: [f64; 2] = [2e-3, 1.0];
    /// C (F) and R_l (Ω).
    const LOAD: [f64; 2] = [4e-4, 100.0];
    /// I_s (A) and U_T (V).
    const DIODE: [f64; 2] = [1e-8, 0.05];
    /// Conductance G, S.
    const LEAK: f64 = 1e-6;

    fn branch<S: Differentiable>(u: S) -> S {
        diode(Self::DIODE, u) + u.times(Self::LEAK)
    }
}

impl Equations for Bridge {
    fn n_unknowns(&self) -> usize {
        4
    }

    fn residual<S: Differentiable>(&self, t: f64, y: &[S], y_dot: &[S], residual: &mut [S]) {
        let ([size, omega], [inductance, resistance]) = (Self::SOURCE, Self::CHOKE);
        let [capacity, load] = Self::LOAD;
        let (i, p, a, b) = (y[0], y[1], y[2], y[3]);
        let [to_p, from_earth] = [Self::branch(a - p), Self::branch(-a)];
        let [back_to_p, back_from_earth] = [Self::branch(b - p), Self::branch(-b)];
        let source = S::from(size * (omega * t).sin());
        residual[0] = y_dot[0].times(inductance) + i.times(resistance) - source + a - b;
        residual[1] = y_dot[1].times(capacity) - to_p - back_to_p + p.times(1.0 / load);
        residual[2] = i - to_p + from_earth;
        residual[3] = i + back_to_p - back_from_earth;
    }

    fn n_differential(&self) -> usize {
        2
    }

    fn start(&self) -> Start {
        Start { t: 0.0, y: vec![0.0; 4], y_dot: vec![0.0; 4] }
    }
}

/// Four inverters in a row, driven by pulses whose edges have a finite slope. The voltage of their common supply drops
/// under load. The unit of time is ns.
///
/// ```text
/// C u̇_k = (s − u_k)/R − K max(u_{k−1} − U_t, 0)² u_k/(u_k + U_s),  u_0 = w(t)
/// 0 = (U − s)/R_s − Σ (s − u_k)/R
/// ```
///
/// The unknowns are (u_1 … u_4, s). The index is 1. The second derivative of the current jumps when a gate opens.
#[derive(Debug, Clone, Copy, Default)]
pub struct Inverters;

impl Inverters {
    /// Input w (V) as a function of time (ns).
    const INPUT: Polyline = Polyline(&[
        (5.0, 0.0),
        (5.2, 5.0),
        (10.0, 5.0),
        (10.1, 0.0),
        (17.0, 0.0),
        (18.0, 5.0),
        (20.0, 5.0),
        (20.2, 0.0),
    ]);
    /// Voltages U, U_t and U_s, V.
    const VOLTAGES: [f64; 3] = [5.0, 1.0, 0.5];
    /// Resistances R and R_s, kΩ.
    const RESISTORS: [f64; 2] = [10.0, 0.2];
    /// Capacitance C, pF.
    const CAPACITY: f64 = 0.05;
    /// Gain K, mA/V².
    const GAIN: f64 = 0.3;
    /// Initial values of the outputs, V.
    const OUTPUTS: [f64; 4] = [4.8, 0.1, 4.8, 0.1];

    /// Returns the times (ns) at which the slope of the input jumps.
    pub fn breakpoints(&self) -> Vec<f64> {
        Self::INPUT.breakpoints()
    }

    /// Returns the current that charges an output, minus the current through its gate.
    fn charging<S: Differentiable>(supply: S, gate: S, output: S) -> S {
        let [_, threshold, soft] = Self::VOLTAGES;
        let over = gate - S::from(threshold);
        let drawn = match over.value() > 0.0 {
            true => (over * over * output / (output + S::from(soft))).times(Self::GAIN),
            false => S::from(0.0),
        };
        (supply - output).times(1.0 / Self::RESISTORS[0]) - drawn
    }
}

impl Equations for Inverters {
    fn n_unknowns(&self) -> usize {
        5
    }

    fn residual<S: Differentiable>(&self, t: f64, y: &[S], y_dot: &[S], residual: &mut [S]) {
        let [load, feed] = Self::RESISTORS;
        let supply = y[4];
        let mut gate = S::from(Self::INPUT.value(t));
        residual[4] = (S::from(Self::VOLTAGES[0]) - supply).times(1.0 / feed);
        for k in 0..4 {
            residual[k] = y_dot[k].times(Self::CAPACITY) - Self::charging(supply, gate, y[k]);
            residual[4] = residual[4] - (supply - y[k]).times(1.0 / load);
            gate = y[k];
        }
    }

    fn n_differential(&self) -> usize {
        4
    }

    fn start(&self) -> Start {
        let [load, feed] = Self::RESISTORS;
        let given: f64 = Self::OUTPUTS.iter().map(|u| u / load).sum();
        let supply = (Self::VOLTAGES[0] / feed + given) / (1.0 / feed + 4.0 / load);
        let mut y = Self::OUTPUTS.to_vec();
        let gates = [Self::INPUT.value(0.0), y[0], y[1], y[2]];
        let pairs = gates.into_iter().zip(&y);
        let mut y_dot: Vec<f64> =
            pairs.map(|(gate, &u)| Self::charging(supply, gate, u) / Self::CAPACITY).collect();
        y.push(supply);
        y_dot.push(0.0);
        Start { t: 0.0, y, y_dot }
    }
}

/// A source of piecewise linear voltage with a linear capacitor in parallel and a nonlinear capacitor in series,
/// followed by a diode and a load. The unit of time is µs, and the unit of currents is mA.
///
/// ```text
/// u1 = w(t)
/// i + C1 u̇1 + q̇(u1 − u2) = 0,     q(u) = C2 u + C3 u³
/// −q̇(u1 − u2) + j(u2) + u2/R = 0
/// ```
///
/// The unknowns are (u1, u2, i). The current i depends on ẇ; its index is therefore 2, and it jumps when the slope of w
/// jumps.
#[derive(Debug, Clone, Copy, Default)]
pub struct Pump;

impl Pump {
    /// Input w (V) as a function of time (µs).
    const INPUT: Polyline = Polyline(&[
        (0.2, 0.0),
        (0.25, 3.0),
        (0.6, 3.0),
        (0.65, 0.0),
        (1.0, 0.0),
        (1.01, 2.0),
        (1.5, 3.0),
    ]);
    /// C1 (nF), C2 (nF) and C3 (nF/V²).
    const CAPACITORS: [f64; 3] = [1.0, 2.0, 0.05];
    /// I_s (mA) and U_T (V).
    const DIODE: [f64; 2] = [1e-6, 0.05];
    /// Resistance R, kΩ.
    const LOAD: f64 = 0.5;

    /// Returns the times (µs) at which the slope of the source jumps.
    pub fn breakpoints(&self) -> Vec<f64> {
        Self::INPUT.breakpoints()
    }
}

impl Equations for Pump {
    fn n_unknowns(&self) -> usize {
        3
    }

    fn residual<S: Differentiable>(&self, t: f64, y: &[S], y_dot: &[S], residual: &mut [S]) {
        let [c1, c2, c3] = Self::CAPACITORS;
        let (u, rate) = (y[0] - y[1], y_dot[0] - y_dot[1]);
        let charging = (S::from(c2) + (u * u).times(3.0 * c3)) * rate;
        residual[0] = y[0] - S::from(Self::INPUT.value(t));
        residual[1] = y[2] + y_dot[0].times(c1) + charging;
        residual[2] = diode(Self::DIODE, y[1]) + y[1].times(1.0 / Self::LOAD) - charging;
    }

    fn n_differential(&self) -> usize {
        2
    }

    fn indices(&self) -> Vec<u8> {
        vec![1, 1, 2]
    }

    fn start(&self) -> Start {
        Start { t: 0.0, y: vec![0.0; 3], y_dot: vec![0.0; 3] }
    }
}
