//! Sensitivities and fits.

use std::path::PathBuf;

use myovib_cli::commands;
use myovib_scene::Scene;
use myovib_scene::fit::{FitOptions, Loss, compute as compute_fit};
use myovib_scene::result_folder::Existing;
use myovib_scene::sensitivity::{Parameterized, Precision, StiffnessMap, compute};
use pyo3::prelude::*;

use crate::error::of_command;
use crate::interrupt::interruptible;
use crate::scene::existing_of;

/// Computes the sensitivities of a scene's outputs, writes them to the folder `out` and returns the JSON document.
#[pyfunction]
pub(crate) fn sensitivity(
    py: Python<'_>,
    scene: PathBuf,
    set: Vec<String>,
    out: PathBuf,
    in_error_test: bool,
    progress: Option<Py<PyAny>>,
) -> PyResult<String> {
    let precision = match in_error_test {
        true => Precision::Tested,
        false => Precision::OfMotion,
    };
    let computed = interruptible(py, progress, |_, watcher| -> anyhow::Result<_> {
        let scene = Parameterized::load(&scene, &set)?;
        let request = commands::sensitivity::request(&out, Existing::Refuse, &scene.scene)?;
        request.check()?;
        let curves = compute(&scene, precision, watcher)?;
        let (_, document) = commands::sensitivity::write(&request.open()?, &curves)?;
        Ok(document.to_string())
    })?;
    computed.map_err(of_command)
}

/// Computes a stiffness map, writes it to the folder `out` and returns the JSON document.
#[pyfunction]
pub(crate) fn stiffness_map(
    py: Python<'_>,
    scene: PathBuf,
    set: Vec<String>,
    out: PathBuf,
    progress: Option<Py<PyAny>>,
) -> PyResult<String> {
    let computed = interruptible(py, progress, |_, watcher| -> anyhow::Result<_> {
        let scene = Scene::load(&scene, &set)?;
        let request = commands::sensitivity::request_of_map(&out, Existing::Refuse, &scene)?;
        request.check()?;
        let map = StiffnessMap::of(&scene, watcher)?;
        let (_, document) = myovib_report::stiffness_map::write(&request.open()?, &map)?;
        Ok(document.to_string())
    })?;
    computed.map_err(of_command)
}

/// Fits the parameters of a scene, writes the results to the folder `out` and returns the JSON document.
///
/// `experiments` lists the file and the overrides of each experiment.
#[pyfunction]
#[allow(clippy::too_many_arguments)]
pub(crate) fn fit(
    py: Python<'_>,
    scene: PathBuf,
    set: Vec<String>,
    experiments: Vec<(PathBuf, Vec<String>)>,
    out: PathBuf,
    profile: bool,
    tolerance: f64,
    max_iterations: usize,
    starts: usize,
    seed: u64,
    existing: &str,
    progress: Option<Py<PyAny>>,
) -> PyResult<String> {
    let existing = existing_of(existing)?;
    let computed = interruptible(py, progress, |flag, watcher| -> anyhow::Result<_> {
        let result = compute_fit(&FitOptions {
            scene,
            set,
            experiments,
            out: out.clone(),
            existing,
            tolerance,
            max_iterations,
            starts,
            seed,
            loss: Loss::Squares,
            profile,
            interrupt: Some(flag),
            progress: watcher.progress,
        })?;
        Ok(myovib_report::fit::write(&out, &result)?.to_string())
    })?;
    computed.map_err(of_command)
}
