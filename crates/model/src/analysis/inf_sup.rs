//! The inf–sup constant of a pair of spaces over a family of refined meshes. Paper: eq. (27).

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

/// A displacement space with the pressures on the same mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pair {
    /// P2–P1.
    TaylorHood,
    /// P1–P1, which violates the condition.
    EqualOrder,
}

impl Pair {
    /// Both, the stable one first.
    pub const ALL: [Self; 2] = [Self::TaylorHood, Self::EqualOrder];

    /// The spaces on a mesh.
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

/// How well the pressures are held on one mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct Level {
    /// Triangles or tetrahedra of the mesh.
    pub elements: usize,
    /// Mean edge of an element, m.
    pub mesh_size: f64,
    /// Number of pressures.
    pub pressures: usize,
    /// Number of free displacement components.
    pub displacements: usize,
    /// Number of independent pressures that no displacement holds.
    pub nullity: usize,
    /// The smallest non-zero inf–sup constant: pressures in the L2 norm, displacements in the H1
    /// seminorm.
    pub constant: f64,
    /// The smallest non-zero singular value of B itself, m.
    pub sigma_min: f64,
    /// The index of (28) with κ = ∞ at rest, where the mesh is coarse enough to compute it.
    pub index: Option<IndexReport>,
}

impl Level {
    /// Measures `pair` on `mesh`, at rest, with the nodes of the groups `fixed` held.
    ///
    /// # Errors
    /// [`ModelError::Fem`] for an unknown group, [`ModelError::Structure`] when B cannot be looked
    /// at, as for a mesh on which nothing is free.
    pub fn measure(pair: Pair, mesh: &Mesh, fixed: &[&str]) -> Result<Self, ModelError> {
        let solid = body(pair, mesh, fixed)?;
        let in_norms = constants(&solid)?;
        let b = divergence(&solid)?;
        let raw = InfSup::of(
            &b,
            &CscMatrix::identity(b.ncols()),
            &CscMatrix::identity(b.nrows()),
        )?;
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

/// The edge of a regular triangle or tetrahedron of a measure.
fn regular_edge(dimension: usize, measure: f64) -> f64 {
    match dimension {
        2 => (4.0 / 3f64.sqrt() * measure).sqrt(),
        _ => (6.0 * 2f64.sqrt() * measure).cbrt(),
    }
}

/// `pair` on `mesh` and on `n_levels - 1` uniform refinements of it; before each `tell` has its number,
/// from 1, and its mesh.
///
/// # Errors
/// Those of [`Level::measure`].
pub fn levels(
    pair: Pair,
    mesh: &Mesh,
    fixed: &[&str],
    n_levels: usize,
    tell: impl Fn(usize, &Mesh),
) -> Result<Vec<Level>, ModelError> {
    let mut mesh = mesh.clone();
    let mut levels = Vec::new();
    for number in 1..=n_levels {
        if number > 1 {
            mesh = mesh.refined()?;
        }
        tell(number, &mesh);
        levels.push(Level::measure(pair, &mesh, fixed)?);
    }
    Ok(levels)
}

/// The smallest inf–sup constants of a body at rest: pressures in the L2 norm, displacements in the
/// H1 seminorm. Paper: eq. (27).
///
/// # Errors
/// [`ModelError::Structure`] when B cannot be looked at, as for a body on which nothing is free.
pub fn constants(solid: &Solid) -> Result<InfSup, ModelError> {
    let (h1, l2) = (operators::gradients(solid), operators::pressure_mass(solid));
    Ok(InfSup::of(&divergence(solid)?, &h1, &l2)?)
}

/// A body of unit shear modulus and density: neither has a part in B.
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

/// B at rest.
fn divergence(solid: &Solid) -> Result<CscMatrix<f64>, ModelError> {
    Ok(operators::divergence(solid, &operators::rest(solid))?)
}

fn index_at_rest(solid: Solid) -> Result<Option<IndexReport>, ModelError> {
    let muscle = Muscle::unloaded(solid, Parameters::new(0.0, 0.0, f64::INFINITY)?);
    let mut dae = MuscleDae::for_analysis(muscle, Formulation::Position);
    let rest = vec![0.0; dae.n_unknowns()];
    (rest.len() <= LARGEST_SYSTEM)
        .then(|| IndexReport::at(&mut dae, 0.0, &rest, &rest))
        .transpose()
}
