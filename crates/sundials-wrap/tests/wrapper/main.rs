//! Tests of the wrapper: published runs, exact solutions and misuse.
#![allow(clippy::unwrap_used)] // helpers outside #[test] functions fail the test as well

mod adjoint;
mod adjoint_failures;
mod answers;
mod common;
mod conformance;
mod decay;
mod endings;
mod failures;
mod features;
mod initial_values;
mod limits;
mod many;
mod misuse;
mod own_solver;
mod published;
mod published_sensitivity;
mod robertson;
mod samples;
mod second_order;
mod sensitivity;
mod states;
mod wrong_jacobian;
