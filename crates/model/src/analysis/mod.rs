//! What the matrices say of a model, and what that means for a run.
//!
//! Cast: [`index`] computes the index of a DAE, [`table1`] those of the paper's Table 1; [`inf_sup`]
//! says how well pressures are held, [`spectrum`] has eigenfrequencies; [`counterexample`] is the
//! paper's warning of section 2; [`check`] puts together what can be said of a run before it, `objections` what is
//! likely wrong with it, `cost` what a step costs, at the machine's `speed`.

pub mod check;
mod cost;
pub mod counterexample;
pub(crate) mod free_parts;
pub mod index;
pub mod inf_sup;
mod objections;
pub mod spectrum;
mod speed;
pub mod support;
pub mod table1;
