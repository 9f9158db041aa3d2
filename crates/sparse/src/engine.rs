//! Factorizations by an engine outside this crate.

use std::fmt::Debug;
use std::sync::{Arc, OnceLock};

use nalgebra_sparse::pattern::SparsityPattern;
use num_complex::Complex64;

use crate::{Factorization, Kind};

/// A factorization library outside this crate that replaces its dense blocks, for example a library that runs in several
/// processes.
///
/// The engine performs its own pivoting if necessary.
pub trait Engine: Debug + Send + Sync {
    /// Allocates factors of real matrices with this compressed-column pattern.
    fn real(&self, pattern: &Arc<SparsityPattern>, kind: Kind) -> Box<dyn Factorization<f64>>;

    /// Allocates factors of complex matrices with this compressed-column pattern.
    fn complex(
        &self,
        pattern: &Arc<SparsityPattern>,
        kind: Kind,
    ) -> Box<dyn Factorization<Complex64>>;
}

/// The engine of this process. There is at most one.
static ENGINE: OnceLock<Arc<dyn Engine>> = OnceLock::new();

/// Uses `engine` for all patterns analyzed from now on. Only the first call has an effect.
pub fn install(engine: Arc<dyn Engine>) {
    ENGINE.get_or_init(|| engine);
}

/// Returns the [installed](install) engine.
pub(crate) fn installed() -> Option<Arc<dyn Engine>> {
    ENGINE.get().cloned()
}
