//! Errors: misuse, and fatal errors of user functions.
//!
//! If an integration cannot continue, this is not an error but an [`Outcome::Stopped`](crate::Outcome::Stopped).

/// An error of the wrapper.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages name the fields")]
pub enum Error {
    /// An error common to all integrators.
    #[error(transparent)]
    Common(#[from] myovib_dae::IntegratorError),
    /// The problem cannot be integrated, because it has no unknowns or its Jacobian has no entries.
    #[error("nothing to integrate: {n_unknowns} unknowns, {n_entries} entries in the Jacobian")]
    Empty {
        n_unknowns: usize,
        /// Number of entries in the pattern of the Jacobian.
        n_entries: usize,
    },
    /// The parameter does not exist.
    #[error("there is no sensitivity to parameter {parameter}: this solver has {of}")]
    NoParameter {
        /// Zero-based index of the requested parameter.
        parameter: usize,
        of: usize,
    },
    /// The solver was restarted at a time other than the start, where the sensitivities are unknown.
    #[error(
        "the sensitivities are known only at the start, t = {t_start}, not at t = {t}: provide them with \
         IdaSolver::reinit_with_sensitivities"
    )]
    SensitivitiesDue {
        /// Time of the new start.
        t: f64,
        /// Start time, at which the sensitivities were given.
        t_start: f64,
    },
    /// Sensitivities cannot be corrected onto constraints.
    #[error(
        "ConsistencyMode::Constraints does not correct sensitivities: correct y by a solver without sensitivities, and \
         give the derivatives of these values"
    )]
    SensitivitiesNotCorrected,
    /// The backward problem requires a stored forward solution, see `IdaBuilder::checkpoints`.
    #[error("this solver does not store checkpoints: build it with IdaBuilder::checkpoints")]
    NoCheckpoints,
    /// The feature cannot be combined with checkpoints, because it is not repeated when steps of a run are repeated.
    #[error("{what}: not available with checkpoints; integrate up to it, and restart there")]
    NotWithCheckpoints { what: &'static str },
    /// IDAS does not support adjoints of problems of this index.
    #[error(
        "IDAS does not support the adjoint of a problem of index {index}: use a formulation of index 1 or 2, or the discrete \
         adjoint of Radau IIA (crate myovib-radau)"
    )]
    NoAdjoint {
        /// Highest index of a variable.
        index: u8,
    },
    /// The backward problem does not exist.
    #[error("there is no backward problem {number}: this solver has {of}")]
    NoBackward {
        /// Zero-based index of the requested backward problem.
        number: usize,
        of: usize,
    },
    /// The forward run cannot continue, because parts of it have been repeated for backward problems.
    #[error(
        "the forward run cannot continue after a backward integration: start a new one with reinit"
    )]
    ForwardRunLeft,
    /// A repeated part of the forward run took more steps than the original run.
    #[error(
        "the forward run took different steps when it was repeated up to t = {t}: its functions must return the same \
         values every time"
    )]
    NotRepeated { t: f64 },
    /// No consistent initial values were found.
    #[error("no consistent initial values at t = {t}: {message} ({name}, {code})")]
    InconsistentInitialValues {
        t: f64,
        /// Return code of IDAS.
        code: i32,
        /// Name of the code in IDAS.
        name: &'static str,
        /// Message of IDAS, or of the function that failed.
        message: String,
    },
    /// A user function returned a fatal error.
    #[error("the {function} failed at t = {t}: {source}")]
    Callback {
        function: &'static str,
        /// Time at which the function was called.
        t: f64,
        /// Error returned by the function.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
    /// IDAS rejected a call.
    #[error("{call} returned {code} ({name}): {message}")]
    Call {
        /// Function of IDAS.
        call: &'static str,
        code: i32,
        /// Name of the code in IDAS.
        name: &'static str,
        /// Message of IDAS; empty if IDAS did not report one.
        message: String,
    },
    /// A linear solver could not be set up.
    #[error(transparent)]
    Factorization(#[from] myovib_sparse::SparseError),
}
