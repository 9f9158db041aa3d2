//! Runs of chains for figures, movies and sweeps. The scenes are `figure3` and `figure7`.
//!
//! [`on_its_body`] integrates the body of a scene and its chain as one system. [`record`] stores the motion of the
//! driving point, and [`replay`] runs a chain on the recorded motion. A [`ChainRun`] contains the result.

mod document;
mod run;

pub use document::chain_document;
pub use run::{ChainRun, on_its_body, record, replay};

/// Sampling interval of the coherence (s). It gives 12.5 samples per cycle at 8 Hz, and about 6 per cycle of the ripple
/// at 16 Hz. The centroid can pass zero between two samples; its frequency is therefore computed from full turns.
pub const EVERY: f64 = 0.01;
