//! Tests of the oscillators: equations, random streams, coherence and known solutions.
#![allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

mod coherence;
mod common;
mod detuning;
mod known;
mod network;
mod samples;
mod stiff;
mod synchronization;
