//! The errors of this crate: misuse, and what the problem itself refuses.
//!
//! An integration that cannot go on is not an error but an
//! [`Outcome::Stopped`](myovib_dae::Outcome::Stopped).

/// What makes an integration impossible.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RadauError {
    /// There is no such method here.
    #[error("Radau IIA with {stages} stages is not offered: use 1, 3, 5 or 7")]
    Stages {
        /// The number asked for.
        stages: usize,
    },
    /// A setting has a value that makes no sense.
    #[error("{option} = {value}: must be {expected}")]
    InvalidOption {
        /// Name of the setting.
        option: &'static str,
        /// The value given.
        value: f64,
        /// What it must be.
        expected: &'static str,
    },
    /// An array has the wrong length.
    #[error("{what}: expected length {expected}, got {got}")]
    WrongLength {
        /// Which array.
        what: &'static str,
        /// The length it should have.
        expected: usize,
        /// The length it has.
        got: usize,
    },
    /// A component of an array is infinite or not a number.
    #[error("{what}[{index}] = {value} is not finite")]
    NotFinite {
        /// Which array.
        what: &'static str,
        /// The component.
        index: usize,
        /// Its value.
        value: f64,
    },
    /// A problem without unknowns cannot be integrated.
    #[error("nothing to integrate: no unknowns")]
    Empty,
    /// An output time, or a time to stop at, lies behind the time reached.
    #[error("the time {t_out} lies behind t = {t}, the time reached")]
    TimeBehind {
        /// The time asked for.
        t_out: f64,
        /// The time reached.
        t: f64,
    },
    /// Dense output was asked for outside of the last step, or of too high a derivative.
    #[error("no derivative of order {derivative} at t = {t}: there are 0 and 1 on [{from}, {to}]")]
    NoDenseOutput {
        /// The time asked for.
        t: f64,
        /// The derivative asked for.
        derivative: usize,
        /// Start of the last step.
        from: f64,
        /// End of the last step.
        to: f64,
    },
    /// Quadratures were asked for, but none were set up.
    #[error("this solver has no quadratures")]
    NoQuadrature,
    /// The adjoint cannot be taken back over a step.
    #[error("the adjoint cannot be taken back over the step at t = {t}: {message}")]
    Adjoint {
        /// Begin of the step.
        t: f64,
        /// Why.
        message: String,
    },
    /// A run did not repeat itself from a checkpoint.
    #[error(
        "the step at t = {t} does not repeat itself: between recorded steps do nothing to the solver \
         but step it, or keep the stages"
    )]
    NotRepeated {
        /// Begin of the step.
        t: f64,
    },
    /// Initial values were to be corrected after the first step.
    #[error("initial values can be corrected before the first step only, not at t = {t}")]
    AfterTheStart {
        /// The time reached.
        t: f64,
    },
    /// No consistent initial values were found.
    #[error("no consistent initial values at t = {t}: {source}")]
    Inconsistent {
        /// The initial time.
        t: f64,
        /// Why.
        source: myovib_dae::Inconsistent,
    },
    /// The initial values contradict the equations.
    #[error(transparent)]
    Start(#[from] myovib_dae::InconsistentStart),
    /// Components are to be left out by an index that is not stated.
    #[error(transparent)]
    NoIndices(#[from] myovib_dae::NoIndices),
    /// The problem, or its linear algebra, failed for good.
    #[error("the {function} failed at t = {t} with step {h}: {source}")]
    Fatal {
        /// What failed.
        function: &'static str,
        /// The beginning of the step.
        t: f64,
        /// The step tried.
        h: f64,
        /// The error as it was raised.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
    /// Sensitivities or an adjoint were asked for of a problem with fading memory.
    #[error(
        "no sensitivities with a fading memory: they would lack those of its states; keep these among \
         the unknowns"
    )]
    Fading,
    /// The equations of a sensitivity cannot be solved.
    #[error("no sensitivity to `{parameter}` over the step from t = {t}: {message}")]
    Sensitivity {
        /// The parameter.
        parameter: String,
        /// The beginning of the step.
        t: f64,
        /// Why.
        message: String,
    },
    /// Sensitivities were not told of each step.
    #[error("sensitivities follow each step at once; {steps} steps were taken since the last")]
    Missed {
        /// Steps taken since.
        steps: u64,
    },
    /// The solver was started again, and the sensitivities at its new values are not known.
    #[error(
        "the solver was started again at t = {t} (reinit, restore or correct_initial_values): continue \
         sensitivities by ForwardSensitivities::reinit; make a new Recording"
    )]
    StartedAgain {
        /// The time reached.
        t: f64,
    },
    /// The pattern of the Jacobian cannot be analysed.
    #[error(transparent)]
    Factorization(#[from] myovib_sparse::SparseError),
}

pub(crate) fn expect_length(
    what: &'static str,
    expected: usize,
    got: usize,
) -> Result<(), RadauError> {
    if got == expected {
        Ok(())
    } else {
        Err(RadauError::WrongLength {
            what,
            expected,
            got,
        })
    }
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
        Some(index) => Err(RadauError::NotFinite {
            what,
            index,
            value: values[index],
        }),
        None => Ok(()),
    }
}
