//! Work counters. Tests use them to check that a run computes only what its scene needs.

use myovib_dae::StepError;
use myovib_fem::Inverted;
use myovib_sparse::LinearWork;
use serde::{Deserialize, Serialize};

/// Counts of element passes and assemblies.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct WorkCounters {
    /// Element passes for residuals.
    pub residual_passes: u64,
    /// Residual passes that include the damping force ∫Ṗ:∇φ.
    pub force_rate_passes: u64,
    /// Residual passes over elements whose law uses fiber directions.
    pub fiber_passes: u64,
    /// Element passes for tangents.
    pub tangent_passes: u64,
    /// Tangent passes that include the damping tangent ∂/∂q ∫Ṗ:∇φ.
    pub rate_tangent_passes: u64,
    /// Residual passes over regions with active or viscous stress.
    pub added_passes: u64,
    /// Tangent passes over regions with active or viscous stress.
    pub added_tangent_passes: u64,
    /// Residual passes over elastic foundations.
    pub bed_passes: u64,
    /// Residual passes over viscoelastic (Prony) elements.
    pub relaxing_passes: u64,
    /// Tangent passes over viscoelastic elements.
    pub relaxing_tangent_passes: u64,
    /// Passes that eliminate internal stresses from Newton's systems.
    pub relaxing_solve_passes: u64,
    /// Element passes for the effect of two-way coupled oscillators on the body's forces.
    pub coherence_passes: u64,
    /// Factorizations and solves of the condensed linear solver, and their accuracy.
    pub linear: LinearWork,
    /// Newton matrices assembled from the tangents.
    pub matrix_sums: u64,
    /// Element passes rejected because of an inverted element; the integrator then reduces the
    /// step.
    pub inversions: u64,
    /// The element inverted last.
    #[serde(skip)]
    pub inverted: Option<Inverted>,
}

impl WorkCounters {
    /// Records whether an element pass was rejected and returns a recoverable error if so.
    pub(crate) fn passed(&mut self, pass: Result<(), Inverted>) -> Result<(), StepError> {
        pass.map_err(|element| {
            self.inversions += 1;
            self.inverted = Some(element);
            StepError::Recoverable(element.to_string())
        })
    }
}
