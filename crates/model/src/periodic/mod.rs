//! Periodic states of a driven system, computed by shooting.
//!
//! A [`PeriodMap`] integrates the differential variables over one period. [`shoot`] finds a periodic state, y(T; y₀) =
//! y₀, by Newton's method with GMRES. [`multipliers`] returns the leading eigenvalues of the derivative of the map
//! (Floquet multipliers). The state is stable if all multipliers are inside the unit circle. [`follow`] traces a curve
//! of periodic states as a function of a parameter, such as the frequency. The curve may contain folds.
//!
//! Products with the derivative of the map are computed by finite differences. They are therefore available for every
//! formulation, also with viscoelastic stress and with chains.

mod balance;
mod continuation;
mod krylov;
mod map;
mod shooting;

pub use balance::balance;
pub use continuation::{Continuation, Point, follow};
pub use map::{Interval, PeriodMap, StartInterval};
pub use shooting::{Multipliers, PeriodicState, Shooting, multipliers, shoot};
