//! Files of a run, and checks of whether a run can be continued in a folder.

use std::fs;
use std::path::Path;

use serde_json::Value;

use super::options::RunOptions;
use crate::result_folder::{DOCUMENT, FolderRequest, PAGE};
use crate::scene_file::{Analysis, SceneFile};
use crate::state::State;
use crate::{Error, InputError, Scene};

/// Name of the checkpoint file.
pub(super) const CHECKPOINT: &str = "checkpoint.json";

/// Names of the files written at the end of a run.
pub(super) const AT_THE_END: [&str; 3] = [DOCUMENT, State::NAME, PAGE];

/// Returns the request for the folder of a run. `own` contains the files that the analysis writes in addition to the
/// tables of probes and ratios.
pub(super) fn request<'a>(
    scene: &'a Scene,
    options: &'a RunOptions<'_>,
    own: &[&str],
) -> Result<FolderRequest<'a>, Error> {
    let is_motion = scene.file.analysis.is_in_time();
    let mut files: Vec<String> = tables_of(&scene.file).map(table_of).collect();
    files.extend(AT_THE_END.iter().chain(own).map(|&name| name.to_owned()));
    if is_motion {
        files.push(CHECKPOINT.to_owned());
    }
    let request = FolderRequest::of_scene(&options.out, "run", options.existing, scene, files)?;
    Ok(FolderRequest { can_resume: is_motion, ..request })
}

/// Fails if the folder contains a run of another scene, or if input files of the scene have changed. In these cases,
/// the run cannot be resumed.
pub(super) fn expect_same_run(request: &FolderRequest<'_>) -> Result<(), InputError> {
    let Some(before) = request.earlier_origin()? else {
        return Ok(()); // `open` reports that there is no run
    };
    let wrong = |message: String| {
        InputError::new(message)
            .at(request.path.display())
            .next("--overwrite computes the run again")
    };
    let now = &request.origin;
    if without_end(&before)["scene"] != without_end(now)["scene"] {
        let error = wrong("the run in the folder belongs to another scene".to_owned());
        return Err(error.next("or resume with the scene and the --set values of that run"));
    }
    let [before, now] = [&before, now].map(|origin| origin["inputs"].as_array());
    let is_changed = |input: &&Value| !before.is_some_and(|before| before.contains(input));
    match now.into_iter().flatten().find(is_changed) {
        Some(input) => {
            let file = input["file"].as_str().unwrap_or_default();
            Err(wrong(format!("`{file}` has changed since the run began")))
        }
        None => Ok(()),
    }
}

/// Returns whether the folder contains neither a checkpoint nor any file from the end of a run, so that there is
/// nothing to continue.
pub(super) fn was_killed_before_first_checkpoint(folder: &Path) -> bool {
    let mut files = [CHECKPOINT].iter().chain(&AT_THE_END);
    files.all(|name| fs::symlink_metadata(folder.join(name)).is_err())
}

/// Returns the origin of a run without its end time, because a resumed run may end later.
pub(super) fn without_end(origin: &Value) -> Value {
    let mut origin = origin.clone();
    if let Some(time) = origin.pointer_mut("/scene/time").and_then(Value::as_object_mut) {
        time.remove("end");
    }
    origin
}

/// Returns the name of the first column in the table of a probe: the time, or the load factor of a path.
pub(super) fn parameter(file: &SceneFile) -> &'static str {
    match (file.analysis, &file.loading_path) {
        (Analysis::Static, Some(_)) => "load",
        _ => "t",
    }
}

/// Returns the names of the tables that a run of the scene writes: one per probe, and one per ratio of a response. A
/// modal analysis writes no such tables.
fn tables_of(file: &SceneFile) -> impl Iterator<Item = &str> {
    let is_modal = file.analysis == Analysis::Modes;
    let probes = file.probe.iter().filter(move |_| !is_modal).map(|probe| probe.name.as_str());
    let response = file.response.iter();
    let ratios = response.filter(|_| file.analysis == Analysis::Response);
    let ratios = ratios.flat_map(|own| own.ratio.iter().map(|ratio| ratio.name.as_str()));
    probes.chain(ratios)
}

/// Returns the file name of a table.
pub(super) fn table_of(probe: &str) -> String {
    format!("{probe}.csv")
}
