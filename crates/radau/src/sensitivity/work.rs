//! What it costs.

/// What the sensitivities cost beside the integration. There are no factorisations.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct SensitivityWork {
    /// Steps followed.
    pub steps: u64,
    /// Evaluations of the Jacobian: one a stage of each step, whatever the number of parameters.
    pub jacobian_evaluations: u64,
    /// Evaluations of ∂F/∂p: one a stage and parameter.
    pub parameter_derivatives: u64,
    /// Solves with the real matrix: one an iteration and parameter.
    pub real_solves: u64,
    /// Solves with a complex matrix: (s − 1)/2 an iteration and parameter.
    pub complex_solves: u64,
}
