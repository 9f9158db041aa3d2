//! Tests of the integrator, including its orders, its accuracy on published problems, and its failures.
#![allow(clippy::unwrap_used)] // a test may panic

mod adjoint;
mod between;
mod circuits;
mod common;
mod conformance;
mod control;
mod differences;
mod events;
mod exponential;
mod failures;
mod forms;
mod generated;
mod implicit;
mod internal_variables;
mod kinks;
mod limits;
mod misuse;
mod orders;
mod output;
mod published;
mod quadratures;
mod remedies;
mod resume;
mod scales;
mod sensitivity;
mod squeezer;
mod starts;
mod wrong_jacobian;
