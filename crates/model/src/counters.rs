//! Counts of the work done, the proof that what a scene does not need is not computed.

use myovib_dae::StepError;
use myovib_fem::Inverted;
use myovib_sparse::LinearWork;

/// Passes over the elements, and assemblies.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct WorkCounters {
    /// Element passes for residuals.
    pub residual_passes: u64,
    /// Of these, with the damping force ∫Ṗ:∇φ.
    pub force_rate_passes: u64,
    /// Of these, over elements whose law looks at fibres.
    pub fibre_passes: u64,
    /// Element passes for tangents.
    pub tangent_passes: u64,
    /// Of these, with the damping tangent ∂/∂q ∫Ṗ:∇φ.
    pub rate_tangent_passes: u64,
    /// Passes over regions with active or viscous stress, for residuals.
    pub added_passes: u64,
    /// The same for tangents.
    pub added_tangent_passes: u64,
    /// Passes over the beds of the boundary, for residuals.
    pub bed_passes: u64,
    /// Passes over elements whose stress relaxes, for residuals.
    pub relaxing_passes: u64,
    /// The same for tangents.
    pub relaxing_tangent_passes: u64,
    /// The same for the elimination of internal stresses from Newton's systems.
    pub relaxing_solve_passes: u64,
    /// Passes over the elements for what oscillators that act back on the body do to its forces.
    pub coherence_passes: u64,
    /// Factorisations and solves of the condensed path, and how well they were solved.
    pub linear: LinearWork,
    /// Newton matrices summed from the tangents.
    pub matrix_sums: u64,
    /// Element passes refused for an element turned inside out; a smaller step is to avoid it.
    pub inversions: u64,
    /// The element of the last of them.
    pub inverted: Option<Inverted>,
}

impl WorkCounters {
    /// Notes whether an element pass was refused, which is recoverable.
    pub(crate) fn passed(&mut self, pass: Result<(), Inverted>) -> Result<(), StepError> {
        pass.map_err(|element| {
            self.inversions += 1;
            self.inverted = Some(element);
            StepError::Recoverable(element.to_string())
        })
    }
}
