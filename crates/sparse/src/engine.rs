//! Factorizations by an external engine.

use std::fmt::Debug;
use std::sync::{Arc, OnceLock};

use nalgebra_sparse::pattern::SparsityPattern;
use num_complex::Complex64;

use crate::{Factorization, Kind};

/// An external factorization library that replaces the dense blocks of this crate, for example a library that runs in
/// several processes.
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

/// Engine of this process. At most one engine can be installed.
static ENGINE: OnceLock<Arc<dyn Engine>> = OnceLock::new();

/// Uses `engine` for all patterns that are analyzed later. Only the first call has an effect.
pub fn install(engine: Arc<dyn Engine>) {
    ENGINE.get_or_init(|| engine);
}

/// Returns the [installed](install) engine, if any.
pub(crate) fn installed() -> Option<Arc<dyn Engine>> {
    ENGINE.get().cloned()
}
