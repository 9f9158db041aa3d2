//! Mesh of a scene.

use myovib_fem::{Group, Mesh, generate};

use super::builder::Builder;
use crate::InputError;
use crate::scene_file::mesh::{self, MeshSource, Region, Resolution};

/// Mesh of the muscle in the reproduced paper.
pub(super) const MUSCLE: &str = include_str!("../../data/meshes/muscle.msh");
/// Mesh of the ventricle in the benchmark, and a coarser version.
pub(super) const VENTRICLE: &str = include_str!("../../data/meshes/ventricle.msh");
pub(super) const VENTRICLE_COARSE: &str = include_str!("../../data/meshes/ventricle_coarse.msh");
/// Maximum number of elements of a scene. It is far above the capacity of one machine and detects typing errors before
/// memory is exhausted.
const MAX_ELEMENTS: usize = 4_000_000;

impl Builder<'_> {
    /// Returns the refined mesh with each region as a separate group, and with the selected groups.
    pub(super) fn mesh(&self, mesh: &mesh::Mesh) -> Result<Mesh, InputError> {
        if let MeshSource::Spindle { cells }
        | MeshSource::Rectangle { cells, .. }
        | MeshSource::Beam { cells, .. }
        | MeshSource::Cook { cells } = mesh.source
        {
            self.check_size(product(2, &cells))?;
        }
        if let MeshSource::Box { cells, .. } | MeshSource::Muscle3d { cells } = mesh.source {
            self.check_size(product(6, &cells))?;
        }
        let (place, coarse) = match mesh.source {
            MeshSource::File { ref path } => {
                let (content, name) = self.read(path, "mesh.path")?;
                ("mesh.path", Mesh::parse_msh(content, &name))
            }
            MeshSource::Muscle => ("mesh", Mesh::parse_msh(MUSCLE, "muscle.msh")),
            MeshSource::Ventricle { resolution } => {
                let text = match resolution {
                    Resolution::Coarse => VENTRICLE_COARSE,
                    Resolution::Fine => VENTRICLE,
                };
                ("mesh", Mesh::parse_msh(text, "ventricle.msh"))
            }
            MeshSource::Muscle3d { cells } => ("mesh.cells", generate::muscle(cells)),
            MeshSource::Spindle { cells } => ("mesh.cells", generate::spindle(cells)),
            MeshSource::Rectangle { width, height, cells } => {
                ("mesh", generate::rectangle([0.0, 0.0], [width, height], cells))
            }
            MeshSource::Beam { length, height, cells } => {
                ("mesh", generate::beam(length, height, cells))
            }
            MeshSource::Cook { cells } => ("mesh", generate::cook(cells)),
            MeshSource::Box { size, cells } => {
                ("mesh.size", generate::block([0.0; 3], size, cells))
            }
        };
        let coarse = self.at(place, coarse)?.scaled(mesh.scale);
        let parts = if coarse.dimension() == 2 { 4 } else { 8 };
        self.check_size(product(coarse.n_elements(), &vec![parts; mesh.refine as usize]))?;
        let refined = (0..mesh.refine).try_fold(coarse, |mesh, _| mesh.refined());
        let mesh = self.at("mesh.refine", refined)?;
        let mesh = self.file.region.iter().enumerate().try_fold(mesh, |mesh, (i, region)| {
            self.with_region(&mesh, region, &format!("region[{i}]"))
        })?;
        self.file.group.iter().enumerate().try_fold(mesh, |mesh, (i, group)| {
            self.with_group(&mesh, group, &format!("group[{i}]"))
        })
    }

    fn check_size(&self, n_elements: usize) -> Result<(), InputError> {
        if n_elements <= MAX_ELEMENTS {
            return Ok(());
        }
        let error = InputError::new("the mesh is too large")
            .found(format!("{n_elements} elements"))
            .allowed(format!("at most {MAX_ELEMENTS}"));
        Err(self.wrong("mesh", error))
    }

    /// Moves the elements of a region into a separate group.
    fn with_region(&self, mesh: &Mesh, region: &Region, path: &str) -> Result<Mesh, InputError> {
        if region.name.is_empty() {
            let error = InputError::new("a region needs a name, to which materials refer");
            return Err(self.wrong(&format!("{path}.name"), error));
        }
        let dimension = mesh.dimension();
        for (key, list) in [("center", &region.center), ("radii", &region.radii)] {
            if list.len() != dimension {
                let error =
                    InputError::new(format!("a region in this mesh needs {dimension} numbers"))
                        .found(format!("{list:?}"));
                return Err(self.wrong(&format!("{path}.{key}"), error));
            }
        }
        if !region.radii.iter().all(|&radius| radius > 0.0) {
            let error = InputError::new("the semi-axes of a region must be positive lengths")
                .found(format!("{:?}", region.radii))
                .allowed("numbers greater than 0, in m");
            return Err(self.wrong(&format!("{path}.radii"), error));
        }
        if mesh.groups().contains_key(&region.name) {
            let error = InputError::new(format!("the mesh already has a group `{}`", region.name));
            return Err(self.wrong(&format!("{path}.name"), error));
        }
        let is_inside = |element: &usize| {
            let vertices = mesh.element(*element);
            let squared = |axis: usize| {
                let x = vertices.iter().map(|v| mesh.coordinates()[dimension * v + axis]);
                let centroid = x.sum::<f64>() / vertices.len() as f64;
                ((centroid - region.center[axis]) / region.radii[axis]).powi(2)
            };
            (0..dimension).map(squared).sum::<f64>() <= 1.0
        };
        let inside: Vec<usize> = (0..mesh.n_elements()).filter(is_inside).collect();
        if inside.is_empty() {
            let error =
                InputError::new(format!("the region contains no {} center", mesh.shape().name))
                    .next("move or widen it, or refine the mesh");
            return Err(self.wrong(path, error));
        }
        let mut groups = mesh.groups().clone();
        for group in groups.values_mut() {
            if let Group::Elements(members) = group {
                members.retain(|element| inside.binary_search(element).is_err());
            }
        }
        groups.insert(region.name.clone(), Group::Elements(inside));
        self.at(path, mesh.with_groups(groups))
    }
}

/// Returns the product of integers. If it overflows, returns the largest integer.
fn product(factor: usize, factors: &[usize]) -> usize {
    factors.iter().fold(factor, |n, m| n.saturating_mul(*m))
}
