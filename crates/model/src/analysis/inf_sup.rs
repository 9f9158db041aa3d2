//! Inf–sup constant of a pair of spaces on a sequence of refined meshes. Paper: eq. (27).

use std::fmt;
use std::sync::Arc;

use myovib_dae::Problem;
use myovib_fem::{DofMap, Law, Mesh, Solid, Space};
use myovib_structure::InfSup;
use nalgebra_sparse::CscMatrix;

use crate::analysis::index::{IndexReport, LARGEST_SYSTEM};
use crate::error::ModelError;
use crate::formulation::Formulation;
use crate::muscle::Muscle;
use crate::muscle::parameters::Parameters;
use crate::muscle_dae::MuscleDae;
use crate::operators;

/// A displacement space paired with P1 pressures on the same mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pair {
    /// P2–P1.
    TaylorHood,
    /// P1–P1, which violates the inf–sup condition.
    EqualOrder,
}

impl Pair {
    /// Both pairs, the stable one first.
    pub const ALL: [Self; 2] = [Self::TaylorHood, Self::EqualOrder];

    /// Returns the spaces on a mesh.
    pub fn space(self, mesh: &Mesh) -> Space {
        match self {
            Self::TaylorHood => Space::taylor_hood(mesh),
            Self::EqualOrder => Space::equal_order(mesh),
        }
    }
}

impl fmt::Display for Pair {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::TaylorHood => "P2–P1",
            Self::EqualOrder => "P1–P1",
        })
    }
}

/// Stability of the pressures on one mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct Level {
    /// Number of triangles or tetrahedra.
    pub elements: usize,
    /// Edge length of a regular element of the mean size, m.
    pub mesh_size: f64,
    /// Number of pressure unknowns.
    pub pressures: usize,
    /// Number of free displacement components.
    pub displacements: usize,
    /// Number of independent pressure modes that no displacement controls.
    pub nullity: usize,
    /// Smallest nonzero inf–sup constant, with pressures in the L2 norm and displacements in the H1 seminorm.
    pub constant: f64,
    /// Smallest nonzero singular value of B, m (in 3D: m²).
    pub sigma_min: f64,
    /// Index of formulation (28) with κ = ∞ at rest, if the mesh is coarse enough to compute it.
    pub index: Option<IndexReport>,
}

impl Level {
    /// Measures `pair` on `mesh` at rest, with all nodes of the groups in `fixed` held in place.
    ///
    /// # Errors
    /// Returns [`ModelError::Fem`] if a group is unknown, and [`ModelError::Structure`] if B cannot be analyzed, for
    /// example because no node is free.
    pub fn measure(pair: Pair, mesh: &Mesh, fixed: &[&str]) -> Result<Self, ModelError> {
        let solid = body(pair, mesh, fixed)?;
        let in_norms = constants(&solid)?;
        let b = divergence(&solid)?;
        let raw = InfSup::of(&b, &CscMatrix::identity(b.ncols()), &CscMatrix::identity(b.nrows()))?;
        Ok(Self {
            elements: mesh.n_elements(),
            mesh_size: regular_edge(mesh.dimension(), solid.volume() / mesh.n_elements() as f64),
            pressures: b.nrows(),
            displacements: b.ncols(),
            nullity: in_norms.nullity(),
            constant: in_norms.smallest().unwrap_or(0.0),
            sigma_min: raw.smallest().unwrap_or(0.0),
            index: index_at_rest(solid)?,
        })
    }
}

/// Returns the edge length of a regular triangle with the area `measure`, or of a regular tetrahedron with this
/// volume.
fn regular_edge(dimension: usize, measure: f64) -> f64 {
    match dimension {
        2 => (4.0 / 3f64.sqrt() * measure).sqrt(),
        _ => (6.0 * 2f64.sqrt() * measure).cbrt(),
    }
}

/// Measures `pair` on `mesh` and on `n_levels - 1` uniform refinements of it. Before each level, calls `on_level` with
/// the one-based number and the mesh of the level.
pub fn levels(
    pair: Pair,
    mesh: &Mesh,
    fixed: &[&str],
    n_levels: usize,
    on_level: impl Fn(usize, &Mesh),
) -> Result<Vec<Level>, ModelError> {
    let mut mesh = mesh.clone();
    let mut levels = Vec::new();
    for number in 1..=n_levels {
        if number > 1 {
            mesh = mesh.refined()?;
        }
        on_level(number, &mesh);
        levels.push(Level::measure(pair, &mesh, fixed)?);
    }
    Ok(levels)
}

/// Computes the smallest inf–sup constants of a body at rest, with pressures in the L2 norm and displacements in the
/// H1 seminorm. Paper: eq. (27).
///
/// # Errors
/// Returns [`ModelError::Structure`] if B cannot be analyzed, for example because no node is free.
pub fn constants(solid: &Solid) -> Result<InfSup, ModelError> {
    let (h1, l2) = (operators::gradients(solid), operators::pressure_mass(solid));
    Ok(InfSup::of(&divergence(solid)?, &h1, &l2)?)
}

/// Builds a body with unit shear modulus and density. B does not depend on these values.
fn body(pair: Pair, mesh: &Mesh, fixed: &[&str]) -> Result<Solid, ModelError> {
    let space = pair.space(mesh);
    let mut nodes = Vec::new();
    for group in fixed {
        nodes.extend(space.nodes_of(group)?);
    }
    let dofs = DofMap::clamped(&space, &nodes)?;
    let law = Law::SmallStrain { shear_modulus: 1.0 };
    Ok(Solid::uniform(Arc::new(space), dofs, law, 1.0)?)
}

/// Returns B at rest.
fn divergence(solid: &Solid) -> Result<CscMatrix<f64>, ModelError> {
    Ok(operators::divergence(solid, &operators::rest(solid))?)
}

fn index_at_rest(solid: Solid) -> Result<Option<IndexReport>, ModelError> {
    let muscle = Muscle::unloaded(solid, Parameters::new(0.0, 0.0, f64::INFINITY)?);
    let mut dae = MuscleDae::for_analysis(muscle, Formulation::Position);
    let rest = vec![0.0; dae.n_unknowns()];
    (rest.len() <= LARGEST_SYSTEM).then(|| IndexReport::at(&mut dae, 0.0, &rest, &rest)).transpose()
}
