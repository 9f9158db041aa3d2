use super::Start;
use super::dual::Differentiable;
use super::equations::Equations;

/// Two tanks that supply three junctions through a network of pipes.
///
/// ```text
/// A_k ḣ_k = −(flow out of tank k)
/// ℓ_j q̇_j = p_from − p_to − r_j q_j √(q_j² + ε²)      (ℓ_j = 0 without inertia)
/// Σ_in q − Σ_out q = demand(t) at each junction
/// ```
///
/// The unknowns (h, q, p) are the levels h (m) of the tanks, the flows q (m³/s), and the pressures p (Pa) at the
/// junctions. The pressure of a tank is ρ g h. Without inertia, the index is 1; with inertia, the pressures have index
/// 2. The system starts at rest, and the demand rises and falls smoothly.
#[derive(Debug, Clone, Copy)]
pub struct Pipes {
    inertia: bool,
}

/// Start and end of each pipe. The tanks are 0 and 1, and the junctions are 2 to 4.
const PIPES: [(usize, usize); 6] = [(0, 2), (0, 3), (1, 3), (1, 4), (2, 3), (3, 4)];
/// Friction coefficients r, Pa s²/m⁶.
const FRICTION: [f64; 6] = [4e6, 9e6, 6e6, 5e6, 2e7, 3e7];
/// Inertia coefficients ℓ, Pa s²/m³.
const INERTIA: [f64; 6] = [3e5, 6e5, 5e5, 4e5, 1e6, 8e5];
/// Cross-sectional areas A of the tanks, m².
const AREAS: [f64; 2] = [2.0, 3.0];
/// Specific weight ρ g, Pa/m.
const WEIGHT: f64 = 9810.0;
/// Level of the tanks at rest, m.
const LEVEL: f64 = 10.0;
/// Flow ε below which friction is linear, m³/s.
const LAMINAR: f64 = 1e-3;

impl Pipes {
    /// Creates the network with or without the inertia of the water in its pipes.
    pub fn new(inertia: bool) -> Self {
        Self { inertia }
    }

    /// Returns the demand at the junctions, m³/s.
    fn demand(t: f64) -> [f64; 3] {
        [(0.03, 0.4), (0.05, 0.25), (0.02, 0.7)].map(|(size, rate)| {
            let wave = (rate * t).sin();
            size * wave * wave
        })
    }
}

impl Equations for Pipes {
    fn n_unknowns(&self) -> usize {
        11
    }

    fn residual<S: Differentiable>(&self, t: f64, y: &[S], y_dot: &[S], residual: &mut [S]) {
        let (levels, flows, pressures) = (&y[..2], &y[2..8], &y[8..]);
        // Net flow from each node into the pipes.
        let mut loss = [S::from(0.0); 5];
        for (&(from, to), &q) in PIPES.iter().zip(flows) {
            loss[from] = loss[from] + q;
            loss[to] = loss[to] - q;
        }
        let pressure = |place: usize| match place {
            0 | 1 => levels[place].times(WEIGHT),
            _ => pressures[place - 2],
        };
        for k in 0..2 {
            residual[k] = y_dot[k].times(AREAS[k]) + loss[k];
        }
        for (j, &(from, to)) in PIPES.iter().enumerate() {
            let q = flows[j];
            let friction = (q * (q * q + S::from(LAMINAR * LAMINAR)).sqrt()).times(FRICTION[j]);
            let balance = friction - pressure(from) + pressure(to);
            residual[2 + j] = match self.inertia {
                true => y_dot[2 + j].times(INERTIA[j]) + balance,
                false => balance,
            };
        }
        for (k, demand) in Self::demand(t).into_iter().enumerate() {
            residual[8 + k] = loss[2 + k] + S::from(demand);
        }
    }

    fn n_differential(&self) -> usize {
        if self.inertia { 8 } else { 2 }
    }

    fn indices(&self) -> Vec<u8> {
        let mut indices = vec![1; 8];
        indices.resize(11, if self.inertia { 2 } else { 1 });
        indices
    }

    fn start(&self) -> Start {
        let mut y = vec![0.0; 11];
        y[..2].fill(LEVEL);
        y[8..].fill(WEIGHT * LEVEL);
        Start { t: 0.0, y, y_dot: vec![0.0; 11] }
    }
}
