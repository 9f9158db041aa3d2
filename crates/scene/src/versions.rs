//! Versions of the program and its libraries.

use serde::Serialize;

/// Versions printed in every JSON document.
#[derive(Debug, Clone, Serialize)]
pub struct Versions {
    /// Version of this program.
    pub myovib: &'static str,
    /// Git revision of the build, with `-modified` after local changes; `unknown` if built outside
    /// git.
    pub git: &'static str,
    /// Version of the linked SUNDIALS library, queried at run time.
    pub sundials: String,
    /// KLU according to the headers at build time, since the library cannot be queried. `None` in a
    /// build without KLU.
    pub klu: Option<String>,
}

impl Versions {
    /// Returns the version of KLU, or the name of its replacement in this build.
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
