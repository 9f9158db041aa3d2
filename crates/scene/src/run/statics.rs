//! An equilibrium under constant loads.

use std::time::Instant;

use myovib_dae::Problem;
use myovib_model::{
    CpuClock, Formulation, ModelError, Muscle, MuscleDae, Outcome, Parameters, statics,
};
use serde_json::json;

use super::document;
use super::folder::{Folder, Record};
use super::inversion::Inversion;
use super::recorder::Recorder;
use super::{RunOptions, RunResult};
use crate::modes::instability;
use crate::scene::Scene;
use crate::state::State;
use crate::vtu::{self, Grid, Series};
use crate::watch::search;
use crate::{Error, InputError};

/// Computes the equilibrium of a scene under its loads at the end time.
pub(super) fn compute(scene: &Scene, options: &RunOptions<'_>) -> Result<RunResult, Error> {
    let (started, cpu) = (Instant::now(), CpuClock::start());
    let Some(body) = &scene.body else {
        return Err(InputError::new("a static scene needs a [mesh] with [solid]").into());
    };
    let readings = scene.readings()?;
    let equilibrium = {
        let mut search = search(options.progress);
        statics::equilibrium_watched(&body.muscle, body.formulation, scene.t_end, &mut search)?
    };

    let folder = Folder::open(options, &Record::of(scene)?).map_err(Error::before_any_output)?;
    let mut dae = at_rest(&body.muscle, body.formulation)?;
    let mut y = equilibrium.displacement.clone();
    y.resize(2 * equilibrium.displacement.len(), 0.0);
    y.extend(&equilibrium.pressure);
    let rest = vec![0.0; dae.n_unknowns()];
    let mut results = serde_json::Map::new();
    for (probe, what) in scene.file.probe.iter().zip(readings) {
        let values = what.values(&mut dae, scene.t_end, &y, &rest)?;
        let named = what
            .names()
            .into_iter()
            .zip(values.iter().map(|value| json!(value)));
        results.insert(
            probe.name.clone(),
            named.collect::<serde_json::Map<_, _>>().into(),
        );
        let mut recorder = Recorder::new(probe, what, scene.t_end, folder.path())?;
        recorder.write(scene.t_end, &values)?;
    }
    let inversion = Inversion::of(scene.t_end, &dae.snapshot(scene.t_end, &y, &rest));
    if let Some(fields) = &scene.file.fields {
        let mut series = Series::new(
            folder.path(),
            Grid::of_body(body),
            fields.quantities.clone(),
            &[],
        );
        series
            .write(scene.t_end, &dae.snapshot(scene.t_end, &y, &rest), &[])
            .map_err(Error::file("write", &folder.path().join(vtu::LIST)))?;
    }
    let state = serde_json::to_string(&State::of(&mut dae, scene.t_end, &y))?;
    folder.write(State::NAME, &state)?;
    let document = json!({
        "scene": scene.file,
        "analysis": "static",
        "outcome": "finished",
        "unknowns": equilibrium.displacement.len() + equilibrium.pressure.len(),
        "unknowns_paper": body.muscle.n_unknowns_paper(),
        "mesh": document::mesh(&body.muscle),
        "opposed_fibres": body.opposed_fibres,
        "newton_iterations": equilibrium.newton_iterations,
        "load_steps": equilibrium.load_steps,
        "constraint_drift": dae.constraint_drift(scene.t_end, &y).map_err(ModelError::from)?,
        "results": results,
        "inversion": inversion,
        "cpu_seconds": cpu.elapsed().as_secs_f64(),
        "wall_seconds": started.elapsed().as_secs_f64(),
    });
    document::write(&folder, &document)?;
    Ok(RunResult {
        document,
        outcome: Outcome::Finished,
        notes: instability(&equilibrium)
            .into_iter()
            .chain(inversion.map(|seen| seen.note(false)))
            .collect(),
        modes: None,
    })
}

/// The muscle at rest as a system (q, v, λ), or (q, v) without pressure, without damping: for
/// reading off values.
fn at_rest(muscle: &Muscle, formulation: Formulation) -> Result<MuscleDae, ModelError> {
    let mut muscle = muscle.relaxed();
    let kappa = muscle.parameters.kappa();
    muscle.parameters = Parameters::new(0.0, 0.0, kappa)?;
    let formulation = match formulation {
        Formulation::Displacement => formulation,
        _ => Formulation::Position,
    };
    MuscleDae::new(muscle, formulation)
}
