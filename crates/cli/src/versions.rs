//! Version information printed by `--version`.

use std::sync::LazyLock;

use myovib_scene::versions::Versions;

/// Returns the text that `--version` prints after the name.
pub fn long() -> &'static str {
    static TEXT: LazyLock<String> = LazyLock::new(|| {
        let found = Versions::found();
        let klu = found.klu_text();
        let Versions { myovib, git, sundials, .. } = &found;
        format!("{myovib} (git {git})\nSUNDIALS {sundials}\nKLU {klu}")
    });
    &TEXT
}
