//! Analysis of a model's matrices and its consequences for a run.
//!
//! [`index`] computes the index of a DAE, and [`table1`] computes the indices of the paper's Table 1. [`inf_sup`]
//! measures the stability of the pressures, and [`dependent_pressures`] finds undetermined pressures. [`spectrum`]
//! computes eigenfrequencies, and [`counterexample`] reproduces the paper's remark in section 2. [`check`] inspects a
//! scene before it is run, `objections` finds likely mistakes, and `cost` predicts the cost of a step from the `speed`
//! of the machine.

pub mod check;
mod cost;
pub mod counterexample;
mod dependent;
pub(crate) mod free_parts;
pub mod index;
pub mod inf_sup;
mod objections;
pub mod spectrum;
mod speed;
pub mod support;
pub mod table1;

pub use dependent::dependent_pressures;
