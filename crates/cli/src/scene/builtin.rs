//! The scenes that are part of the program.

/// Name and text of each built-in scene.
pub const BUILTIN: &[(&str, &str)] = &[("init", include_str!("../../../../data/scenes/init.toml"))];

/// The text of the built-in scene of that name.
pub fn builtin_text(name: &str) -> Option<&'static str> {
    BUILTIN
        .iter()
        .find(|(known, _)| *known == name)
        .map(|(_, text)| *text)
}
