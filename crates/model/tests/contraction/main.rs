//! Active and viscous stress, foundations and activation: derivatives, closed forms, energy,
//! counters.
#![allow(clippy::unwrap_used)] // a test may panic

mod allocation;
mod common;
mod energy;
mod equilibria;
mod graded;
mod harmonic;
mod internal_variables;
mod jacobian;
mod modes;
mod refusals;
mod relaxation;
mod stress;
