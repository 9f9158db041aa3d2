//! Chains and arrays of Van der Pol–Duffing oscillators, and how coherent they are.
//!
//! This crate owns the microscale of the paper (section 1.2): the equations of the oscillators as
//! residual and Jacobian blocks, the frequencies they start from, and the measures of coherence.
//! It integrates nothing. A model stacks the blocks under those of a rod or a muscle, or hands
//! them to an integrator alone.
//!
//! # Cast of types
//! - [`Coefficients`]: μ, a and D of eq. (22), with the paper's values as default.
//! - [`Chain`], [`Array`]: what the user describes: frequencies, ends, reach of the forcing.
//! - [`Network`]: what both become: residual, Jacobian, coupling column.
//! - [`Drive`]: the forcing c(u) = γ u and the oscillators it reaches.
//! - [`Detuning`]: frequencies ω_n = ω + ξ_n drawn by a named, seeded [`Generator`].
//! - [`Coherence`], [`Settled`], [`SmoothCoherence`]: Ψ and χ of eq. (23) at one time, over a
//!   trailing window, and as a differentiable function of the states.
//! - [`Neighbourhood`]: the coherence of places that are near each other.
//! - [`samples`]: systems with a known solution.
//!
//! # References
//! B. Simeon, R. Serban, L. Petzold, ESAIM: M2AN 43 (2009) 805–823, sections 1.2, 1.3 and 3.1.
#![forbid(unsafe_code)]

mod array;
mod chain;
mod coherence;
mod detuning;
mod drive;
mod error;
mod neighbourhood;
mod network;
pub mod samples;
mod settled;
mod smooth;
mod turning;

pub use array::Array;
pub use chain::{Chain, Ends};
pub use coherence::{Coherence, centroid_frequency, coherence_at, phasors};
pub use detuning::{Detuning, Generator};
pub use drive::{Drive, Reach};
pub use error::Error;
pub use neighbourhood::Neighbourhood;
pub use network::{Coefficients, Network};
pub use settled::Settled;
pub use smooth::SmoothCoherence;
pub use turning::mean_frequency;

/// Design notes.
pub mod notes {
    #[doc = include_str!("../notes/0001-one-network.md")]
    pub mod one_network {}
}
