//! Mathematical verification of the model: derivatives, equilibria, agreement of formulations, energy.
#![allow(clippy::unwrap_used)] // a test may panic

mod agreement;
mod common;
mod energy;
mod index3;
mod jacobian;
mod large;
mod orders;
mod parameters;
mod pressure;
mod statics;
mod supports;
