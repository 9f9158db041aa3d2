//! Which program and which libraries made a result.

use std::sync::LazyLock;

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
    /// KLU as linked.
    pub klu: String,
}

impl Versions {
    /// The versions of this program and of what it runs with.
    pub fn found() -> Self {
        Self {
            myovib: env!("CARGO_PKG_VERSION"),
            git: env!("MYOVIB_GIT_REVISION"),
            sundials: linked_sundials(),
            klu: linked_klu(),
        }
    }
}

/// Width of the integers that SUNDIALS and KLU index with.
pub const INDEX_BITS: usize = sundials_sys::sunindextype::BITS as usize;

/// The version of the headers this program was built against.
fn linked_sundials() -> String {
    format!(
        "{}.{}.{}",
        sundials_sys::SUNDIALS_VERSION_MAJOR,
        sundials_sys::SUNDIALS_VERSION_MINOR,
        sundials_sys::SUNDIALS_VERSION_PATCH
    )
}

/// The version of the headers this program was built against.
fn linked_klu() -> String {
    format!(
        "{}.{}.{}",
        sundials_sys::KLU_MAIN_VERSION,
        sundials_sys::KLU_SUB_VERSION,
        sundials_sys::KLU_SUBSUB_VERSION
    )
}

/// What `--version` prints after the name.
pub fn long() -> &'static str {
    static TEXT: LazyLock<String> = LazyLock::new(|| {
        let Versions {
            myovib,
            git,
            sundials,
            klu,
        } = Versions::found();
        format!("{myovib} (git {git})\nSUNDIALS {sundials}\nKLU {klu}")
    });
    &TEXT
}
