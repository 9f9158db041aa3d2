//! Which program and which libraries made a result.

use serde::Serialize;

/// Versions stated in every JSON document.
#[derive(Debug, Clone, Serialize)]
pub struct Versions {
    /// This program.
    pub myovib: &'static str,
    /// The git revision it was built from, with `-modified` after local changes; `unknown` when
    /// built outside git.
    pub git: &'static str,
    /// SUNDIALS as linked, asked at run time.
    pub sundials: String,
    /// KLU, by the headers it was built with: the library cannot be asked. `None` in a build
    /// without.
    pub klu: Option<String>,
}

impl Versions {
    /// The version of KLU, or what this build has instead.
    pub fn klu_text(&self) -> &str {
        self.klu.as_deref().unwrap_or("none, faer in its place")
    }

    /// The versions of this program and of what it runs with.
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
