//! The native half of the Python package `myovib`.
//!
//! Cast: [`dae`] integrates equations whose functions are Python's; [`scene`] computes scenes, as
//! the program does, and [`identification`] their parameters; [`interrupt`] lets Ctrl-C end what runs without Python. The other half, in
//! `myovib/`, makes arguments and results Pythonic.
#![deny(unsafe_code)]

mod dae;
mod error;
mod identification;
mod interrupt;
mod problem;
mod scene;

use pyo3::prelude::*;

/// What `import myovib._native` finds.
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
