//! Newton's linear systems, solved by way of what the formulation knows about them.
//!
//! Cast of types: a [`Condensation`] is the elimination of velocities from the Newton matrix, laid
//! out once for a formulation; [`Condensed`] holds the numbers, real or complex, for one c_j;
//! [`SparseSystem`] factorises, solves and checks, in the order of one [`Elimination`]; [`CondensedSolver`] is what IDAS calls,
//! [`CondensedMatrices`] what Radau IIA does; [`CoupledSolver`] and [`CoupledMatrices`] continue them
//! to the oscillators a body drives.

mod condensation;
mod condensed;
mod coupled;
mod number;
mod radau;
mod sparse_system;
mod structured;
pub mod supernodal;

pub use condensation::Condensation;
pub use condensed::Condensed;
pub use coupled::{CoupledMatrices, CoupledSolver};
pub use number::Number;
pub use radau::CondensedMatrices;
pub use sparse_system::{Elimination, LinearWork, SparseSystem};
pub use structured::CondensedSolver;
