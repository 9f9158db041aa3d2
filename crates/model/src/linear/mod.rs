//! Linear systems of Newton's method, reduced by the structure of the formulation.
//!
//! Main types: a [`Condensation`] is the elimination of velocities from the Newton matrix, set up
//! once per formulation; [`Condensed`] holds the values, real or complex, for one c. A
//! [`Splitting`] and a [`Split`] are their counterparts for the stabilized equations, whose system
//! splits into two. A [`Reduction`] is one of the first kind or one of the second, a [`Reduced`] their values.
//! [`SparseSystem`] factorizes and solves with the elimination order of an [`Elimination`], and checks the solution.
//! [`CondensedSolver`] is the interface to the integrators.

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
