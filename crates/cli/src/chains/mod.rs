//! The runs of chains behind figures, films and sweeps: those of the scenes `figure3` and `figure7`.
//!
//! Cast: [`on_its_body`] runs a scene's body with its chain as one system; [`record`] keeps the
//! motion of the point that drives it, and [`replay`] runs a chain on what was kept; a [`ChainRun`]
//! is what a run came to.

mod document;
mod run;

pub use document::{SettledJson, chain_document};
pub use run::{ChainRun, on_its_body, record, replay};

/// Time between samples of the coherence, s: 12.5 per cycle of 8 Hz, 6 per cycle of the ripple of
/// 16 Hz. A passage of the centroid by zero is shorter; its frequency counts turns.
pub const EVERY: f64 = 0.01;
