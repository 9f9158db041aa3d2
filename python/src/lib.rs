//! Native part of the Python package `myovib`.
//!
//! [`dae`] integrates equations given by Python functions. [`scene`] runs scenes in the same way as the command-line
//! program. [`identification`] computes sensitivities and stiffness maps, and fits parameters. [`interrupt`] allows
//! Ctrl-C to end computations that run without the GIL. The Python interface is in `myovib/`.
#![deny(unsafe_code)]

mod dae;
mod error;
mod identification;
mod interrupt;
mod problem;
mod scene;

use pyo3::prelude::*;

/// Contents of `myovib._native`.
#[pymodule]
mod _native {
    #[pymodule_export]
    use crate::dae::solve;
    #[pymodule_export]
    use crate::error::{SceneError, StepFailure};
    #[pymodule_export]
    use crate::identification::{fit, sensitivity, stiffness_map};
    #[pymodule_export]
    use crate::scene::{
        builtin_text, builtins, check, modes, program, run, sweep, use_threads, versions,
    };
}
