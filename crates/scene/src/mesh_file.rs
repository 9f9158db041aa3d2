//! Meshes given on the command line, and the built-in spindle where none is given.

use std::path::Path;

use myovib_fem::{FemError, Mesh};

use crate::inputs;

/// The mesh in the file, or the built-in spindle, and what to call it.
///
/// # Errors
/// When the file cannot be read or is no valid mesh.
pub fn load(path: Option<&Path>) -> Result<(Mesh, String), FemError> {
    match path {
        Some(path) => {
            let bytes = inputs::content(path).map_err(|source| FemError::Io {
                path: path.to_owned(),
                source,
            })?;
            let name = path.display().to_string();
            let mesh = Mesh::parse_msh(&String::from_utf8_lossy(&bytes), &name)?;
            Ok((mesh, name))
        }
        None => {
            let text = include_str!("../data/meshes/muscle.msh");
            let mesh = Mesh::parse_msh(text, "muscle.msh")?;
            Ok((mesh, "muscle.msh (built in)".to_owned()))
        }
    }
}

/// The same for what is of the plane alone, as the paper's muscle is.
///
/// # Errors
/// Those of [`load`], and [`FemError::Dimension`] for a mesh of tetrahedra.
pub fn load_plane(path: Option<&Path>) -> Result<(Mesh, String), FemError> {
    let (mesh, name) = load(path)?;
    match mesh.dimension() {
        2 => Ok((mesh, name)),
        found => Err(FemError::Dimension { found, needed: 2 }),
    }
}
