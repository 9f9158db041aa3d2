//! Static analysis: equilibrium under constant loads.

use std::time::Instant;

use myovib_dae::Problem;
use myovib_model::statics::{self, Approach};
use myovib_model::{
    CpuClock, Formulation, ModelError, Muscle, MuscleDae, Outcome, Parameters, StopReason,
};
use serde_json::json;

use super::document;
use super::folder::request;
use super::recorder::Recorder;
use super::volume::Volumes;
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
    let request = request(scene, options)?;
    request.check()?;
    let search = &mut search(options.watcher());
    let approach = statics::approach(&body.muscle, body.formulation, scene.t_end, search)?;
    let equilibrium = &approach.equilibrium;
    if let Some(error) = approach.error().filter(|_| equilibrium.load_steps == 0) {
        return Err(error.into());
    }

    // Outputs use the loads for which this state is the equilibrium.
    let muscle = match approach.reached < 1.0 {
        true => &body.muscle.under_part_of_loads(approach.reached),
        false => &body.muscle,
    };
    let mut dae = at_rest(muscle, body.formulation)?;
    let mut y = equilibrium.displacement.clone();
    y.resize(2 * equilibrium.displacement.len(), 0.0);
    y.extend(&equilibrium.pressure);
    let rest = vec![0.0; dae.n_unknowns()];
    let t = scene.t_end;
    let mut volumes = Volumes::default();
    volumes.see(t, &dae.snapshot(t, &y, &rest));
    let allow_inverted = scene
        .file
        .solid
        .as_ref()
        .is_some_and(|solid| solid.allow_inverted);
    let outcome = match (outcome_of(&approach), volumes.inversion()) {
        (Outcome::Finished, Some(seen)) if !allow_inverted => Outcome::ended(
            StopReason::Inverted,
            format!(
                "{}. `solid.allow_inverted = true` accepts it",
                seen.note(false)
            ),
        ),
        (outcome, _) => outcome,
    };
    let drift = dae.constraint_drift(t, &y).map_err(ModelError::from)?;
    let read = readings
        .iter()
        .map(|what| what.values(&mut dae, t, &y, &rest));
    let values: Vec<_> = read.collect::<Result<_, _>>()?;

    let folder = request.open().map_err(Error::before_any_output)?;
    let mut results = serde_json::Map::new();
    for ((probe, what), values) in scene.file.probe.iter().zip(readings).zip(&values) {
        let named = what
            .names()
            .into_iter()
            .zip(values.iter().map(|value| json!(value)));
        results.insert(
            probe.name.clone(),
            named.collect::<serde_json::Map<_, _>>().into(),
        );
        Recorder::new(probe, what, t, &folder)?.write(t, values)?;
    }
    let mut not_finite = None;
    if let Some(fields) = &scene.file.fields {
        let mut series = Series::new(
            folder.path(),
            Grid::of_body(body),
            fields.quantities.clone(),
            &[],
        );
        for name in series.next_files() {
            folder.claim(&name)?;
        }
        series
            .write(t, &dae.snapshot(t, &y, &rest), &[])
            .map_err(Error::file("write", &folder.path().join(vtu::LIST)))?;
        not_finite = series.not_finite();
    }
    let mut state = State::of(&mut dae, t, &y);
    state.load_reached = Some(approach.reached);
    folder.write(State::NAME, serde_json::to_string(&state)?)?;
    let document = json!({
        "scene": scene.file,
        "analysis": "static",
        "outcome": outcome.name(),
        "reason": outcome.reason().map(StopReason::name),
        "message": outcome.message(),
        "load_reached": approach.reached,
        "unknowns": equilibrium.displacement.len() + equilibrium.pressure.len(),
        "unknowns_paper": body.muscle.n_unknowns_paper(),
        "mesh": document::mesh(&body.muscle),
        "opposed_fibers": body.opposed_fibers,
        "newton_iterations": equilibrium.newton_iterations,
        "load_steps": equilibrium.load_steps,
        "constraint_drift": drift,
        "results": results,
        "inversion": volumes.inversion(),
        "volume_ratios": volumes.ratios(),
        "not_finite": not_finite,
        "cpu_seconds": cpu.elapsed().as_secs_f64(),
        "wall_seconds": started.elapsed().as_secs_f64(),
    });
    document::write(&folder, &document)?;
    let volume_note = match outcome.reason() {
        Some(StopReason::Inverted) => None, // its message says so
        _ => volumes.note(muscle, false),
    };
    Ok(RunResult {
        document,
        outcome,
        notes: instability(equilibrium)
            .into_iter()
            .chain(volume_note)
            .chain(not_finite.map(|seen| seen.note()))
            .collect(),
        modes: None,
        response: None,
    })
}

/// Returns the outcome of the search with a description of the saved state.
fn outcome_of(approach: &Approach) -> Outcome {
    let Some(error) = approach.error() else {
        return Outcome::Finished;
    };
    let reason = match error {
        ModelError::Interrupted => StopReason::Interrupted,
        _ => StopReason::NoEquilibrium,
    };
    let part = 100.0 * approach.reached;
    Outcome::ended(
        reason,
        format!("{error}; the output is the equilibrium under {part:.1} % of the load"),
    )
}

/// Returns the muscle at rest as an undamped system (q, v, λ), or (q, v) without pressure. It
/// serves for output only.
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
