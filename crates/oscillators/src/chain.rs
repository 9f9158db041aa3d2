//! The one-dimensional chain of the paper: a cross-section through the tissue.

use crate::drive::Reach;
use crate::error::Error;
use crate::network::{Coefficients, Network, Node};

/// What the oscillators at the ends of the chain have as outer neighbours.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Ends {
    /// y_0 = y_N and y_{N+1} = y_1, the paper's choice. With N = 2 the one neighbour pulls from
    /// both sides; with N = 1 the oscillator is its own neighbour, so that a chain of identical
    /// oscillators moves as this one does.
    #[default]
    Periodic,
    /// y_0 = y_{N+1} = 0: nothing pulls from outside.
    Open,
}

/// A chain of N oscillators with nearest-neighbour coupling, or as many of them as there are places.
///
/// `ÿ_n + ω_n² y_n − μ (1 − y_n²) ẏ_n + a y_n³ − D_n (y_{n+1} + y_{n−1})/2 + c(u) = 0`,
/// `D_n = D ω_n`. Paper: eqs. (22), (24).
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
    /// The oscillators that the forcing reaches; the boundary are the first and the last.
    pub reach: Reach,
}

impl Chain {
    /// The equations of this chain.
    ///
    /// # Errors
    /// [`Error::NoOscillators`], [`Error::Frequency`], [`Error::Coefficient`].
    pub fn network(&self) -> Result<Network, Error> {
        self.network_at(1)
    }

    /// The equations of chains at so many places, all of the same length: ω is that of the first
    /// place, then of the second, …; each has its own component of the forcing.
    ///
    /// # Errors
    /// Those of [`network`](Self::network); [`Error::ArrayFrequencies`] when the frequencies are not
    /// the same number at each place.
    pub fn network_at(&self, places: usize) -> Result<Network, Error> {
        let given = self.omega.len();
        let n = given / places.max(1);
        if n * places != given {
            let (columns, rows) = (n, places);
            return Err(Error::ArrayFrequencies {
                columns,
                rows,
                given,
            });
        }
        let nodes: Vec<Node> = (0..given)
            .map(|number| {
                let (place, k) = (number / n, number % n);
                let reached = self.reach == Reach::All || k == 0 || k + 1 == n;
                let neighbours = line_neighbours(k, n, self.ends);
                Node {
                    omega: self.omega[number],
                    neighbours: neighbours.map(|k| place * n + k).collect(),
                    channel: reached.then_some(place),
                }
            })
            .collect();
        Network::new(&nodes, self.coefficients, places)
    }
}

/// The left and right neighbours of place `k` on a line of `n` places.
pub(crate) fn line_neighbours(k: usize, n: usize, ends: Ends) -> impl Iterator<Item = usize> {
    let inside = |neighbour: Option<usize>| neighbour.filter(|&m| m < n);
    let (left, right) = match ends {
        Ends::Periodic => (Some((k + n - 1) % n), Some((k + 1) % n)),
        Ends::Open => (inside(k.checked_sub(1)), inside(Some(k + 1))),
    };
    left.into_iter().chain(right)
}
