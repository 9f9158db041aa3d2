//! Periodic states of a driven system, by shooting.
//!
//! A [`PeriodMap`] integrates the differential variables over one period. [`shoot`] finds a periodic state, y(T; y₀) =
//! y₀, by Newton's method with GMRES. [`multipliers`] returns the leading eigenvalues of the derivative of the map
//! (Floquet multipliers): the state is stable if all are inside the unit circle. [`follow`] traces a curve of states
//! over a parameter, such as the frequency, through folds.
//!
//! Products with the derivative are finite differences of the map, which are available for every formulation, with
//! viscoelastic stress and with chains.

mod balance;
mod continuation;
mod krylov;
mod map;
mod shooting;

pub use balance::balance;
pub use continuation::{Continuation, Point, follow};
pub use map::{Interval, PeriodMap, StartInterval};
pub use shooting::{Multipliers, PeriodicState, Shooting, multipliers, shoot};
