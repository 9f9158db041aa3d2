//! Work counters. Tests use them to check that a run computes only what its scene needs.

use std::ops::AddAssign;
use std::time::Duration;

use myovib_dae::StepError;
use myovib_fem::Inverted;
use myovib_sparse::LinearWork;
use serde::{Deserialize, Serialize};

/// Counts of element passes and assemblies.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct WorkCounters {
    /// Element passes that compute residuals.
    pub residual_passes: u64,
    /// Residual passes that include the damping force ∫Ṗ:∇φ.
    pub force_rate_passes: u64,
    /// Residual passes over elements whose law uses fiber directions.
    pub fiber_passes: u64,
    /// Element passes that compute tangents.
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
    /// Passes that eliminate internal stresses from the Newton systems.
    pub relaxing_solve_passes: u64,
    /// Element passes that compute the effect of two-way coupled oscillators on the body's forces.
    pub coherence_passes: u64,
    /// Factorizations and solves of the condensed linear solver, and their accuracy.
    pub linear: LinearWork,
    /// Newton matrices assembled from the tangents.
    pub matrix_sums: u64,
    /// Element passes rejected because of an inverted element; the integrator then reduces the
    /// step.
    pub inversions: u64,
    /// The most recently inverted element.
    #[serde(skip)]
    pub inverted: Option<Inverted>,
    /// Wall-clock times of the evaluations since the start of the process.
    #[serde(skip)]
    pub times: EvaluationTimes,
}

/// Wall-clock times of the evaluations that an integrator requests from a body.
#[derive(Debug, Clone, Copy, Default)]
pub struct EvaluationTimes {
    /// Residuals.
    pub residuals: Duration,
    /// Element passes that compute tangents.
    pub tangents: Duration,
    /// Sums of Newton matrices and their factorizations.
    pub factorizations: Duration,
    /// Solutions of linear systems, including their refinement.
    pub solves: Duration,
}

/// Times differ between identical runs. Comparisons of counters ignore them.
impl PartialEq for EvaluationTimes {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl EvaluationTimes {
    /// Returns the times of the evaluations since the `earlier` reading.
    pub fn since(&self, earlier: &Self) -> Self {
        Self {
            residuals: self.residuals.saturating_sub(earlier.residuals),
            tangents: self.tangents.saturating_sub(earlier.tangents),
            factorizations: self.factorizations.saturating_sub(earlier.factorizations),
            solves: self.solves.saturating_sub(earlier.solves),
        }
    }

    /// Returns the sum of the times.
    pub fn total(&self) -> Duration {
        self.residuals + self.tangents + self.factorizations + self.solves
    }
}

impl AddAssign for EvaluationTimes {
    fn add_assign(&mut self, other: Self) {
        self.residuals += other.residuals;
        self.tangents += other.tangents;
        self.factorizations += other.factorizations;
        self.solves += other.solves;
    }
}

impl WorkCounters {
    /// Counts a rejected element pass and converts it to a recoverable error.
    pub(crate) fn passed(&mut self, pass: Result<(), Inverted>) -> Result<(), StepError> {
        pass.map_err(|element| {
            self.inversions += 1;
            self.inverted = Some(element);
            StepError::Recoverable(element.to_string())
        })
    }
}
