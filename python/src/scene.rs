//! Computation of scenes by the code of the command-line program.

use std::ffi::OsString;
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::thread::available_parallelism;

use myovib_cli::commands;
use myovib_report::page;
use myovib_scene::builtin::{self, SCENES};
use myovib_scene::run::{Existing, RunOptions, compute};
use myovib_scene::sensitivity::SceneParameter;
use myovib_scene::sweep::{Cases, SweepOptions, compute as compute_cases};
use myovib_scene::{Scene, atomic_file, plain};
use myovib_sparse::resources;
use pyo3::prelude::*;

use crate::error::{of_argument, of_command, of_scene};
use crate::interrupt::{abandonable, interruptible};

/// Runs a scene, writes the results to the folder `out`, and returns the notes. If `lasting` is true, files are also
/// flushed to disk (fsync).
#[pyfunction]
#[allow(clippy::too_many_arguments)]
pub(crate) fn run(
    py: Python<'_>,
    scene: PathBuf,
    set: Vec<String>,
    out: PathBuf,
    existing: &str,
    lasting: bool,
    verify: bool,
    progress: Option<Py<PyAny>>,
) -> PyResult<Vec<String>> {
    let existing = existing_of(existing)?;
    let computed = interruptible(py, progress, |flag, watcher| {
        let compute = || {
            let scene = Scene::load(&scene, &set)?;
            SceneParameter::all(&scene)?;
            let options = RunOptions {
                out,
                existing,
                verify,
                neighbor: None,
                interrupt: Some(flag),
                progress: watcher.progress,
            };
            let result = compute(&scene, &options)?;
            page::write(&options.out, &scene, &result)?;
            let notes = scene.notes().into_iter().map(|note| plain(&note));
            Ok(notes.chain(result.notes.iter().map(|note| plain(note))).collect())
        };
        match lasting {
            true => compute(),
            false => atomic_file::passing(compute),
        }
    })?;
    computed.map_err(of_scene)
}

/// Runs all cases of a parameter grid and writes the results to the folder `out`.
#[pyfunction]
#[allow(clippy::too_many_arguments)]
pub(crate) fn sweep(
    py: Python<'_>,
    scene: PathBuf,
    vary: Vec<String>,
    set: Vec<String>,
    results: Vec<String>,
    out: PathBuf,
    overwrite: bool,
    from_neighbor: bool,
    threads: Option<NonZeroUsize>,
    progress: Option<Py<PyAny>>,
) -> PyResult<()> {
    let all = || available_parallelism().unwrap_or(NonZeroUsize::MIN);
    let folder = out.clone();
    let computed = interruptible(py, progress, |flag, watcher| {
        let result = compute_cases(&SweepOptions {
            scene,
            vary,
            set,
            out,
            results,
            cases: Cases::All,
            overwrite,
            from_neighbor,
            n_threads: threads.unwrap_or_else(all),
            interrupt: Some(flag),
            progress: watcher.progress,
            finished: &page::write_case,
        })?;
        myovib_report::sweep::write(&folder, &result)
    })?;
    computed.map_err(of_scene)
}

/// Inspects a scene. Returns the text and the JSON document of `myovib check`.
#[pyfunction]
pub(crate) fn check(
    py: Python<'_>,
    scene: PathBuf,
    set: Vec<String>,
) -> PyResult<(String, String)> {
    let name = scene.display().to_string();
    let examined = abandonable(py, move || -> anyhow::Result<_> {
        let (text, document) = commands::check::examine(&name, &Scene::load(&scene, &set)?)?;
        Ok((text, serde_json::to_string(&document)?))
    })?;
    examined.map_err(of_command)
}

/// Computes the lowest eigenmodes of the body of a scene. Returns a JSON document and, as bytes, the nodal coordinates
/// followed by the mode shapes.
#[pyfunction]
pub(crate) fn modes(
    py: Python<'_>,
    scene: PathBuf,
    set: Vec<String>,
) -> PyResult<(String, Vec<u8>)> {
    let name = scene.display().to_string();
    let found = abandonable(py, move || -> anyhow::Result<_> {
        commands::modes::document(&name, Scene::load(&scene, &set)?)
    })?;
    let (document, shapes) = found.map_err(of_command)?;
    Ok((document, shapes.into_iter().flat_map(f64::to_ne_bytes).collect()))
}

/// Sets the number of threads for the assembly and factorization of large bodies.
///
/// All runs of this process share the threads. The results do not depend on the number of threads. After a call with a
/// number above 1, further calls have no effect.
#[pyfunction]
pub(crate) fn use_threads(threads: NonZeroUsize) -> PyResult<()> {
    resources::use_threads(threads.get()).map_err(|error| of_command(error.into()))
}

/// Returns the names of the built-in scenes.
#[pyfunction]
pub(crate) fn builtins() -> Vec<&'static str> {
    SCENES.iter().map(|scene| scene.name).collect()
}

/// Returns the text of a built-in scene.
#[pyfunction]
pub(crate) fn builtin_text(name: &str) -> Option<&'static str> {
    builtin::find(name).ok().map(|scene| scene.text)
}

/// Returns the versions of this package, of SUNDIALS and of KLU. If KLU is not used, the last string names the solver
/// that replaces it.
#[pyfunction]
pub(crate) fn versions() -> (&'static str, String, String) {
    let versions = myovib_scene::versions::Versions::found();
    let klu = versions.klu_text().to_owned();
    (versions.myovib, versions.sundials, klu)
}

/// Runs the command-line program with these arguments and returns its exit code.
#[pyfunction]
pub(crate) fn program(py: Python<'_>, arguments: Vec<OsString>) -> i32 {
    myovib_cli::interrupt::install();
    myovib_cli::interrupt::ignore_file_size_signal();
    py.detach(|| myovib_cli::command(arguments) as i32)
}

/// Parses the name of a policy for existing results.
pub(crate) fn existing_of(name: &str) -> PyResult<Existing> {
    match name {
        "refuse" => Ok(Existing::Refuse),
        "overwrite" => Ok(Existing::Overwrite),
        "resume" => Ok(Existing::Resume),
        other => {
            let message = format!("existing = {other:?}: must be refuse, overwrite or resume");
            Err(of_argument(message))
        }
    }
}
