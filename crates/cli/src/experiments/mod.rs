//! The runs of chains behind figures, movies and sweeps: the paper's sections 3.1 and 3.2.
//!
//! Cast: [`ChainArgs`] is what a user may change of the chain, [`ChainSetup`] the chain itself;
//! [`rod_chain`] and [`muscle_chain`] run a body with a chain as one system, [`replay`] a chain on
//! the motion that [`record_rod`] or [`record_muscle`] kept; all give a [`ChainRun`].

mod chain_args;
mod chain_run;
mod muscle_chain;
mod recording;
mod rod_chain;
mod watched;

pub use chain_args::{ChainArgs, ChainSetup, GeneratorName};
pub use chain_run::{ChainRun, ChainRunJson, Course, SettledJson};
pub use muscle_chain::{muscle_chain, muscle_chain_settings, muscle_json, record_muscle};
pub use rod_chain::{record_rod, replay, rod_chain, rod_json};
pub(crate) use watched::run_watched;

/// Time between samples of the coherence, s: 12.5 per cycle of 8 Hz, 6 per cycle of the ripple of
/// 16 Hz. A passage of the centroid by zero is shorter; its frequency counts turns.
pub const EVERY: f64 = 0.01;
