//! Analysis of the harmonic response. It writes one table per probe.

use myovib_model::{EndReason, Outcome};

use super::document::{self, Clocks};
use super::folder::{request, table_of};
use super::options::{RunOptions, RunResult};
use crate::csv;
use crate::json::extend;
use crate::response::{Curves, Response};
use crate::vtu::{self, AMPLITUDES_LIST, Grid, Listing};
use crate::{Error, Scene};

pub(super) fn compute(scene: &Scene, options: &RunOptions<'_>) -> Result<RunResult, Error> {
    let clocks = Clocks::start();
    let has_fields = scene.file.response.as_ref().is_some_and(|own| !own.fields.is_empty());
    let list = has_fields.then_some(AMPLITUDES_LIST);
    let request = request(scene, options, list.as_slice())?;
    request.check()?;
    let found = Response::of_scene(scene, options.watcher()).map_err(Error::before_any_output)?;
    let folder = request.open().map_err(Error::before_any_output)?;
    for curves in &found.probes {
        folder.write(&table_of(&curves.name), table(&found, curves))?;
    }
    if let (Some(body), [_, ..]) = (&scene.body, &found.fields[..]) {
        let (space, grid) = (body.muscle.solid.space(), Grid::of_body(body));
        let mut listing = Listing::new(AMPLITUDES_LIST, &[]);
        for fields in &found.fields {
            let text = vtu::of_amplitudes(space, &grid, &fields.values);
            listing.add(&folder, fields.frequency, &text)?;
        }
    }
    let outcome = match found.is_interrupted {
        false => Outcome::Finished,
        true => Outcome::ended(
            EndReason::Interrupted,
            format!("interrupted after {} frequencies", found.frequencies.len()),
        ),
    };
    let mut document = clocks.document(scene, &outcome);
    extend(&mut document, serde_json::to_value(&found)?);
    let result = document::finish(&folder, scene, document, outcome, found.notes.clone())?;
    Ok(RunResult { response: Some(found), ..result })
}

/// Returns the table of a probe with one row per frequency.
fn table(found: &Response, curves: &Curves) -> String {
    let rows = found.frequencies.iter().enumerate().map(|(k, &frequency)| curves.row(k, frequency));
    csv::table(&Curves::header(&curves.columns), rows)
}
