//! A section of the scene reference.

/// A section of the reference: keys of the root, and an example in TOML.
pub(super) struct Section {
    pub(super) title: &'static str,
    pub(super) keys: &'static [&'static str],
    pub(super) example: &'static str,
}
