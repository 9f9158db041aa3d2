//! Errors of fits.

/// Reason why a fit cannot start: an invalid argument, or a model that fails at the start. A fit that does not converge
/// is not an error: see [`Ended`](crate::Ended).
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages name the fields")]
pub enum FitError {
    /// A parameter is invalid.
    #[error("parameter {name}: {what} ({value})")]
    Parameter { name: String, what: &'static str, value: f64 },
    /// There are fewer measurements than parameters, or the list of parameters is empty.
    #[error("{n_residuals} measurements cannot determine {n_parameters} parameters")]
    TooFewMeasurements { n_residuals: usize, n_parameters: usize },
    /// The model cannot be evaluated at the start.
    #[error("the model cannot be evaluated at the starting values: {0}")]
    Start(String),
    /// An option is invalid.
    #[error("{option} = {value}: must be {expected}")]
    Option { option: &'static str, value: f64, expected: &'static str },
    /// There are as many parameters as measurements, so the noise cannot be estimated.
    #[error("{0} measurements cannot determine {0} parameters and the noise")]
    NoFreedom(usize),
}
