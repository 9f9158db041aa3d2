//! Newton's linear systems, solved by way of what the formulation knows about them.
//!
//! Cast of types: a [`Condensation`] is the elimination of velocities from the Newton matrix, laid
//! out once for a formulation; [`Condensed`] holds the numbers, real or complex, for one c_j. A
//! [`Splitting`] and a [`Split`] are the same for the stabilized equations, whose system falls into
//! two halves; a [`Reduction`] and a [`Reduced`] are either. [`SparseSystem`] factorises, solves
//! and checks, in the order of one [`Elimination`]. [`CondensedSolver`] is what integrators
//! call.

mod condensation;
mod condensed;
mod quadratic;
mod reduced;
mod relaxation;
mod solver;
mod split;
mod splitting;
mod symmetry;
mod tension;

pub use condensation::Condensation;
pub use condensed::Condensed;
use quadratic::Quadratic;
pub use reduced::{Reduced, Reduction};
pub use solver::CondensedSolver;
pub use split::Split;
pub use splitting::Splitting;

pub use myovib_sparse::{Elimination, LinearWork, Scalar, SparseSystem};
use symmetry::symmetric_signs;
