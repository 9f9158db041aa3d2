//! Beam under the loads.

use myovib_fem::generate;
use myovib_model::{AbsoluteTolerances, Formulation, MuscleDae, Signal, paper};

/// Returns a damped beam under a traction that follows `signal`.
pub(crate) fn beam(formulation: Formulation, kappa: f64, signal: Signal) -> MuscleDae {
    let mesh = generate::beam(0.1, 0.02, [4, 1]).unwrap();
    let beta = match formulation {
        Formulation::Rate | Formulation::ImplicitRate => 1e-3,
        _ => 0.0,
    };
    let mut muscle = paper::muscle_with_load(&mesh, paper::LAW, kappa, beta, signal).unwrap();
    muscle.parameters.alpha = 10.0;
    MuscleDae::new(muscle, formulation).unwrap()
}

/// Returns absolute tolerances in proportion to the magnitudes of the unknowns.
pub(crate) fn tolerances(rtol: f64) -> AbsoluteTolerances {
    AbsoluteTolerances {
        displacement: 1e-3 * rtol,
        velocity: 1e-2 * rtol,
        pressure: 1e2 * rtol,
        multiplier: 1e3 * rtol,
    }
}
