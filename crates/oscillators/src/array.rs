//! The plane array of oscillators, which the paper calls the "straightforward extension" of the chain.

use crate::chain::{Ends, line_neighbors};
use crate::drive::Reach;
use crate::error::Error;
use crate::network::{Coefficients, Network, Node};

/// Number of coordinate directions in which the oscillators of a plane array move.
const DIRECTIONS: usize = 2;

/// A plane array of oscillators, with one equation per oscillator *and coordinate direction*.
///
/// Each direction d obeys the chain's equation with neighbors along both axes, `ÿ + ω_n² y − μ (1 − y²) ẏ + a y³ −
/// D_n/2 (y_east + y_west + y_north + y_south) + c_d(u) = 0`. Paper: section 1.2, after eq. (22), mentions the
/// extension but does not state it. As in the chain, every neighbor is coupled with the factor D_n/2. An open N ×
/// 1 array is therefore equal to two open chains, one per direction.
///
/// # Shapes
/// The oscillator in column i of row j has the index `n = j · columns + i`, also in `omega`. The network has
/// `2 · columns · rows` scalar oscillators: all oscillators of the first direction, followed by all oscillators of
/// the second direction ([`direction`](Self::direction)). The forcing has two components.
///
/// # Units
/// `omega` in rad/s.
///
/// # Examples
/// ```
/// use myovib_oscillators::{Array, Coefficients, Ends, Reach};
/// # fn main() -> Result<(), myovib_oscillators::Error> {
/// let array = Array {
///     columns: 4,
///     rows: 3,
///     omega: vec![50.0; 12],
///     coefficients: Coefficients::default(),
///     ends: Ends::Open,
///     reach: Reach::Boundary,
/// };
/// let network = array.network()?;
/// assert_eq!(network.n_states(), 48);
/// assert_eq!(network.forced_rows(0).count(), 10); // the rim: all except the two in the middle
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Array {
    /// Oscillators along the first axis.
    pub columns: usize,
    /// Oscillators along the second axis.
    pub rows: usize,
    /// Natural frequencies in rad/s, row by row.
    pub omega: Vec<f64>,
    /// μ, a and D.
    pub coefficients: Coefficients,
    /// Periodic or open, along both axes.
    pub ends: Ends,
    /// Oscillators on which the forcing acts. The boundary is the rim of the array.
    pub reach: Reach,
}

impl Array {
    /// Returns the equations of this array.
    ///
    /// # Errors
    /// Returns [`Error::ArrayFrequencies`], [`Error::NoOscillators`], [`Error::Frequency`] or
    /// [`Error::Coefficient`] if the description is invalid.
    pub fn network(&self) -> Result<Network, Error> {
        let Self { columns, rows, .. } = *self;
        if columns.checked_mul(rows) != Some(self.omega.len()) {
            return Err(Error::ArrayFrequencies { columns, rows, given: self.omega.len() });
        }
        let nodes: Vec<Node> = (0..DIRECTIONS)
            .flat_map(|direction| (0..columns * rows).map(move |n| (direction, n)))
            .map(|(direction, n)| self.node(direction, n))
            .collect();
        Network::new(&nodes, self.coefficients, DIRECTIONS)
    }

    /// Returns the index range of the scalar oscillators of one direction, both in ω and in the positions. The
    /// indices of the velocities are larger by the number of scalar oscillators.
    pub fn direction(&self, direction: usize) -> std::ops::Range<usize> {
        let n = self.columns * self.rows;
        direction * n..(direction + 1) * n
    }

    fn node(&self, direction: usize, n: usize) -> Node {
        let Self { columns, rows, ends, .. } = *self;
        let (i, j) = (n % columns, n / columns);
        let number = |i: usize, j: usize| direction * columns * rows + j * columns + i;
        let along_row = line_neighbors(i, columns, ends).map(|i| number(i, j));
        let along_column = line_neighbors(j, rows, ends).map(|j| number(i, j));
        let on_rim = i == 0 || j == 0 || i + 1 == columns || j + 1 == rows;
        Node {
            omega: self.omega[n],
            neighbors: along_row.chain(along_column).collect(),
            channel: (self.reach == Reach::All || on_rim).then_some(direction),
        }
    }
}
