//! Error estimate for the probes of a run, from a second run with looser tolerances.

use myovib_model::ErrorEstimate;
use serde_json::{Map, Value, json};

use super::dynamic;
use super::indicator::of_column;
use super::options::RunOptions;
use crate::atomic_file;
use crate::csv::read_numbers;
use crate::{Error, Scene};

/// Largest factor by which the errors of the random scenes in the guide exceed their estimates.
pub const VERIFY_MARGIN: f64 = 3.0;

/// Runs the scene again with looser tolerances. For each column of each probe, returns the largest magnitude and the
/// largest difference between the two runs. Returns `None` if the second run was interrupted.
pub(super) fn error_estimate(
    scene: &Scene,
    options: &RunOptions<'_>,
) -> Result<Option<Value>, Error> {
    let folder = atomic_file::temporary_folder(&options.out);
    let mut folder = folder.map_err(Error::file("create a folder in", &options.out))?;
    let mut looser = scene.with_looser_tolerances();
    looser.file.fields = None; // only the tables are compared
    let again = RunOptions {
        interrupt: options.interrupt,
        progress: options.progress,
        ..RunOptions::into_folder(folder.path())
    };
    let result = atomic_file::passing(|| dynamic::compute(&looser, &again));
    folder.disable_cleanup(atomic_file::has_stopped());
    if options.watcher().is_interrupted() {
        return Ok(None);
    }
    let result = result?;
    let probes = scene.file.probe.iter().map(|probe| {
        let name = format!("{}.csv", probe.name);
        let tables = [&options.out, folder.path()].map(|folder| read_numbers(&folder.join(&name)));
        let [(names, rows), (_, looser)] = match tables {
            [Ok(run), Ok(looser)] => [run, looser],
            [Err(error), _] | [_, Err(error)] => return Err(error),
        };
        let pairs = at_equal_times(&rows, &looser);
        let estimate = |k: usize| ErrorEstimate::between(pairs.iter().map(|(a, b)| (a[k], b[k])));
        let columns = names.into_iter().enumerate().skip(1); // the first column is the time
        let columns: Map<String, Value> =
            columns.map(|(k, name)| (name, of_column(&estimate(k)))).collect();
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

/// Returns the pairs of rows with equal times. Both tables are sorted by time. If a run ended early, its table has
/// fewer rows, and the time of the last row may not occur in the other table.
fn at_equal_times<'a>(rows: &'a [Vec<f64>], looser: &'a [Vec<f64>]) -> Vec<(&'a [f64], &'a [f64])> {
    let mut rest = looser.iter().peekable();
    let pairs = rows.iter().filter_map(|row| {
        while rest.next_if(|other| other[0] < row[0]).is_some() {}
        Some((&row[..], &rest.next_if(|other| other[0] == row[0])?[..]))
    });
    pairs.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_compared_at_equal_times() {
        let rows = |times: &[f64]| times.iter().map(|&t| vec![t, 10.0 * t]).collect::<Vec<_>>();
        let (run, looser) = (rows(&[0.0, 1.0, 2.0, 2.0, 4.0]), rows(&[0.0, 0.5, 2.0, 2.0, 3.0]));
        let pairs = at_equal_times(&run, &looser);
        let times: Vec<_> = pairs.iter().map(|(a, b)| (a[0], b[0])).collect();
        assert_eq!(times, [(0.0, 0.0), (2.0, 2.0), (2.0, 2.0)]);
        assert!(at_equal_times(&run, &[]).is_empty());
    }
}
