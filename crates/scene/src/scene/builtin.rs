//! Built-in scenes of the program.

use super::mesh;
use crate::InputError;
use crate::scene_file::mesh::{MeshSource, Resolution};
use crate::scene_file::read;

#[derive(Debug, Clone, Copy)]
pub struct BuiltinScene {
    /// Name of the scene on the command line.
    pub name: &'static str,
    /// Typical run time on one core.
    pub run_time: &'static str,
    pub text: &'static str,
}

impl BuiltinScene {
    pub fn title(&self) -> String {
        let read = read(self.name, self.text, &[]);
        read.map_or_else(|_| String::new(), |read| read.scene.title)
    }

    /// Returns the name and the text of the built-in mesh file that the scene uses.
    ///
    /// # Errors
    /// Fails if the scene has no mesh, or if the program generates its mesh.
    pub fn mesh_file(&self) -> Result<(&'static str, &'static str), InputError> {
        let scene = read(self.name, self.text, &[])?.scene;
        match scene.mesh.map(|mesh| mesh.source) {
            Some(MeshSource::Muscle) => Ok(("muscle.msh", mesh::MUSCLE)),
            Some(MeshSource::Ventricle { resolution }) => Ok(match resolution {
                Resolution::Fine => ("ventricle.msh", mesh::VENTRICLE),
                Resolution::Coarse => ("ventricle_coarse.msh", mesh::VENTRICLE_COARSE),
            }),
            found => {
                let reason = match found {
                    None => "it has no mesh",
                    Some(_) => "the program generates its mesh from the size and cells in [mesh]",
                };
                let error = InputError::new(format!("`{}` has no mesh file", self.name));
                Err(error.found(reason).next("remove `--mesh`"))
            }
        }
    }
}

macro_rules! scenes {
    ($($name:literal $run_time:literal)*) => {
        pub const SCENES: &[BuiltinScene] = &[$(BuiltinScene {
            name: $name,
            run_time: $run_time,
            text: include_str!(concat!("../../data/scenes/", $name, ".toml")),
        }),*];
    };
}

scenes! {
    "cantilever" "below 1 s"
    "cook-dynamic" "below 1 s"
    "cook-static" "below 1 s"
    "figure2" "2 s"
    "figure3" "2 s"
    "figure4" "below 1 s"
    "figure5" "6 s"
    "figure6" "6 s"
    "figure7" "30 s"
    "hardening" "5 s"
    "init" "below 1 s"
    "land1" "1 s"
    "muscle3d" "1 min"
    "table1-26-finite-damped" "1 s"
    "table1-26-finite-undamped" "1 s"
    "table1-26-inf-damped" "1 s"
    "table1-26-inf-undamped" "1 s"
    "table2-1" "1 s"
    "table2-2" "1 s"
    "table2-2m" "1 s"
    "table2-3" "1 s"
    "table2-31" "1 s"
    "table2-3m" "1 s"
    "table2-4" "1 s"
    "table2-4-order2" "1 s"
    "table2-4-suppressed" "1 s"
    "two-way" "5 s"
    "ventricle" "1 h"
    "ventricle-coarse" "1 min"
}

/// Returns the built-in scene with the given name.
///
/// # Errors
/// Fails if the name is unknown. The error lists the existing names.
pub fn find(name: &str) -> Result<&'static BuiltinScene, InputError> {
    let found = SCENES.iter().find(|scene| scene.name == name);
    found.ok_or_else(|| {
        let names: Vec<&str> = SCENES.iter().map(|scene| scene.name).collect();
        InputError::new(format!("unknown scene `{name}`"))
            .allowed(names.join(", "))
            .next("`myovib scenes` lists them with their titles")
    })
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
        let known: Vec<&str> = SCENES.iter().map(|scene| scene.name).collect();
        assert_eq!(names, known);
        assert!(SCENES.iter().all(|scene| !scene.title().is_empty()));
    }
}
