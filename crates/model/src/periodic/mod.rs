//! Periodic states of a driven system, by shooting.
//!
//! A [`PeriodMap`] integrates the differential variables over one period. [`shoot`] finds a state that
//! returns to itself, y(T; y₀) = y₀, by Newton's method with GMRES. [`multipliers`] returns the leading
//! eigenvalues of the derivative of the map (Floquet multipliers): the state is stable if all are inside the unit
//! circle. [`follow`] traces a curve of states over a parameter, such as the frequency, through folds.
//!
//! All products with the derivative are differences of the map, which exist for each formulation, with relaxing
//! stress and with chains.

mod balance;
mod continuation;
mod krylov;
mod map;
mod shooting;

pub use balance::balance;
pub use continuation::{Continuation, Point, follow};
pub use map::{Interval, PeriodMap, StartInterval};
pub use shooting::{Multipliers, PeriodicState, Shooting, multipliers, shoot};
