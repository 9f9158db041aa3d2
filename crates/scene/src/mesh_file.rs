//! Meshes from the command line, with the built-in spindle as default.

use std::path::Path;

use myovib_fem::{FemError, Mesh};

use crate::inputs;

/// Reads the mesh from the file, or returns the built-in spindle; also returns a description.
///
/// # Errors
/// Returns an error if the file cannot be read or is not a valid mesh.
pub fn load(path: Option<&Path>) -> Result<(Mesh, String), FemError> {
    match path {
        Some(path) => {
            let bytes = inputs::content(path)
                .map_err(|source| FemError::Io { path: path.to_owned(), source })?;
            let name = path.display().to_string();
            let mesh = Mesh::parse_msh(bytes, &name)?;
            Ok((mesh, name))
        }
        None => {
            let text = include_str!("../data/meshes/muscle.msh");
            let mesh = Mesh::parse_msh(text, "muscle.msh")?;
            Ok((mesh, "muscle.msh (built in)".to_owned()))
        }
    }
}

/// Reads the mesh as [`load`] does, for commands that only support 2D meshes, such as the paper's
/// muscle.
///
/// # Errors
/// Errors of [`load`], and [`FemError::Dimension`] for a mesh of tetrahedra.
pub fn load_plane(path: Option<&Path>) -> Result<(Mesh, String), FemError> {
    let (mesh, name) = load(path)?;
    match mesh.dimension() {
        2 => Ok((mesh, name)),
        found => Err(FemError::Dimension { found, needed: 2 }),
    }
}
