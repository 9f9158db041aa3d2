//! What can be wrong with a fit before it begins, or with its result.

/// An error of a fit. A fit that ends without convergence is no error: see
/// [`Ended`](crate::Ended).
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FitError {
    /// A parameter makes no sense.
    #[error("parameter {name}: {what} ({value})")]
    Parameter {
        /// Its name.
        name: String,
        /// What is wrong.
        what: &'static str,
        /// The value found.
        value: f64,
    },
    /// There are fewer measurements than parameters, or none of either.
    #[error("{n_residuals} measurements cannot fix {n_parameters} parameters")]
    TooFewMeasurements {
        /// Number of measurements.
        n_residuals: usize,
        /// Number of parameters.
        n_parameters: usize,
    },
    /// The model cannot be evaluated at the start.
    #[error("the model cannot be evaluated at the start: {0}")]
    Start(String),
    /// An option makes no sense.
    #[error("{option} = {value}: must be {expected}")]
    Option {
        /// Its name.
        option: &'static str,
        /// The value found.
        value: f64,
        /// What it must be.
        expected: &'static str,
    },
    /// There are as many parameters as measurements: nothing is left to estimate the noise from.
    #[error("{0} measurements and as many parameters: no measurement is left to tell the noise")]
    NoFreedom(usize),
}
