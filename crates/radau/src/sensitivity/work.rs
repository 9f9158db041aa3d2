//! Work counters of sensitivities.

/// Counters of the work for sensitivities in addition to the integration, which requires no factorizations.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct SensitivityWork {
    /// Steps followed.
    pub steps: u64,
    /// Linearizations: one per stage of each step, independent of the number of parameters.
    pub jacobian_evaluations: u64,
    /// Evaluations of ∂F/∂p: one per stage and parameter.
    pub parameter_derivatives: u64,
    /// Solves with the real matrix: one per iteration and parameter that has not converged.
    pub real_solves: u64,
    /// Solves with a complex matrix: (s − 1)/2 per solve with the real matrix.
    pub complex_solves: u64,
}

/// Counters of the work in the backward passes of an adjoint.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct AdjointWork {
    /// Steps traversed backward, excluding steps after the last data.
    pub steps: u64,
    /// Steps replayed from checkpoints.
    pub repeated_steps: u64,
    /// Evaluations of the Jacobian: one per stage of each step.
    pub jacobian_evaluations: u64,
    /// Number of matrix evaluations and factorizations; the real and the complex matrices of a step
    /// count once.
    pub factorizations: u64,
    /// Solves with the transposed real matrix.
    pub real_solves: u64,
    /// Solves with a transposed complex matrix.
    pub complex_solves: u64,
}
