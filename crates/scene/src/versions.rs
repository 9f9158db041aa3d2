//! Versions of the program and its libraries.

use serde::Serialize;

/// Versions that every JSON document contains.
#[derive(Debug, Clone, Serialize)]
pub struct Versions {
    /// Version of this program.
    pub myovib: &'static str,
    /// Git revision of the build. The suffix `-modified` indicates local changes. The revision is `unknown` if the
    /// program was built outside a git repository.
    pub git: &'static str,
    /// Version of the linked SUNDIALS library, queried at run time.
    pub sundials: String,
    /// Version of KLU according to the headers at build time, because the library cannot be queried. `None` if the
    /// program was built without KLU.
    pub klu: Option<String>,
}

impl Versions {
    /// Returns the version of KLU, or a text that names its replacement in this build.
    pub fn klu_text(&self) -> &str {
        self.klu.as_deref().unwrap_or("none (faer is used instead)")
    }

    /// Returns the versions of this program and its libraries.
    pub fn found() -> Self {
        let linked = sundials_wrap::Versions::linked();
        Self {
            myovib: env!("CARGO_PKG_VERSION"),
            git: env!("MYOVIB_GIT_REVISION"),
            sundials: linked.sundials,
            klu: linked.sparse.map(|sparse| sparse.klu),
        }
    }
}
