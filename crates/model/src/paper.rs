//! The muscle, the rod and the chains of section 3 of the paper with their parameters.

use std::sync::Arc;

use myovib_fem::rod::{EndLoad, Rod, RodData};
use myovib_fem::{DofMap, Law, Mesh, Solid, Space, load};
use myovib_oscillators::{Chain, Coefficients, Detuning, Ends, Reach};

use crate::error::ModelError;
use crate::muscle::Muscle;
use crate::muscle::load::Load;
use crate::muscle::parameters::Parameters;
use crate::rod_dae::RodDae;
use crate::signal::Signal;
use crate::signal::formula::RampedSine;

/// Mass density ρ, kg/m³.
pub const DENSITY: f64 = 1.1e3;
/// Mass-proportional damping α, 1/s.
pub const ALPHA: f64 = 1.0;
const C10: f64 = 1.0e4;
const C01: f64 = 2.0e2;
/// Material law of (20).
pub const LAW: Law = Law::MooneyRivlin { c10: C10, c01: C01 };
/// [`LAW`] linearized for small strains: ζ = 2 (c10 + c01). Paper: eq. (26).
pub const SMALL_STRAIN: Law = Law::SmallStrain { shear_modulus: 2.0 * (C10 + C01) };
/// Bulk modulus κ of the parameter pair that the paper prefers, Pa.
pub const KAPPA: f64 = 1e5;
/// Stiffness-proportional damping β of the parameter pair that the paper prefers, s.
pub const BETA: f64 = 1e-4;
/// Amplitude of the surface load τ_y, Pa.
pub const LOAD_AMPLITUDE: f64 = 100.0;
/// Frequency of the load for both the muscle and the rod, Hz.
pub const LOAD_FREQUENCY: f64 = 8.0;
/// Steepness of the sigmoid that ramps the load up, 1/s.
pub(crate) const LOAD_STEEPNESS: f64 = 10.0;
/// Shift of the sigmoid.
pub(crate) const LOAD_SHIFT: f64 = 8.0;
/// Physical group of the fixed nodes.
pub const FIXED_GROUP: &str = "fixed";
/// Physical group of the edges under the surface load.
pub const LOAD_GROUP: &str = "load";

impl Signal {
    /// Returns the 8 Hz load of the paper: `τ_y` of section 3.2 if `amplitude` is 100 Pa, or `τ` of the rod if
    /// `amplitude` is 1.
    pub fn paper(amplitude: f64) -> Self {
        RampedSine {
            amplitude,
            frequency: LOAD_FREQUENCY,
            steepness: LOAD_STEEPNESS,
            shift: LOAD_SHIFT,
        }
        .into()
    }
}

/// Builds the muscle on `mesh` under a surface load `(0, τ_y)`, where τ_y follows `signal` (Pa).
///
/// # Errors
/// Returns [`ModelError::Fem`] if the mesh lacks a group, and [`ModelError::OutOfRange`] if κ or β is out of range.
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
        ..Muscle::unloaded(solid, Parameters::new(ALPHA, beta, kappa)?)
    })
}

/// Builds the muscle of section 3.2, with the Mooney–Rivlin law and the 8 Hz load.
///
/// # Errors
/// Returns the same errors as [`muscle_with_load`].
pub fn muscle(mesh: &Mesh, kappa: f64, beta: f64) -> Result<Muscle, ModelError> {
    muscle_with_load(mesh, LAW, kappa, beta, Signal::paper(LOAD_AMPLITUDE))
}

/// Quantity that the rod's end load prescribes.
const ROD_END_LOAD: EndLoad = EndLoad::Strain;
/// Amplitude of the rod's end load, which is a strain.
const ROD_LOAD_AMPLITUDE: f64 = 1.0;

/// Builds the rod of section 3.1, with ten elements and the end load.
pub fn rod() -> Result<RodDae, ModelError> {
    let load = Signal::paper(ROD_LOAD_AMPLITUDE);
    RodDae::new(Rod::new(RodData::default())?, ROD_END_LOAD, load)
}

/// Position of the point on the rod that drives the chain: L/2, in m.
pub const ROD_POINT: f64 = 0.05;

/// Returns a chain of `n` oscillators with frequencies 16π ± `half_width` rad/s. The paper uses n = 20 and 0.05 rad/s
/// for the rod (section 3.1), n = 5 and 0.5 rad/s for the muscle (section 3.2).
///
/// # Errors
/// Returns [`ModelError::Oscillators`] if `n` is 0 or `half_width` is negative.
pub fn chain(n: usize, half_width: f64) -> Result<Chain, ModelError> {
    let detuning = Detuning { half_width, ..Detuning::default() };
    Ok(Chain {
        omega: detuning.frequencies(n)?,
        coefficients: Coefficients::default(),
        ends: Ends::Periodic,
        reach: Reach::All,
    })
}
