//! Built-in scenes of the program.

macro_rules! scenes {
    ($($name:literal)*) => {
        /// Name and text of each built-in scene.
        pub const BUILTIN: &[(&str, &str)] =
            &[$(($name, include_str!(concat!("../../data/scenes/", $name, ".toml")))),*];
    };
}

scenes! {
    "cantilever"
    "cook-dynamic"
    "cook-static"
    "figure2"
    "figure3"
    "figure4"
    "figure5"
    "figure6"
    "figure7"
    "hardening"
    "init"
    "land1"
    "muscle3d"
    "table1-26-finite-damped"
    "table1-26-finite-undamped"
    "table1-26-inf-damped"
    "table1-26-inf-undamped"
    "table2-1"
    "table2-2"
    "table2-2m"
    "table2-3"
    "table2-31"
    "table2-3m"
    "table2-4"
    "table2-4-order2"
    "table2-4-suppressed"
    "two-way"
    "ventricle"
    "ventricle-coarse"
}

/// Returns the text of the built-in scene with this name.
pub fn builtin_text(name: &str) -> Option<&'static str> {
    BUILTIN
        .iter()
        .find(|(known, _)| *known == name)
        .map(|(_, text)| *text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_scene_of_the_folder_is_built_in() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data/scenes");
        let mut names: Vec<String> = std::fs::read_dir(folder)
            .unwrap()
            .map(|entry| entry.unwrap().path())
            .filter(|path| path.extension().is_some_and(|e| e == "toml"))
            .map(|path| path.file_stem().unwrap().to_string_lossy().into_owned())
            .collect();
        names.sort();
        let known: Vec<&str> = BUILTIN.iter().map(|(name, _)| *name).collect();
        assert_eq!(names, known);
    }
}
