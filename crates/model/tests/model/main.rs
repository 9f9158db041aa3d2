//! Tests of the model from the user's perspective: one file per topic, in one program that is
//! compiled once.
#![allow(clippy::unwrap_used)] // a test may panic

mod adjoint;
mod advice;
mod column;
mod condensation;
mod constrained_masses;
mod counterexample;
mod coupled_settings;
mod end_time;
mod events;
mod inf_sup;
mod long_runs;
mod own_material;
mod periodic;
mod precision;
mod radau;
mod radau_coupled;
mod radau_rows;
mod rod_start;
mod spatial;
mod spectrum;
mod start;
mod support;
mod table1;
mod work;
