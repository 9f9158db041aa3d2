//! Errors common to all integrators.

use crate::inconsistent::Inconsistent;
use crate::start::InconsistentStart;
use crate::tolerances::NoIndices;

/// Error for an invalid argument or setting, or for inconsistent initial values.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages name the fields")]
pub enum IntegratorError {
    /// A setting has an invalid value.
    #[error("{option} = {value}: must be {expected}")]
    InvalidOption { option: &'static str, value: f64, expected: &'static str },
    /// An array has the wrong length.
    #[error("{what}: expected length {expected}, got {got}")]
    WrongLength { what: &'static str, expected: usize, got: usize },
    /// A component of an array is NaN or infinite.
    #[error("{what}[{index}] = {value} is not finite")]
    NotFinite { what: &'static str, index: usize, value: f64 },
    /// An output time or a stop time is before the current time.
    #[error("time {t_out} is behind the current time t = {t} in the direction of integration")]
    TimeBehind { t_out: f64, t: f64 },
    /// Dense output was requested outside the last step, or for a derivative whose order is too high.
    #[error(
        "no derivative of order {derivative} at t = {t}: orders 0 to {highest} are available on [{from}, {to}]"
    )]
    NoDenseOutput {
        t: f64,
        /// Order of the requested derivative.
        derivative: usize,
        /// Highest available order of a derivative.
        highest: usize,
        /// Start of the last step.
        from: f64,
        /// End of the last step.
        to: f64,
    },
    /// Quadratures were requested, but the solver has no quadratures.
    #[error("this solver has no quadratures")]
    NoQuadrature,
    /// A correction of the initial values or a recording was requested after the first step.
    #[error("possible only before the first step, not at t = {t}")]
    AfterTheStart { t: f64 },
    /// Sensitivities were started while the integrator pauses within a step, for example at a root.
    #[error(
        "t = {t} is within a step: sensitivities can start only at the end of a step or after reinit"
    )]
    WithinStep { t: f64 },
    /// No values that satisfy the equations and the constraints of the problem were found.
    #[error("no consistent initial values at t = {t}: {source}")]
    Inconsistent { t: f64, source: Inconsistent },
    /// The initial values contradict the equations.
    #[error(transparent)]
    Start(#[from] InconsistentStart),
    /// Components are to be excluded by their index, but the problem does not state indices.
    #[error(transparent)]
    NoIndices(#[from] NoIndices),
}
