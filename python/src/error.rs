//! Errors as Python's exceptions.

use myovib_scene::{Error, InputError};
use pyo3::exceptions::{PyException, PyOSError, PyRuntimeError, PyValueError};
use pyo3::{PyErr, create_exception};

create_exception!(
    myovib,
    StepFailure,
    PyException,
    "To be raised by a residual or a Jacobian that cannot be evaluated: a smaller step is tried."
);
create_exception!(
    myovib,
    SceneError,
    PyValueError,
    "Something in a scene is wrong: what, where, and what is allowed."
);

/// An error of a scene's run.
pub(crate) fn of_scene(error: Error) -> PyErr {
    let cause = std::error::Error::source(&error).map_or(String::new(), |c| format!(": {c}"));
    let text = format!("{error}{cause}");
    match error {
        Error::Input(_) => SceneError::new_err(text),
        Error::File { .. } => PyOSError::new_err(text),
        _ => PyRuntimeError::new_err(text),
    }
}

/// An error of the program's own commands.
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

/// Arguments that make no sense.
pub(crate) fn of_argument(error: impl std::fmt::Display) -> PyErr {
    PyValueError::new_err(error.to_string())
}
