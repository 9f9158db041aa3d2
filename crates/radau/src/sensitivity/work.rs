//! What it costs.

/// What the sensitivities cost beside the integration. There are no factorisations.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct SensitivityWork {
    /// Steps followed.
    pub steps: u64,
    /// Linearisations: one a stage of each step, whatever the number of parameters.
    pub jacobian_evaluations: u64,
    /// Evaluations of ∂F/∂p: one a stage and parameter.
    pub parameter_derivatives: u64,
    /// Solves with the real matrix: one an iteration and parameter that
    /// is not solved for yet.
    pub real_solves: u64,
    /// Solves with a complex matrix: (s − 1)/2 where there is one with the real matrix.
    pub complex_solves: u64,
}

/// What an adjoint cost on its ways back.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct AdjointWork {
    /// Steps gone back over, those behind the last data left out.
    pub steps: u64,
    /// Steps taken again from checkpoints.
    pub repeated_steps: u64,
    /// Evaluations of the Jacobian: one a stage of each step.
    pub jacobian_evaluations: u64,
    /// How often the matrices were evaluated and factorised, the real one and the complex ones together.
    pub factorizations: u64,
    /// Solves with the transposed real matrix.
    pub real_solves: u64,
    /// Solves with a transposed complex matrix.
    pub complex_solves: u64,
}
