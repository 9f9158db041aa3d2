//! Modal analysis: lowest eigenfrequencies and modes.

use myovib_model::Outcome;
use serde_json::json;

use super::document::{self, Clocks};
use super::folder::{request, table_of};
use super::options::{RunOptions, RunResult};
use crate::csv;
use crate::json::extend;
use crate::modes::{self, Modes};
use crate::scene::{Body, NAMES};
use crate::vtu::{self, Grid};
use crate::{Error, Scene};

pub(super) const TABLE: &str = "modes";

/// Returns the column names of the table of modes for a body in `dimension` dimensions.
pub(super) fn columns(dimension: usize) -> Vec<String> {
    let axes =
        |name: &'static str| NAMES[..dimension].iter().map(move |axis| format!("{name}_{axis}"));
    let own = ["mode", "omega_squared", "frequency", "damping_ratio"].map(str::to_owned);
    own.into_iter().chain(axes("participation")).chain(axes("effective_mass")).collect()
}

pub(super) fn compute(scene: &Scene, options: &RunOptions<'_>) -> Result<RunResult, Error> {
    let clocks = Clocks::start();
    let body = modes::body_of(scene)?;
    let muscle = &body.muscle;
    let file = table_of(TABLE);
    let request = request(scene, options, &[&file, vtu::SHAPES])?;
    request.check()?;
    let found =
        Modes::of_scene(scene, None, options.watcher()).map_err(Error::before_any_output)?;
    let folder = request.open().map_err(Error::before_any_output)?;
    folder.write(&file, table(body, &found))?;
    let (space, grid) = (muscle.solid.space(), Grid::of_body(body));
    folder.write(vtu::SHAPES, vtu::of_modes(space, &grid, found.all()))?;
    let mut document = clocks.document(scene, &Outcome::Finished);
    document["unknowns"] = json!(muscle.solid.dofs().n_free() + muscle.solid.space().n_pressures());
    document["unknowns_paper"] = json!(muscle.n_unknowns_paper());
    extend(&mut document, serde_json::to_value(&found)?);
    let notes = found.muscles.iter().flat_map(|body| body.notes.clone()).collect();
    let result = document::finish(&folder, scene, document, Outcome::Finished, notes)?;
    Ok(RunResult { modes: Some(found), ..result })
}

/// Returns the table with one row per mode. Frequencies of unstable modes are NaN.
fn table(body: &Body, found: &Modes) -> String {
    let rows = found.all().enumerate().map(|(n, mode)| {
        let or_none = |value: Option<f64>| value.unwrap_or(f64::NAN);
        let [frequency, ratio] = [mode.frequency, mode.damping_ratio].map(or_none);
        let own = [(n + 1) as f64, mode.omega_squared, frequency, ratio];
        [&own, &mode.participation[..], &mode.effective_mass].concat()
    });
    csv::table(&columns(body.muscle.solid.space().dimension()), rows)
}
