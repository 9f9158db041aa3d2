//! Counters of the work for sensitivities.

/// Counters of the work for sensitivities in addition to the integration. Sensitivities require no factorizations.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct SensitivityWork {
    /// Number of steps followed.
    pub steps: u64,
    /// Number of linearizations: one per stage of each step, independent of the number of parameters.
    pub jacobian_evaluations: u64,
    /// Number of evaluations of the residual for linearizations by difference quotients.
    pub difference_evaluations: u64,
    /// Number of evaluations of ∂F/∂p: one per stage and parameter.
    pub parameter_derivatives: u64,
    /// Number of solves with the real matrix: one per iteration and parameter that has not converged.
    pub real_solves: u64,
    /// Number of solves with a complex matrix: (s − 1)/2 per solve with the real matrix.
    pub complex_solves: u64,
}

/// Counters of the work in the backward passes of an adjoint.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct AdjointWork {
    /// Number of steps traversed backward, excluding steps after the last data point.
    pub steps: u64,
    /// Number of steps replayed from checkpoints.
    pub repeated_steps: u64,
    /// Number of evaluations of the Jacobian: one per stage of each step.
    pub jacobian_evaluations: u64,
    /// Number of matrix evaluations and factorizations. The real and complex matrices of a step count as one.
    pub factorizations: u64,
    /// Number of solves with the transposed real matrix.
    pub real_solves: u64,
    /// Number of solves with a transposed complex matrix.
    pub complex_solves: u64,
}
