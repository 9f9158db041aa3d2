//! Linear systems of Newton's method, reduced by the structure of the formulation.
//!
//! Main types: A [`Condensation`] describes the elimination of velocities from the Newton matrix and is set up once
//! per formulation. A [`Condensed`] holds the real or complex values for one value of c. [`Splitting`] and [`Split`]
//! are the counterparts for the stabilized equations, whose system splits into two. A [`Reduction`] is either a
//! condensation or a splitting, and a [`Reduced`] holds its values. A [`SparseSystem`] factorizes and solves with the
//! elimination order of an [`Elimination`], and checks the solution. A [`CondensedSolver`] is the interface to the
//! integrators.

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
