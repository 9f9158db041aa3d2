//! Error estimate for the probes of a run, from a second run with looser tolerances.

use std::fs;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use myovib_model::ErrorEstimate;
use serde_json::{Map, Value, json};

use super::dynamic;
use super::indicator::of_column;
use super::options::RunOptions;
use crate::atomic_file;
use crate::csv::Table;
use crate::{Error, Scene};

/// Runs the scene again at looser tolerances. Returns the largest magnitude of each
/// column of each probe and the largest difference between both runs. Returns `None` if
/// interrupted.
pub(super) fn error_estimate(
    scene: &Scene,
    options: &RunOptions<'_>,
) -> Result<Option<Value>, Error> {
    let folder = atomic_file::temporary_folder(&options.out);
    let mut folder = folder.map_err(Error::file("make a folder in", &options.out))?;
    let mut looser = scene.with_looser_tolerances();
    looser.file.fields = None; // only the tables are compared
    let again = RunOptions {
        interrupt: options.interrupt,
        progress: options.progress,
        ..RunOptions::into_folder(folder.path())
    };
    let result = atomic_file::passing(|| dynamic::compute(&looser, &again, None));
    folder.disable_cleanup(atomic_file::has_stopped());
    let is_set = |flag: &AtomicBool| flag.load(Ordering::Relaxed);
    if options.interrupt.is_some_and(is_set) {
        return Ok(None);
    }
    let result = result?;
    let probes = scene.file.probe.iter().map(|probe| {
        let name = format!("{}.csv", probe.name);
        let tables = [&options.out, folder.path()].map(|folder| read(&folder.join(&name)));
        let [(names, rows), (_, looser)] = match tables {
            [Ok(run), Ok(looser)] => [run, looser],
            [Err(error), _] | [_, Err(error)] => return Err(error),
        };
        let estimates = ErrorEstimate::between(&rows, &looser);
        let columns = names.into_iter().zip(estimates).skip(1); // the first is the time
        let columns: Map<String, Value> = columns.map(|(n, e)| (n, of_column(&e))).collect();
        Ok((probe.name.clone(), Value::Object(columns)))
    });
    Ok(Some(json!({
        "rtol": looser.file.integrator.rtol,
        "outcome": result.document["outcome"],
        "t_reached": result.document["t_reached"],
        "steps": result.document["steps"],
        "probes": probes.collect::<Result<Map<String, Value>, Error>>()?,
    })))
}

/// Reads names and rows of a table.
fn read(path: &Path) -> Result<(Vec<String>, Vec<Vec<f64>>), Error> {
    let text = fs::read_to_string(path).map_err(Error::file("read", path))?;
    let table = Table::parse(&text).map_err(|error| {
        let error = std::io::Error::other(error);
        Error::file("read", path)(error)
    })?;
    let rows = table.rows.iter().filter_map(|row| table.numbers(row));
    let rows = rows.collect();
    Ok((table.names, rows))
}
