//! Errors of this crate: misuse, and fatal errors of the problem.
//!
//! An integration that cannot continue is not an error but an
//! [`Outcome::Stopped`](myovib_dae::Outcome::Stopped).

/// Reason why an integration is impossible.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RadauError {
    /// The method does not exist.
    #[error("Radau IIA with {stages} stages is not supported: use 1, 3, 5 or 7")]
    Stages {
        /// Requested number of stages.
        stages: usize,
    },
    /// A setting has an invalid value.
    #[error("{option} = {value}: must be {expected}")]
    InvalidOption {
        /// Name of the setting.
        option: &'static str,
        /// Its value.
        value: f64,
        /// Allowed values.
        expected: &'static str,
    },
    /// An array has the wrong length.
    #[error("{what}: expected length {expected}, got {got}")]
    WrongLength {
        /// Name of the array.
        what: &'static str,
        /// Expected length.
        expected: usize,
        /// Actual length.
        got: usize,
    },
    /// A component of an array is NaN or infinite.
    #[error("{what}[{index}] = {value} is not finite")]
    NotFinite {
        /// Name of the array.
        what: &'static str,
        /// Index of the component.
        index: usize,
        /// Its value.
        value: f64,
    },
    /// The problem has no unknowns.
    #[error("nothing to integrate: no unknowns")]
    Empty,
    /// An output time or a stop time is before the current time.
    #[error("the time {t_out} is before the current time t = {t}")]
    TimeBehind {
        /// Requested time.
        t_out: f64,
        /// Current time.
        t: f64,
    },
    /// Dense output was requested outside the last step, or for a derivative of too high an order.
    #[error(
        "no derivative of order {derivative} at t = {t}: orders 0 and 1 are available on [{from}, {to}]"
    )]
    NoDenseOutput {
        /// Requested time.
        t: f64,
        /// Order of the requested derivative.
        derivative: usize,
        /// Start of the last step.
        from: f64,
        /// End of the last step.
        to: f64,
    },
    /// Quadratures were requested, but the solver has no quadratures.
    #[error("this solver has no quadratures")]
    NoQuadrature,
    /// The adjoint equations cannot be solved backward over a step.
    #[error("the adjoint equations cannot be solved over the step at t = {t}: {message}")]
    Adjoint {
        /// Start of the step.
        t: f64,
        /// Reason.
        message: String,
    },
    /// A step repeated from a checkpoint differs from the recorded run.
    #[error(
        "the step at t = {t} cannot be repeated exactly: only step the solver between recorded \
         steps, or store the stages"
    )]
    NotRepeated {
        /// Start of the step.
        t: f64,
    },
    /// A correction of the initial values was requested after the first step.
    #[error("initial values can be corrected only before the first step, not at t = {t}")]
    AfterTheStart {
        /// Current time.
        t: f64,
    },
    /// No consistent initial values were found.
    #[error("no consistent initial values at t = {t}: {source}")]
    Inconsistent {
        /// Initial time.
        t: f64,
        /// Reason.
        source: myovib_dae::Inconsistent,
    },
    /// The initial values contradict the equations.
    #[error(transparent)]
    Start(#[from] myovib_dae::InconsistentStart),
    /// Components are excluded by their index, but the problem does not state its indices.
    #[error(transparent)]
    NoIndices(#[from] myovib_dae::NoIndices),
    /// The problem or its linear algebra failed with a fatal error.
    #[error("the {function} failed at t = {t} with step {h}: {source}")]
    Fatal {
        /// Function that failed.
        function: &'static str,
        /// Start of the step.
        t: f64,
        /// Size of the attempted step.
        h: f64,
        /// Original error.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
    /// Sensitivities or an adjoint were requested for a problem with internal variables.
    #[error(
        "sensitivities do not support internal variables, because these have no sensitivities: make \
         them unknowns"
    )]
    InternalVariables,
    /// The equations of a sensitivity cannot be solved.
    #[error(
        "the sensitivity to `{parameter}` cannot be computed over the step from t = {t}: {message}"
    )]
    Sensitivity {
        /// Name of the parameter.
        parameter: String,
        /// Start of the step.
        t: f64,
        /// Reason.
        message: String,
    },
    /// Steps were taken without updating the sensitivities.
    #[error(
        "sensitivities must be updated after each step; {steps} steps were taken since the last update"
    )]
    Missed {
        /// Number of steps taken since the last update.
        steps: u64,
    },
    /// The solver was restarted, and the sensitivities of its new values are unknown.
    #[error(
        "the solver was restarted at t = {t} (reinit, restore or correct_initial_values): continue \
         sensitivities by ForwardSensitivities::reinit; make a new Recording"
    )]
    StartedAgain {
        /// Current time.
        t: f64,
    },
    /// The pattern of the Jacobian cannot be analyzed.
    #[error(transparent)]
    Factorization(#[from] myovib_sparse::SparseError),
}

pub(crate) fn expect_length(
    what: &'static str,
    expected: usize,
    got: usize,
) -> Result<(), RadauError> {
    if got == expected { Ok(()) } else { Err(RadauError::WrongLength { what, expected, got }) }
}

/// Checks the length and the values of a vector.
pub(crate) fn expect_vector(
    what: &'static str,
    expected: usize,
    values: &[f64],
) -> Result<(), RadauError> {
    expect_length(what, expected, values.len())?;
    expect_finite(what, values)
}

pub(crate) fn expect_finite(what: &'static str, values: &[f64]) -> Result<(), RadauError> {
    match values.iter().position(|v| !v.is_finite()) {
        Some(index) => Err(RadauError::NotFinite { what, index, value: values[index] }),
        None => Ok(()),
    }
}

/// Returns an error for `option` unless its value is `good`.
pub(crate) fn expect(
    option: &'static str,
    value: f64,
    good: bool,
    expected: &'static str,
) -> Result<(), RadauError> {
    if good { Ok(()) } else { Err(RadauError::InvalidOption { option, value, expected }) }
}

/// Returns an error for `option` unless its value is finite and positive.
pub(crate) fn expect_positive(option: &'static str, value: f64) -> Result<(), RadauError> {
    let good = value.is_finite() && value > 0.0;
    expect(option, value, good, "finite and > 0")
}
