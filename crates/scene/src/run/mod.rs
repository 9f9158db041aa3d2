//! Computes scenes and writes the results to folders.
//!
//! First, the [`Scene`] is built and the folder is prepared. Then the integrator runs, and the outputs observe each
//! accepted step. At the end, `run.json` documents the result.

mod checkpoint;
mod continuation;
mod cut;
mod document;
mod driving;
mod dynamic;
#[cfg(test)]
pub(crate) mod faults;
mod folder;
mod indicator;
mod modes;
mod options;
mod oscillations;
mod outputs;
mod period;
mod periodic;
mod recorder;
mod refinement;
mod rehearsal;
mod response;
pub(crate) mod start;
pub(crate) mod statics;
mod stop;
mod trial;
mod verify;
pub(crate) mod volume;

pub use options::{RunOptions, RunResult};
pub use start::{initial, muscle_alone, replayed, rod_with_chains, with_chains};
pub use trial::{PeriodTrial, Trial, TrialEnd, try_out, try_period};
pub use verify::VERIFY_MARGIN;

use crate::response::{Curves, Values};
pub use crate::result_folder::Existing;
use crate::scene_file::Analysis;
use crate::{Error, InputError, Scene};

/// Computes a scene and writes the results to a folder. If a search finds no equilibrium or periodic state, or is
/// interrupted before it has a result, the results that were to be overwritten are removed.
///
/// # Errors
/// Fails if the scene is invalid (before any file is written), if a search has no result, or if an output cannot be
/// written.
pub fn compute(scene: &Scene, options: &RunOptions<'_>) -> Result<RunResult, Error> {
    let computed = compute_analysis(scene, options);
    if let Err(Error::Model(error)) = &computed
        && error.is_search_without_result()
    {
        folder::request(scene, options, &[])?.discard()?;
    }
    computed
}

fn compute_analysis(scene: &Scene, options: &RunOptions<'_>) -> Result<RunResult, Error> {
    if !scene.file.analysis.is_in_time() {
        without_motion(options)?;
    }
    match scene.file.analysis {
        Analysis::Dynamic | Analysis::QuasiStatic => dynamic::compute(scene, options),
        Analysis::Static => statics::compute(scene, options),
        Analysis::Modes => modes::compute(scene, options),
        Analysis::Response => response::compute(scene, options),
        Analysis::Periodic => periodic::compute(scene, options),
    }
}

/// Rejects all scenes that [`compute`] rejects before it writes a file. This function does not search for the initial
/// state of a body; call [`initial`] for this search.
///
/// # Errors
/// Fails if probes or stop conditions refer to missing parts, if loads act at t = 0 on a body that starts at rest, or
/// if chains are invalid.
pub fn rehearse(scene: &Scene) -> Result<(), Error> {
    match scene.file.analysis {
        Analysis::Dynamic | Analysis::QuasiStatic => rehearsal::motion(scene),
        Analysis::Static => {
            scene.control()?;
            dynamic::conditions(scene)?;
            Ok(scene.readings().map(drop)?)
        }
        Analysis::Modes => Ok(()),
        Analysis::Response => Ok(Values::of_scene(scene).map(drop)?),
        Analysis::Periodic => {
            continuation::Branch::of(scene)?;
            Ok(scene.readings().map(drop)?)
        }
    }
}

/// Returns the names and columns of the tables that a run of the scene writes.
///
/// # Errors
/// Fails if a probe measures nothing in the scene.
pub(crate) fn columns_of(scene: &Scene) -> Result<Vec<(String, Vec<String>)>, InputError> {
    if scene.file.analysis == Analysis::Modes {
        let dimension = crate::modes::body_of(scene)?.muscle.solid.space().dimension();
        return Ok(vec![(modes::TABLE.to_owned(), modes::columns(dimension))]);
    }
    if scene.file.analysis == Analysis::Response {
        let tables = Values::of_scene(scene)?.tables().into_iter();
        return Ok(tables.map(|(name, columns)| (name, Curves::header(&columns))).collect());
    }
    let parameter = folder::parameter(&scene.file);
    let probes = scene.file.probe.iter().zip(scene.readings()?);
    Ok(probes.map(|(probe, what)| (probe.name.clone(), what.columns(parameter))).collect())
}

/// Rejects scenes in which the search for an equilibrium cannot start from the equilibrium of another scene.
pub(crate) fn expect_one_equilibrium(scene: &Scene) -> Result<(), InputError> {
    if scene.file.analysis != Analysis::Static {
        let error = InputError::new("only equilibria can start from a neighboring case");
        return Err(error.allowed("scenes with analysis = \"static\""));
    }
    if scene.file.loading_path.is_some() {
        let error = InputError::new("a loading path starts from the unloaded body");
        return Err(error.next("remove the [static] table, or omit --from-neighbor"));
    }
    Ok(())
}

/// Rejects options that apply only to time-dependent analyses.
fn without_motion(options: &RunOptions<'_>) -> Result<(), InputError> {
    let wrong = |option: &str, message: &str, next: &str| {
        let error = InputError::new(format!("this analysis has no time steps: {message}"));
        Err(error.at(option).next(next))
    };
    match options {
        _ if options.existing == Existing::Resume => {
            wrong("--resume", "there is nothing to continue", "compute them again with --overwrite")
        }
        _ if options.verify => {
            wrong("--verify", "there is no time integration error", "omit --verify")
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::rehearse;
    use crate::Scene;

    /// Regression: `check` accepted scenes that `run` rejected.
    #[test]
    fn probes_and_chains_beyond_a_rod_are_refused_before_a_run() {
        let refusal = |probe: f64, chain: f64| {
            let text = format!(
                "[time]\nend = 0.1\n[rod]\nload = {{ type = \"step\", value = 1.0, rise = 0.1 }}\n\
                 [[probe]]\nname = \"r\"\ntype = \"rod\"\nat = {probe:?}\n\
                 [[chain]]\nname = \"c\"\noscillators = 2\nat = {chain:?}\n"
            );
            let scene = Scene::build("scene.toml", &text, &[], Path::new("")).unwrap();
            rehearse(&scene).err().map(|error| error.to_string())
        };
        assert_eq!(refusal(0.05, 0.05), None);
        for (probe, chain, place) in [(9.0, 0.05, "line 5"), (0.05, 9.0, "line 12")] {
            let printed = refusal(probe, chain).expect("beyond the rod");
            assert!(printed.contains("scene.toml"), "{printed}");
            assert!(printed.contains(place), "{printed}");
        }
    }
}
