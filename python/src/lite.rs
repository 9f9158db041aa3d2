#![allow(dead_code, missing_docs, unused)]
mod dae;
mod error {
    use pyo3::exceptions::{PyException, PyValueError};
    use pyo3::{PyErr, create_exception};
    create_exception!(myovib, StepFailure, PyException, "x");
    create_exception!(myovib, SceneError, PyValueError, "x");
    pub(crate) fn of_argument(error: impl std::fmt::Display) -> PyErr {
        PyValueError::new_err(error.to_string())
    }
}
mod problem;
use pyo3::prelude::*;
#[pyfunction]
fn use_threads() {}
#[pyfunction]
fn versions() {}
#[pymodule]
mod _native {
    #[pymodule_export]
    use crate::dae::solve;
    #[pymodule_export]
    use crate::error::{SceneError, StepFailure};
    #[pymodule_export]
    use crate::{use_threads, versions};
}
