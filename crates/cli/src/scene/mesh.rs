//! The mesh of a scene.

use myovib_fem::{Mesh, generate};

use super::builder::Builder;
use crate::error::InputError;
use crate::scene_file::mesh::{self, MeshSource};

/// The muscle of the reproduction.
const MUSCLE: &str = include_str!("../../../../data/meshes/muscle.msh");

impl Builder<'_> {
    /// The mesh, refined.
    pub(super) fn mesh(&self, mesh: &mesh::Mesh) -> Result<Mesh, InputError> {
        let (place, coarse) = match mesh.source {
            MeshSource::File { ref path } => ("mesh.path", Mesh::read_msh(self.resolve(path))),
            MeshSource::Muscle => ("mesh", Mesh::parse_msh(MUSCLE, "muscle.msh")),
            MeshSource::Spindle { cells } => ("mesh.cells", generate::spindle(cells)),
            MeshSource::Rectangle {
                width,
                height,
                cells,
            } => (
                "mesh",
                generate::rectangle([0.0, 0.0], [width, height], cells),
            ),
            MeshSource::Beam {
                length,
                height,
                cells,
            } => ("mesh", generate::beam(length, height, cells)),
            MeshSource::Cook { cells } => ("mesh", generate::cook(cells)),
        };
        let coarse = self.at(place, coarse)?;
        Ok((0..mesh.refine).fold(coarse, |mesh, _| mesh.refined()))
    }
}
