//! The muscle of section 3.2 of the paper, with the parameters of MODEL §2.

use std::sync::Arc;

use myovib_fem::{DofMap, Law, Mesh, Solid, Space, load};

use crate::error::ModelError;
use crate::load::Load;
use crate::muscle::Muscle;
use crate::parameters::Parameters;
use crate::signal::Signal;

/// Mass density ρ, kg/m³.
pub const DENSITY: f64 = 1.1e3;
/// Mass-proportional damping α, 1/s.
pub const ALPHA: f64 = 1.0;
/// Material law of (20).
pub const LAW: Law = Law::MooneyRivlin {
    c10: 1.0e4,
    c01: 2.0e2,
};
/// Amplitude of the surface load τ_y, Pa.
pub const LOAD_AMPLITUDE: f64 = 100.0;
/// Physical group of the nodes that are kept fixed.
pub const FIXED_GROUP: &str = "fixed";
/// Physical group of the edges that carry the surface load.
pub const LOAD_GROUP: &str = "load";

/// The muscle on `mesh` with a surface load `(0, τ_y)` that follows `signal` (Pa).
///
/// # Errors
/// [`ModelError::Fem`] if the mesh lacks a group, [`ModelError::OutOfRange`] for κ or β.
pub fn muscle_with_load(
    mesh: &Mesh,
    law: Law,
    kappa: f64,
    beta: f64,
    signal: Signal,
) -> Result<Muscle, ModelError> {
    let space = Arc::new(Space::taylor_hood(mesh));
    let dofs = DofMap::clamped(&space, &space.nodes_of(FIXED_GROUP)?)?;
    let unit_load = load::traction(&space, LOAD_GROUP, [0.0, 1.0])?;
    let solid = Solid::uniform(space, dofs, law, DENSITY)?;
    Ok(Muscle {
        loads: vec![Load::new(&unit_load, signal)],
        prescribed: Vec::new(),
        parameters: Parameters::new(ALPHA, beta, kappa)?,
        solid,
    })
}

/// The muscle of section 3.2: Mooney–Rivlin law, the 8 Hz load.
///
/// # Errors
/// As [`muscle_with_load`].
pub fn muscle(mesh: &Mesh, kappa: f64, beta: f64) -> Result<Muscle, ModelError> {
    muscle_with_load(mesh, LAW, kappa, beta, Signal::paper(LOAD_AMPLITUDE))
}
