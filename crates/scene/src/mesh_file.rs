//! Meshes given on the command line. The default is the built-in spindle.

use std::path::Path;

use myovib_fem::{FemError, Mesh};

use crate::inputs;

/// Reads the mesh from the file at `path`, or returns the built-in spindle if `path` is `None`. Also returns the name
/// of the mesh.
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

/// Reads the mesh like [`load`]. This function is for commands that support only 2D meshes, such as the muscle of the
/// paper.
///
/// # Errors
/// Returns the errors of [`load`], or [`FemError::Dimension`] if the mesh consists of tetrahedra.
pub fn load_plane(path: Option<&Path>) -> Result<(Mesh, String), FemError> {
    let (mesh, name) = load(path)?;
    match mesh.dimension() {
        2 => Ok((mesh, name)),
        found => Err(FemError::Dimension { found, needed: 2 }),
    }
}
