//! Errors of this crate: invalid calls, and fatal errors of the problem.
//!
//! An integration that cannot continue returns an [`Outcome::Stopped`](myovib_dae::Outcome::Stopped), not an error.

/// Reason why an integration is impossible.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages name the fields")]
pub enum RadauError {
    /// An error common to all integrators.
    #[error(transparent)]
    Common(#[from] myovib_dae::IntegratorError),
    /// The method does not exist.
    #[error("Radau IIA with {stages} stages is not supported: use 1, 3, 5 or 7")]
    Stages { stages: usize },
    /// The problem has no unknowns.
    #[error("nothing to integrate: no unknowns")]
    Empty,
    /// The adjoint equations of a step could not be solved.
    #[error("the adjoint equations cannot be solved over the step at t = {t}: {message}")]
    Adjoint {
        /// Start of the step.
        t: f64,
        message: String,
    },
    /// A step repeated from a checkpoint differs from the recorded step.
    #[error(
        "the step at t = {t} cannot be replayed exactly: do not modify the solver between recorded steps, or store \
         the stages of all steps"
    )]
    NotRepeated {
        /// Start of the step.
        t: f64,
    },
    /// The problem or its linear algebra failed with a fatal error.
    #[error("the {function} failed at t = {t} with step {h}: {source}")]
    Fatal {
        function: &'static str,
        /// Start of the step.
        t: f64,
        /// Size of the attempted step.
        h: f64,
        source: Box<dyn std::error::Error + Send + Sync>,
    },
    /// Sensitivities or an adjoint were requested for a problem with internal variables.
    #[error("sensitivities do not support internal variables: make them unknowns")]
    InternalVariables,
    /// The equations of a sensitivity could not be solved.
    #[error(
        "the sensitivity to `{parameter}` cannot be computed over the step from t = {t}: {message}"
    )]
    Sensitivity {
        parameter: String,
        /// Start of the step.
        t: f64,
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
    /// The solver was restarted, and the sensitivities of the new values are unknown.
    #[error(
        "the solver was restarted at t = {t} (reinit, restore or correct_initial_values): continue sensitivities \
         with ForwardSensitivities::reinit, and create a new Recording"
    )]
    StartedAgain { t: f64 },
    /// The pattern of the Jacobian could not be analyzed.
    #[error(transparent)]
    Factorization(#[from] myovib_sparse::SparseError),
}
