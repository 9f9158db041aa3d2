//! The one-dimensional chain of the paper: a cross-section through the tissue.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::drive::Reach;
use crate::error::Error;
use crate::network::{Coefficients, Network, Node};

/// Outer neighbors of the oscillators at the ends of a chain.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Ends {
    /// A ring, as in the paper: y_0 = y_N and y_{N+1} = y_1. For N = 2, the only neighbor couples from both sides; for
    /// N = 1, the oscillator is its own neighbor. Identical oscillators with equal initial values move like a single one.
    #[default]
    Periodic,
    /// No coupling from outside: y_0 = y_{N+1} = 0.
    Open,
}

/// A chain of N oscillators with nearest-neighbor coupling, or several such chains at different points.
///
/// `ÿ_n + ω_n² y_n − μ (1 − y_n²) ẏ_n + a y_n³ − D_n (y_{n+1} + y_{n−1})/2 + c(u) = 0`, `D_n = D ω_n`. Paper: eqs.
/// (22), (24).
///
/// # Shapes
/// N is the length of `omega`; the forcing has one component.
///
/// # Units
/// `omega` in rad/s.
///
/// # Examples
/// ```
/// use myovib_oscillators::{Chain, Coefficients, Detuning, Ends, Reach};
/// # fn main() -> Result<(), myovib_oscillators::Error> {
/// let chain = Chain {
///     omega: Detuning::default().frequencies(20)?,
///     coefficients: Coefficients::default(),
///     ends: Ends::Periodic,
///     reach: Reach::All,
/// };
/// assert_eq!(chain.network()?.n_states(), 40);
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Chain {
    /// Natural frequencies ω_1 … ω_N in rad/s.
    pub omega: Vec<f64>,
    /// μ, a and D.
    pub coefficients: Coefficients,
    /// Periodic or open.
    pub ends: Ends,
    /// Oscillators on which the forcing acts. The boundary consists of the first and the last oscillator.
    pub reach: Reach,
}

impl Chain {
    /// Returns the equations of this chain.
    ///
    /// # Errors
    /// Returns [`Error::NoOscillators`], [`Error::Frequency`] or [`Error::Coefficient`] if the description is
    /// invalid.
    pub fn network(&self) -> Result<Network, Error> {
        self.network_at(1)
    }

    /// Returns the equations of chains at `places` points. All chains have the same length. `omega` lists the
    /// frequencies of the first chain, then the frequencies of the second chain, and so on. Each chain has its own
    /// component of the forcing.
    ///
    /// # Errors
    /// Returns the errors of [`network`](Self::network), and [`Error::ArrayFrequencies`] if the number of
    /// frequencies is not a multiple of `places`.
    pub fn network_at(&self, places: usize) -> Result<Network, Error> {
        let given = self.omega.len();
        let n = given / places.max(1);
        if n * places != given {
            let (columns, rows) = (n, places);
            return Err(Error::ArrayFrequencies { columns, rows, given });
        }
        let nodes: Vec<Node> = (0..given)
            .map(|number| {
                let (place, k) = (number / n, number % n);
                let reached = self.reach == Reach::All || k == 0 || k + 1 == n;
                let neighbors = line_neighbors(k, n, self.ends);
                Node {
                    omega: self.omega[number],
                    neighbors: neighbors.map(|k| place * n + k).collect(),
                    channel: reached.then_some(place),
                }
            })
            .collect();
        Network::new(&nodes, self.coefficients, places)
    }
}

/// Returns the left and right neighbors of position `k` on a line of `n` positions.
pub(crate) fn line_neighbors(k: usize, n: usize, ends: Ends) -> impl Iterator<Item = usize> {
    let inside = |neighbor: Option<usize>| neighbor.filter(|&m| m < n);
    let (left, right) = match ends {
        Ends::Periodic => (Some((k + n - 1) % n), Some((k + 1) % n)),
        Ends::Open => (inside(k.checked_sub(1)), inside(Some(k + 1))),
    };
    left.into_iter().chain(right)
}
