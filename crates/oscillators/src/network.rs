//! Residual and Jacobian blocks of coupled oscillators, evaluated on slices.
//!
//! [`Network`] is the common form of the chain and the array. It is a list of scalar oscillators, each with its
//! frequency, its neighbors and the component of the forcing that acts on it. A network has no geometry (note
//! [0001](crate::notes::one_network)).

use std::ops::Range;

use nalgebra_sparse::pattern::SparsityPattern;
use nalgebra_sparse::{CooMatrix, CscMatrix};

use crate::error::Error;

/// Coefficients shared by all oscillators.
///
/// Paper: eq. (22), where D_n = D ω_n.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coefficients {
    /// Coefficient μ of the Van der Pol damping −μ (1 − y²) ẏ, in 1/s.
    pub vdp_mu: f64,
    /// Coefficient a of the Duffing stiffness a y³, in 1/s².
    pub duffing: f64,
    /// Strength D of the coupling to neighbors, in 1/s.
    pub coupling: f64,
}

impl Default for Coefficients {
    /// Returns the values of the paper's section 3: μ = 2, a = 0, D = 3.
    fn default() -> Self {
        Self { vdp_mu: 2.0, duffing: 0.0, coupling: 3.0 }
    }
}

/// One scalar oscillator of a network.
pub(crate) struct Node {
    pub(crate) omega: f64,
    /// Neighbors, each coupled with the strength D_n/2. A neighbor on both sides is listed twice.
    pub(crate) neighbors: Vec<usize>,
    /// Component of the forcing that acts on this oscillator.
    pub(crate) channel: Option<usize>,
}

/// One coupling term: the position of oscillator `by` enters the equation of oscillator `on` with the factor
/// `D_n/2`.
#[derive(Debug, Clone)]
struct Pull {
    on: usize,
    by: usize,
    slot: usize,
    /// Index of the term in the values of the stiffness matrix.
    stiffness: usize,
}

/// Indices of the entries that couple an oscillator to itself in the values of the Jacobian.
#[derive(Debug, Clone)]
struct Slots {
    kinematic_position: usize,
    kinematic_velocity: usize,
    momentum_position: usize,
    momentum_velocity: usize,
    /// Index of the diagonal entry in the values of the stiffness matrix.
    stiffness: usize,
}

/// The equations of N scalar oscillators in first-order form.
///
/// For the states `s = (y_1 … y_N, w_1 … w_N)` and the forcing `c`, the block F(s, ṡ; c) = 0 consists of the rows
///
/// ```text
/// row n:      ẏ_n − w_n
/// row N + n:  ẇ_n + ω_n² y_n − μ (1 − y_n²) w_n + a y_n³ − D ω_n/2 Σ y_m + c,   m neighbor of n
/// ```
///
/// Paper: eqs. (22), (24). F does not depend explicitly on time, and ∂F/∂ṡ = I, so ṡ = −F(s, 0; c).
///
/// # Shapes
/// States, derivatives and residuals have length `2 N`. The forcing has one component per direction: one for a
/// chain, two for a plane array.
///
/// # Examples
/// ```
/// use myovib_oscillators::{Chain, Coefficients, Ends, Reach};
/// # fn main() -> Result<(), myovib_oscillators::Error> {
/// let network = Chain {
///     omega: vec![50.0, 50.2, 49.9],
///     coefficients: Coefficients::default(),
///     ends: Ends::Periodic,
///     reach: Reach::All,
/// }
/// .network()?;
/// let (s, s_dot) = ([0.0; 6], [0.0; 6]);
/// let mut residual = [0.0; 6];
/// network.residual(&s, &s_dot, &[0.25], &mut residual);
/// assert_eq!(residual, [0.0, 0.0, 0.0, 0.25, 0.25, 0.25]);
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone)]
pub struct Network {
    omega: Vec<f64>,
    coefficients: Coefficients,
    channels: Vec<Option<usize>>,
    /// Rows on which each component of the forcing acts.
    forced: Vec<Vec<usize>>,
    pulls: Vec<Pull>,
    slots: Vec<Slots>,
    pattern: SparsityPattern,
    stiffness_pattern: SparsityPattern,
}

impl Network {
    /// Validates the nodes and builds the pattern of the Jacobian.
    pub(crate) fn new(
        nodes: &[Node],
        coefficients: Coefficients,
        n_channels: usize,
    ) -> Result<Self, Error> {
        check(nodes, &coefficients)?;
        let stiffness = stiffness_pattern(nodes);
        let pattern = jacobian_pattern(&stiffness);
        let n = nodes.len();
        let mut forced = vec![Vec::new(); n_channels];
        for (k, node) in nodes.iter().enumerate() {
            if let Some(channel) = node.channel {
                // `reached` relies on this order of the channels.
                debug_assert_eq!(channel, k / (n / n_channels), "channels one after the other");
                forced[channel].push(n + k);
            }
        }
        let slots = (0..n)
            .map(|k| Slots {
                kinematic_position: slot(&pattern, k, k),
                kinematic_velocity: slot(&pattern, k, n + k),
                momentum_position: slot(&pattern, n + k, k),
                momentum_velocity: slot(&pattern, n + k, n + k),
                stiffness: slot(&stiffness, k, k),
            })
            .collect();
        let pulls = nodes
            .iter()
            .enumerate()
            .flat_map(|(on, node)| node.neighbors.iter().map(move |&by| (on, by)))
            .map(|(on, by)| Pull {
                on,
                by,
                slot: slot(&pattern, n + on, by),
                stiffness: slot(&stiffness, on, by),
            })
            .collect();
        Ok(Self {
            omega: nodes.iter().map(|node| node.omega).collect(),
            coefficients,
            channels: nodes.iter().map(|node| node.channel).collect(),
            forced,
            pulls,
            slots,
            stiffness_pattern: stiffness,
            pattern,
        })
    }

    /// Number of scalar oscillators N, half the number of states.
    pub fn n_oscillators(&self) -> usize {
        self.omega.len()
    }

    /// Number of states and equations, 2 N.
    pub fn n_states(&self) -> usize {
        2 * self.n_oscillators()
    }

    /// Number of components of the forcing.
    pub fn n_channels(&self) -> usize {
        self.forced.len()
    }

    /// Returns the natural frequencies ω_n of the scalar oscillators, in rad/s.
    pub fn omega(&self) -> &[f64] {
        &self.omega
    }

    /// Returns the rows of the residual that contain component `channel` of the forcing.
    ///
    /// These rows define the coupling column: ∂F/∂c is 1 in these rows and 0 elsewhere. A model adds
    /// `a · γ · ∂u/∂q` in these rows, where γ is the gain of its [`Drive`](crate::Drive).
    pub fn forced_rows(&self, channel: usize) -> impl Iterator<Item = usize> + '_ {
        self.forced[channel].iter().copied()
    }

    /// Returns the oscillators that component `channel` of the forcing influences, either directly or through
    /// neighbors. No other component influences these oscillators.
    pub fn reached(&self, channel: usize) -> Range<usize> {
        let n = self.n_oscillators() / self.n_channels();
        channel * n..(channel + 1) * n
    }

    /// Evaluates F(s, ṡ; c) into `residual`, overwriting it.
    ///
    /// # Shapes
    /// `s`, `s_dot` and `residual` have length [`n_states`](Self::n_states); `forcing` has length
    /// [`n_channels`](Self::n_channels).
    ///
    /// # Panics
    /// Panics if a slice has the wrong length.
    pub fn residual(&self, s: &[f64], s_dot: &[f64], forcing: &[f64], residual: &mut [f64]) {
        let n = self.n_oscillators();
        assert_eq!(s.len(), 2 * n, "states");
        assert_eq!(s_dot.len(), 2 * n, "derivatives");
        assert_eq!(forcing.len(), self.n_channels(), "components of the forcing");
        assert_eq!(residual.len(), 2 * n, "residual");
        let Coefficients { vdp_mu, duffing, .. } = self.coefficients;
        let (y, w) = s.split_at(n);
        let (y_dot, w_dot) = s_dot.split_at(n);
        let (kinematic, momentum) = residual.split_at_mut(n);
        for k in 0..n {
            let restoring = self.omega[k].powi(2) * y[k] + duffing * y[k].powi(3);
            let damping = -vdp_mu * (1.0 - y[k].powi(2)) * w[k];
            let c = self.channels[k].map_or(0.0, |channel| forcing[channel]);
            kinematic[k] = y_dot[k] - w[k];
            momentum[k] = w_dot[k] + restoring + damping + c;
        }
        for pull in &self.pulls {
            momentum[pull.on] -= self.pull_strength(pull.on) * y[pull.by];
        }
    }

    /// Returns the compressed-column pattern of `a ∂F/∂s + b ∂F/∂ṡ` (major dimension: columns).
    ///
    /// The pattern does not depend on the coefficients: it includes the entries that vanish for D = 0.
    pub fn jacobian_pattern(&self) -> &SparsityPattern {
        &self.pattern
    }

    /// Evaluates `a ∂F/∂s + b ∂F/∂ṡ` into `values`, in the order of the pattern.
    ///
    /// # Panics
    /// Panics if `s` or `values` has the wrong length.
    pub fn jacobian(&self, s: &[f64], a: f64, b: f64, values: &mut [f64]) {
        let n = self.n_oscillators();
        assert_eq!(s.len(), 2 * n, "states");
        assert_eq!(values.len(), self.pattern.nnz(), "Jacobian values");
        let (y, w) = s.split_at(n);
        values.fill(0.0);
        for (k, slots) in self.slots.iter().enumerate() {
            let [by_position, by_velocity] = self.own_slopes(k, y[k], w[k]);
            values[slots.kinematic_position] = b;
            values[slots.kinematic_velocity] = -a;
            values[slots.momentum_position] = a * by_position;
            values[slots.momentum_velocity] = b + a * by_velocity;
        }
        for pull in &self.pulls {
            values[pull.slot] -= a * self.pull_strength(pull.on);
        }
    }

    /// Returns the compressed-column pattern of the N × N stiffness K, which [`linearize`](Self::linearize) evaluates.
    pub fn stiffness_pattern(&self) -> &SparsityPattern {
        &self.stiffness_pattern
    }

    /// Returns the positions of the diagonal entries in the [`stiffness_pattern`](Self::stiffness_pattern).
    pub fn stiffness_diagonal(&self) -> impl Iterator<Item = usize> + '_ {
        self.slots.iter().map(|slots| slots.stiffness)
    }

    /// Evaluates the rows N + n of ∂F/∂s, which [`jacobian`](Self::jacobian) combines with the other rows. The
    /// derivatives with respect to the positions form the stiffness K, whose values are in the order of its
    /// pattern. The derivatives with respect to the velocities form a diagonal damping matrix, which is returned
    /// as its diagonal.
    ///
    /// # Panics
    /// Panics if a slice has the wrong length.
    pub fn linearize(&self, s: &[f64], stiffness: &mut [f64], damping: &mut [f64]) {
        let n = self.n_oscillators();
        assert_eq!(s.len(), 2 * n, "states");
        assert_eq!(stiffness.len(), self.stiffness_pattern.nnz(), "stiffness");
        assert_eq!(damping.len(), n, "damping");
        let (y, w) = s.split_at(n);
        stiffness.fill(0.0);
        for (k, entry) in self.stiffness_diagonal().enumerate() {
            [stiffness[entry], damping[k]] = self.own_slopes(k, y[k], w[k]);
        }
        for pull in &self.pulls {
            stiffness[pull.stiffness] -= self.pull_strength(pull.on);
        }
    }

    /// Returns ∂F/∂y and ∂F/∂w in the momentum row of an oscillator, with respect to its own state.
    fn own_slopes(&self, oscillator: usize, y: f64, w: f64) -> [f64; 2] {
        let Coefficients { vdp_mu, duffing, .. } = self.coefficients;
        let restoring = self.omega[oscillator].powi(2) + 3.0 * duffing * y.powi(2);
        let damping_slope = 2.0 * vdp_mu * y * w;
        [restoring + damping_slope, -vdp_mu * (1.0 - y.powi(2))]
    }

    /// Returns D_n/2 = D ω_n/2, the factor with which each neighbor of oscillator n is coupled.
    fn pull_strength(&self, oscillator: usize) -> f64 {
        0.5 * self.coefficients.coupling * self.omega[oscillator]
    }
}

fn check(nodes: &[Node], coefficients: &Coefficients) -> Result<(), Error> {
    if nodes.is_empty() {
        return Err(Error::NoOscillators);
    }
    let Coefficients { vdp_mu, duffing, coupling } = *coefficients;
    for (name, value) in [("vdp_mu", vdp_mu), ("duffing", duffing), ("coupling", coupling)] {
        if !value.is_finite() {
            return Err(Error::Coefficient { name, value });
        }
    }
    match nodes.iter().position(|node| !(node.omega > 0.0 && node.omega.is_finite())) {
        Some(k) => Err(Error::Frequency { number: k + 1, value: nodes[k].omega }),
        None => Ok(()),
    }
}

/// Returns the index of an existing entry in the values of `pattern`.
fn slot(pattern: &SparsityPattern, row: usize, column: usize) -> usize {
    let within = pattern.lane(column).binary_search(&row);
    pattern.major_offsets()[column] + within.expect("the entry is in the pattern")
}

/// Returns the pattern of the stiffness. Column m contains the rows of oscillator m and of its neighbors.
fn stiffness_pattern(nodes: &[Node]) -> SparsityPattern {
    let entries = nodes
        .iter()
        .enumerate()
        .flat_map(|(on, node)| node.neighbors.iter().map(move |&by| (on, by)).chain([(on, on)]));
    pattern(nodes.len(), entries)
}

/// Returns the pattern of the Jacobian. Column y_m contains the kinematic row of oscillator m and the momentum
/// rows in column m of the `stiffness`. Column w_m contains the two rows of oscillator m.
fn jacobian_pattern(stiffness: &SparsityPattern) -> SparsityPattern {
    let n = stiffness.major_dim();
    let own = (0..n).flat_map(|m| [(m, m), (m, n + m), (n + m, n + m)]);
    let by_position = stiffness.entries().map(|(m, row)| (n + row, m));
    pattern(2 * n, own.chain(by_position))
}

/// Returns the pattern of a square matrix, given the row and column of each entry.
fn pattern(n: usize, entries: impl Iterator<Item = (usize, usize)>) -> SparsityPattern {
    let mut matrix = CooMatrix::<f64>::new(n, n);
    entries.for_each(|(row, column)| matrix.push(row, column, 0.0));
    CscMatrix::from(&matrix).pattern().clone()
}
