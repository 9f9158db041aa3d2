//! Coupled oscillators as residual and Jacobian blocks on slices.
//!
//! [`Network`] is the common ground of the chain and the array: a list of scalar oscillators, each
//! with its frequency, its neighbours and the forcing that reaches it. It knows no geometry
//! (note [0001](crate::notes::one_network)).

use std::collections::BTreeSet;
use std::ops::Range;

use nalgebra_sparse::pattern::SparsityPattern;

use crate::error::Error;

/// The coefficients that all oscillators share.
///
/// Paper: eq. (22), where D_n = D ω_n.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coefficients {
    /// μ of Van der Pol's damping −μ (1 − y²) ẏ, in 1/s.
    pub vdp_mu: f64,
    /// a of Duffing's stiffening a y³, in 1/s².
    pub duffing: f64,
    /// D of the coupling to the neighbours, in 1/s.
    pub coupling: f64,
}

impl Default for Coefficients {
    /// The paper's section 3: μ = 2, a = 0, D = 3.
    fn default() -> Self {
        Self {
            vdp_mu: 2.0,
            duffing: 0.0,
            coupling: 3.0,
        }
    }
}

/// One scalar oscillator of a network, as its builder describes it.
pub(crate) struct Node {
    pub(crate) omega: f64,
    /// One entry per pull of D_n/2; an oscillator that is a neighbour twice is listed twice.
    pub(crate) neighbours: Vec<usize>,
    /// Which component of the forcing reaches this oscillator, if any.
    pub(crate) channel: Option<usize>,
}

/// One pull: oscillator `on` feels `D_n/2` times the position of `by`.
#[derive(Debug, Clone)]
struct Pull {
    on: usize,
    by: usize,
    slot: usize,
    /// In the stiffness.
    stiffness: usize,
}

/// Places of one oscillator's own entries in the compressed columns of the Jacobian.
#[derive(Debug, Clone)]
struct Slots {
    kinematic_position: usize,
    kinematic_velocity: usize,
    momentum_position: usize,
    momentum_velocity: usize,
    /// In those of the stiffness.
    stiffness: usize,
}

/// The equations of N scalar oscillators in first-order form.
///
/// With the states `s = (y_1 … y_N, w_1 … w_N)` and the forcing `c`, the block F(s, ṡ; c) = 0 is
///
/// ```text
/// row n:      ẏ_n − w_n
/// row N + n:  ẇ_n + ω_n² y_n − μ (1 − y_n²) w_n + a y_n³ − D ω_n/2 Σ y_m + c,   m neighbour of n
/// ```
///
/// Paper: eqs. (22), (24). F has no explicit time and is an ODE: ∂F/∂ṡ = I, so that
/// ṡ = −F(s, 0; c).
///
/// # Shapes
/// States, derivatives and residuals have length `2 N`. The forcing has one component per
/// direction: one for a chain, two for a plane array.
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
    /// The rows that each component of the forcing reaches.
    forced: Vec<Vec<usize>>,
    pulls: Vec<Pull>,
    slots: Vec<Slots>,
    pattern: SparsityPattern,
    stiffness_pattern: SparsityPattern,
}

impl Network {
    /// Checks the description and lays out the Jacobian.
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
                // `reached` counts on it.
                debug_assert_eq!(
                    channel,
                    k / (n / n_channels),
                    "channels one after the other"
                );
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
            .flat_map(|(on, node)| node.neighbours.iter().map(move |&by| (on, by)))
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

    /// Number of scalar oscillators N: half the number of states.
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

    /// The natural frequencies ω_n, one per scalar oscillator.
    ///
    /// # Units
    /// rad/s
    pub fn omega(&self) -> &[f64] {
        &self.omega
    }

    /// The rows of the residual to which component `channel` of the forcing is added.
    ///
    /// This is the coupling column: ∂F/∂c is 1 in these rows and 0 elsewhere. A model adds
    /// `a · γ · ∂u/∂q` there, with the gain γ of its [`Drive`](crate::Drive).
    pub fn forced_rows(&self, channel: usize) -> impl Iterator<Item = usize> + '_ {
        self.forced[channel].iter().copied()
    }

    /// The oscillators that component `channel` of the forcing reaches, directly or through their
    /// neighbours: no other component does.
    pub fn reached(&self, channel: usize) -> Range<usize> {
        let n = self.n_oscillators() / self.n_channels();
        channel * n..(channel + 1) * n
    }

    /// Evaluates F(s, ṡ; c) into `residual`, overwriting it.
    ///
    /// # Shapes
    /// `s`, `s_dot`, `residual`: [`n_states`](Self::n_states); `forcing`:
    /// [`n_channels`](Self::n_channels).
    ///
    /// # Panics
    /// When a slice has another length.
    pub fn residual(&self, s: &[f64], s_dot: &[f64], forcing: &[f64], residual: &mut [f64]) {
        let n = self.n_oscillators();
        assert_eq!(s.len(), 2 * n, "states");
        assert_eq!(s_dot.len(), 2 * n, "derivatives");
        assert_eq!(
            forcing.len(),
            self.n_channels(),
            "components of the forcing"
        );
        assert_eq!(residual.len(), 2 * n, "residual");
        let Coefficients {
            vdp_mu, duffing, ..
        } = self.coefficients;
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

    /// The compressed-column pattern of `a ∂F/∂s + b ∂F/∂ṡ` (major dimension: columns).
    ///
    /// It does not depend on the coefficients: an entry that is zero for D = 0 is still there.
    pub fn jacobian_pattern(&self) -> &SparsityPattern {
        &self.pattern
    }

    /// Evaluates `a ∂F/∂s + b ∂F/∂ṡ` into `values`, in the order of the pattern.
    ///
    /// # Panics
    /// When `s` has not the length [`n_states`](Self::n_states) or `values` not one entry per
    /// entry of the pattern.
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

    /// The compressed-column pattern of the stiffness K, N × N, whose entries
    /// [`linearise`](Self::linearise) gives.
    pub fn stiffness_pattern(&self) -> &SparsityPattern {
        &self.stiffness_pattern
    }

    /// Where the entries of the diagonal stand in the [`stiffness_pattern`](Self::stiffness_pattern).
    pub fn stiffness_diagonal(&self) -> impl Iterator<Item = usize> + '_ {
        self.slots.iter().map(|slots| slots.stiffness)
    }

    /// Evaluates what [`jacobian`](Self::jacobian) is made of, the rows N + n of ∂F/∂s: the stiffness K, by
    /// the positions, in the order of its pattern, and the diagonal of the damping, by the velocities.
    ///
    /// # Panics
    /// When a slice has another length than the states, the entries of K and the oscillators have.
    pub fn linearise(&self, s: &[f64], stiffness: &mut [f64], damping: &mut [f64]) {
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

    /// ∂F/∂y and ∂F/∂w of oscillator n's momentum row by its own state.
    fn own_slopes(&self, oscillator: usize, y: f64, w: f64) -> [f64; 2] {
        let Coefficients {
            vdp_mu, duffing, ..
        } = self.coefficients;
        let restoring = self.omega[oscillator].powi(2) + 3.0 * duffing * y.powi(2);
        let damping_slope = 2.0 * vdp_mu * y * w;
        [restoring + damping_slope, -vdp_mu * (1.0 - y.powi(2))]
    }

    /// D_n/2 = D ω_n/2, the pull of one neighbour on oscillator n.
    fn pull_strength(&self, oscillator: usize) -> f64 {
        0.5 * self.coefficients.coupling * self.omega[oscillator]
    }
}

fn check(nodes: &[Node], coefficients: &Coefficients) -> Result<(), Error> {
    if nodes.is_empty() {
        return Err(Error::NoOscillators);
    }
    let Coefficients {
        vdp_mu,
        duffing,
        coupling,
    } = *coefficients;
    for (name, value) in [
        ("vdp_mu", vdp_mu),
        ("duffing", duffing),
        ("coupling", coupling),
    ] {
        if !value.is_finite() {
            return Err(Error::Coefficient { name, value });
        }
    }
    match nodes
        .iter()
        .position(|node| !(node.omega > 0.0 && node.omega.is_finite()))
    {
        Some(k) => Err(Error::Frequency {
            number: k + 1,
            value: nodes[k].omega,
        }),
        None => Ok(()),
    }
}

/// Where an entry stands that the `pattern` has.
fn slot(pattern: &SparsityPattern, row: usize, column: usize) -> usize {
    let within = pattern.lane(column).binary_search(&row);
    pattern.major_offsets()[column] + within.expect("the pattern lists every entry asked for")
}

/// Column m of the stiffness: oscillator m and those it pulls on.
fn stiffness_pattern(nodes: &[Node]) -> SparsityPattern {
    let mut columns: Vec<BTreeSet<usize>> = (0..nodes.len()).map(|k| BTreeSet::from([k])).collect();
    for (on, node) in nodes.iter().enumerate() {
        for &by in &node.neighbours {
            columns[by].insert(on);
        }
    }
    compressed(columns.len(), columns)
}

/// Column y_m: its kinematic row, and the momentum rows of column m of the `stiffness`; column w_m: its two rows.
fn jacobian_pattern(stiffness: &SparsityPattern) -> SparsityPattern {
    let n = stiffness.major_dim();
    let by_position = (0..n).map(|m| {
        let momentum = stiffness.lane(m).iter().map(|row| n + row);
        std::iter::once(m).chain(momentum).collect()
    });
    let by_velocity = (0..n).map(|m| vec![m, n + m]);
    compressed(2 * n, by_position.chain(by_velocity))
}

/// The pattern of a square matrix with these ordered rows in its columns.
fn compressed<C: IntoIterator<Item = usize>>(
    n: usize,
    columns: impl IntoIterator<Item = C>,
) -> SparsityPattern {
    let (mut offsets, mut rows) = (vec![0], Vec::new());
    for column in columns {
        rows.extend(column);
        offsets.push(rows.len());
    }
    SparsityPattern::try_from_offsets_and_indices(n, n, offsets, rows)
        .expect("ordered rows below n make a pattern")
}
