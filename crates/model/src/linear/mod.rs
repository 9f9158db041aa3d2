//! Newton's linear systems, solved by way of what the formulation knows about them.
//!
//! Cast of types: a [`Condensation`] is the elimination of velocities from the Newton matrix, laid
//! out once for a formulation; [`Condensed`] holds the numbers, real or complex, for one c_j. A
//! [`Splitting`] and a [`Split`] are the same for the stabilized equations, whose system falls into
//! two halves; a [`Reduction`] and a [`Reduced`] are either. [`SparseSystem`] factorises, solves
//! and checks, in the order of one [`Elimination`]. [`CondensedSolver`] is what IDAS calls,
//! [`CondensedMatrices`] what Radau IIA does.

mod condensation;
mod condensed;
mod quadratic;
mod radau;
mod reduced;
mod split;
mod splitting;
mod structured;

pub use condensation::Condensation;
pub use condensed::Condensed;
use quadratic::Quadratic;
pub use radau::CondensedMatrices;
pub use reduced::{Reduced, Reduction};
pub use split::Split;
pub use splitting::Splitting;
pub use structured::CondensedSolver;

pub use myovib_sparse::{Elimination, LinearWork, Number, SparseSystem};
