//! Errors of fits.

/// An invalid argument, or a model that fails at the start. Missing convergence is not an error: see
/// [`Ended`](crate::Ended).
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages name the fields")]
pub enum FitError {
    /// An invalid parameter.
    #[error("parameter {name}: {what} ({value})")]
    Parameter { name: String, what: &'static str, value: f64 },
    /// Fewer measurements than parameters, or no parameters.
    #[error("{n_residuals} measurements cannot determine {n_parameters} parameters")]
    TooFewMeasurements { n_residuals: usize, n_parameters: usize },
    /// The model cannot be evaluated at the start.
    #[error("the model cannot be evaluated at the starting values: {0}")]
    Start(String),
    /// An invalid option.
    #[error("{option} = {value}: must be {expected}")]
    Option { option: &'static str, value: f64, expected: &'static str },
    /// There are as many parameters as measurements, so the noise cannot be estimated.
    #[error("{0} measurements cannot determine {0} parameters and the noise")]
    NoFreedom(usize),
}
