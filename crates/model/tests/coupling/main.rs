//! Bodies and oscillators as one system.
#![allow(clippy::unwrap_used)] // a test may panic

mod common;
mod condensed;
mod elsewhere;
mod jacobian;
mod muscle_chain;
mod places;
mod replay;
mod rod_chain;
mod two_way;
