//! Conversion of errors to Python exceptions.

use myovib_scene::{Error, InputError};
use pyo3::exceptions::{PyException, PyOSError, PyRuntimeError, PyValueError};
use pyo3::{PyErr, create_exception};

create_exception!(
    myovib,
    StepFailure,
    PyException,
    "Raise this in a residual or a Jacobian that cannot be evaluated; the integrator then tries a smaller step."
);
create_exception!(
    myovib,
    SceneError,
    PyValueError,
    "Raised for an invalid scene or invalid measurements. The message names the location and the allowed values."
);

/// Converts an error that occurred in the computation of a scene.
pub(crate) fn of_scene(error: Error) -> PyErr {
    let cause = std::error::Error::source(&error).map_or(String::new(), |c| format!(": {c}"));
    let text = format!("{error}{cause}");
    match error {
        Error::Input(_) => SceneError::new_err(text),
        Error::File { .. } => PyOSError::new_err(text),
        _ => PyRuntimeError::new_err(text),
    }
}

/// Converts an error of a command.
pub(crate) fn of_command(error: anyhow::Error) -> PyErr {
    let error = match error.downcast::<Error>() {
        Ok(error) => return of_scene(error),
        Err(other) => other,
    };
    let text = format!("{error:#}");
    match error.downcast_ref::<InputError>() {
        Some(input) => SceneError::new_err(input.to_string()),
        None if error.is::<std::io::Error>() => PyOSError::new_err(text),
        None => PyRuntimeError::new_err(text),
    }
}

/// Converts an error in the arguments.
pub(crate) fn of_argument(error: impl std::fmt::Display) -> PyErr {
    PyValueError::new_err(error.to_string())
}
