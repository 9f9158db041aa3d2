//! Factorisations by an engine outside this crate.

use std::fmt::Debug;
use std::sync::{Arc, OnceLock};

use nalgebra_sparse::pattern::SparsityPattern;
use num_complex::Complex64;

use crate::{Factorization, Kind};

/// Factorises in the place of this crate's dense blocks: a library that works in several processes.
///
/// It exchanges pivots by itself where it must.
pub trait Engine: Debug + Send + Sync {
    /// Room for real matrices with this compressed-column pattern.
    fn real(&self, pattern: &Arc<SparsityPattern>, kind: Kind) -> Box<dyn Factorization<f64>>;

    /// Room for complex matrices with this compressed-column pattern.
    fn complex(
        &self,
        pattern: &Arc<SparsityPattern>,
        kind: Kind,
    ) -> Box<dyn Factorization<Complex64>>;
}

/// The engine of this program: like its processes, there is one.
static ENGINE: OnceLock<Arc<dyn Engine>> = OnceLock::new();

/// Gives `engine` all matrices whose pattern is analysed from now on. The first engine stays.
pub fn install(engine: Arc<dyn Engine>) {
    ENGINE.get_or_init(|| engine);
}

/// The engine, if one was [installed](install).
pub(crate) fn installed() -> Option<Arc<dyn Engine>> {
    ENGINE.get().cloned()
}
