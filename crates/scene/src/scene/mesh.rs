//! The mesh of a scene.

use myovib_fem::{Group, Mesh, generate};

use super::builder::Builder;
use crate::InputError;
use crate::scene_file::mesh::{self, MeshSource, Region};

/// The muscle of the reproduction.
const MUSCLE: &str = include_str!("../../../../data/meshes/muscle.msh");
/// The most triangles a scene may ask for, far more than can be integrated on one machine: a typing
/// error shall be told before memory is gone.
const MAX_TRIANGLES: usize = 4_000_000;

impl Builder<'_> {
    /// The mesh, refined and with the regions cut out.
    pub(super) fn mesh(&self, mesh: &mesh::Mesh, regions: &[Region]) -> Result<Mesh, InputError> {
        if let MeshSource::Spindle { cells }
        | MeshSource::Rectangle { cells, .. }
        | MeshSource::Beam { cells, .. }
        | MeshSource::Cook { cells } = mesh.source
        {
            self.check_size(2_usize.saturating_mul(cells[0].saturating_mul(cells[1])))?;
        }
        let (place, coarse) = match mesh.source {
            MeshSource::File { ref path } => {
                let (text, name) = self.read(path, "mesh.path")?;
                ("mesh.path", Mesh::parse_msh(&text, &name))
            }
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
        self.check_size((0..mesh.refine).fold(coarse.n_elements(), |n, _| n.saturating_mul(4)))?;
        let mesh = (0..mesh.refine).fold(coarse, |mesh, _| mesh.refined());
        regions
            .iter()
            .enumerate()
            .try_fold(mesh, |mesh, (i, region)| {
                self.with_region(&mesh, region, &format!("region[{i}]"))
            })
    }

    fn check_size(&self, n_triangles: usize) -> Result<(), InputError> {
        if n_triangles <= MAX_TRIANGLES {
            return Ok(());
        }
        let error = InputError::new("the mesh is too large")
            .found(format!("{n_triangles} triangles"))
            .allowed(format!("at most {MAX_TRIANGLES}"));
        Err(self.wrong("mesh", error))
    }

    /// Moves the triangles of a region into a group of their own.
    fn with_region(&self, mesh: &Mesh, region: &Region, path: &str) -> Result<Mesh, InputError> {
        if region.name.is_empty() {
            let error = InputError::new("a region needs a name, by which materials find it");
            return Err(self.wrong(&format!("{path}.name"), error));
        }
        if !region.radii.iter().all(|&radius| radius > 0.0) {
            let error = InputError::new("a region's half axes are lengths")
                .found(format!("{:?}", region.radii))
                .allowed("two numbers greater than 0, m");
            return Err(self.wrong(&format!("{path}.radii"), error));
        }
        if mesh.groups().contains_key(&region.name) {
            let error = InputError::new(format!("the mesh has a group `{}` already", region.name));
            return Err(self.wrong(&format!("{path}.name"), error));
        }
        let is_inside = |triangle: &usize| {
            let corners: [[f64; 2]; 3] = mesh.corners(*triangle);
            let offset = |axis: usize| {
                let centroid = corners.iter().map(|corner| corner[axis]).sum::<f64>() / 3.0;
                (centroid - region.centre[axis]) / region.radii[axis]
            };
            offset(0).hypot(offset(1)) <= 1.0
        };
        let inside: Vec<usize> = (0..mesh.n_elements()).filter(is_inside).collect();
        if inside.is_empty() {
            let error = InputError::new("no triangle's centre lies in the region")
                .next("move or widen it, or refine the mesh");
            return Err(self.wrong(path, error));
        }
        let mut groups = mesh.groups().clone();
        for group in groups.values_mut() {
            if let Group::Elements(members) = group {
                members.retain(|triangle| inside.binary_search(triangle).is_err());
            }
        }
        groups.insert(region.name.clone(), Group::Elements(inside));
        self.at(path, mesh.with_groups(groups))
    }
}
