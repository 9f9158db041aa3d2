//! Chains and arrays of Van der Pol–Duffing oscillators, and measures of their coherence.
//!
//! This crate contains the microscale of the paper (section 1.2): residual and Jacobian blocks of the oscillators,
//! their natural frequencies, and the coherence measures. It contains no time integrator. A model combines these
//! blocks with the blocks of a rod or a muscle, or passes them directly to an integrator.
//!
//! # Types
//! - [`Coefficients`]: μ, a and D of eq. (22), with the paper's values as default.
//! - [`Chain`], [`Array`]: descriptions by the user, with frequencies, ends and the reach of the forcing.
//! - [`Network`]: the equations of a chain or an array (residual, Jacobian and coupling column).
//! - [`Drive`]: the forcing c(u) = γ u and the oscillators on which it acts.
//! - [`Detuning`]: frequencies ω_n = ω + ξ_n drawn by a named, seeded [`Generator`].
//! - [`Coherence`]: Ψ and χ of eq. (23) at one point in time.
//! - [`Settled`]: statistics over a trailing window.
//! - [`SmoothCoherence`]: a differentiable coherence.
//! - [`Neighborhood`]: the coherence of nearby places.
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
mod neighborhood;
mod network;
mod settled;
mod smooth;
mod turning;

pub use array::Array;
pub use chain::{Chain, Ends};
pub use coherence::{Coherence, centroid_frequency, coherence_at, phasors};
pub use detuning::{Detuning, Generator};
pub use drive::{Drive, Reach};
pub use error::Error;
pub use neighborhood::Neighborhood;
pub use network::{Coefficients, Network};
pub use settled::Settled;
pub use smooth::SmoothCoherence;
pub use turning::mean_frequency;

/// Design notes.
pub mod notes {
    #[doc = include_str!("../notes/0001-one-network.md")]
    pub mod one_network {}
}
