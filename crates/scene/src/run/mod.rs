//! A scene is computed into a folder.
//!
//! Order: the scene is made whole ([`Scene`]), then the folder is prepared, then the integrator
//! runs with the outputs looking at each accepted step, and at the end `run.json` says what
//! happened.

mod checkpoint;
mod cut;
mod document;
mod dynamic;
#[cfg(test)]
mod faults;
mod folder;
mod indicator;
mod modes;
mod oscillations;
mod outputs;
mod recorder;
mod rehearsal;
pub(crate) mod start;
mod statics;
mod stop;
pub(crate) mod system;
mod trial;
mod verify;
mod volume;

use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

use myovib_model::Outcome;
pub use start::{initial, muscle_alone, replayed, rod_with_chains, with_chains};
pub use trial::{Trial, TrialEnd, try_out};

use crate::modes::Modes;
pub use crate::result_folder::Existing;
use crate::scene_file::Analysis;
use crate::watch::{Tell, Watcher};
use crate::{Error, InputError, Scene};

/// Where a run goes, and who hears of it.
#[derive(Clone)]
pub struct RunOptions<'a> {
    /// The folder.
    pub out: PathBuf,
    /// What is done with a run that the folder holds.
    pub existing: Existing,
    /// A flag that ends the run in good order.
    pub interrupt: Option<&'static AtomicBool>,
    /// Who is told how far the run is.
    pub progress: &'a dyn Tell,
    /// Whether a second run at looser tolerances says how far off this one is.
    pub verify: bool,
}

impl RunOptions<'_> {
    /// A run into a folder that holds none, watched by nobody.
    pub fn into_folder(out: impl Into<PathBuf>) -> Self {
        Self {
            out: out.into(),
            existing: Existing::Refuse,
            interrupt: None,
            progress: &(),
            verify: false,
        }
    }

    /// Who watches.
    pub(crate) fn watcher(&self) -> Watcher<'_> {
        Watcher {
            interrupt: self.interrupt,
            progress: self.progress,
        }
    }
}

/// What a run came to.
#[derive(Debug, Clone)]
pub struct RunResult {
    /// The body of `run.json`.
    pub document: serde_json::Value,
    /// How it ended.
    pub outcome: Outcome,
    /// What was put right on the way.
    pub notes: Vec<String>,
    /// What an analysis of modes found.
    pub modes: Option<Modes>,
}

/// Computes a scene into its folder.
///
/// # Errors
/// A wrong scene (before anything is written), or an output that cannot be written.
pub fn compute(scene: &Scene, options: &RunOptions<'_>) -> Result<RunResult, Error> {
    match scene.file.analysis {
        Analysis::Dynamic => {
            let verify: dynamic::Verify = verify::error_estimate;
            dynamic::compute(scene, options, options.verify.then_some(verify))
        }
        Analysis::Static => {
            without_motion(options)?;
            statics::compute(scene, options)
        }
        Analysis::Modes => {
            without_motion(options)?;
            modes::compute(scene, options)
        }
    }
}

/// Refuses what [`compute`] refuses before it writes anything, but for what the search for a body's start finds: that
/// is [`initial`]'s.
///
/// # Errors
/// Probes and conditions of what is not there; loads on a body at rest; chains that cannot be.
pub fn rehearse(scene: &Scene) -> Result<(), Error> {
    match scene.file.analysis {
        Analysis::Dynamic => rehearsal::motion(scene),
        Analysis::Static => Ok(scene.readings().map(drop)?),
        Analysis::Modes => Ok(()),
    }
}

/// The tables that a run of the scene writes, with their columns.
///
/// # Errors
/// Probes that measure nothing of the scene.
pub(crate) fn columns_of(scene: &Scene) -> Result<Vec<(String, Vec<String>)>, InputError> {
    if scene.file.analysis == Analysis::Modes {
        let columns = modes::COLUMNS.map(str::to_owned).to_vec();
        return Ok(vec![(folder::MODES.to_owned(), columns)]);
    }
    let probes = scene.file.probe.iter().zip(scene.readings()?);
    Ok(probes
        .map(|(probe, what)| (probe.name.clone(), what.columns()))
        .collect())
}

/// Refuses what has a meaning for motions alone.
fn without_motion(options: &RunOptions<'_>) -> Result<(), InputError> {
    let wrong = |option: &str, message: &str| {
        let error = InputError::new(format!("the scene has no motion: {message}"));
        Err(error.at(option).next(format!("leave {option} out")))
    };
    match options {
        _ if options.existing == Existing::Resume => {
            wrong("--resume", "there is nothing to go on with")
        }
        _ if options.verify => wrong("--verify", "it has no error in time"),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::rehearse;
    use crate::Scene;

    /// Regression: `check` found right what `run` refused.
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
            let said = refusal(probe, chain).expect("beyond the rod");
            assert!(said.contains("scene.toml"), "{said}");
            assert!(said.contains(place), "{said}");
        }
    }
}
