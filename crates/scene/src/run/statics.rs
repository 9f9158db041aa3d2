//! An equilibrium under constant loads.

use std::ops::ControlFlow;
use std::sync::atomic::Ordering;
use std::time::Instant;

use myovib_dae::Problem;
use myovib_model::statics::{self, Approach, Search, Shortfall};
use myovib_model::{
    CpuClock, Formulation, ModelError, Muscle, MuscleDae, Outcome, Parameters, StopReason,
};
use serde_json::json;

use super::document;
use super::folder::{Folder, Record};
use super::recorder::Recorder;
use super::volume::Volumes;
use super::{RunOptions, RunResult};
use crate::modes::instability;
use crate::scene::{Body, Scene};
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
    let record = Record::of(scene)?;
    Folder::expect_free(options, &record)?;
    let approach = approach(scene, body, options)?;
    let (equilibrium, outcome) = (&approach.equilibrium, outcome_of(&approach));
    if equilibrium.load_steps == 0 {
        return Err(match failure_of(&approach) {
            Some(error) => error.into(),
            None => {
                Error::Stopped("interrupted before a part of the load was in equilibrium".into())
            }
        });
    }

    let folder = Folder::open(options, &record).map_err(Error::before_any_output)?;
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
    let mut volumes = Volumes::default();
    volumes.see(scene.t_end, &dae.snapshot(scene.t_end, &y, &rest));
    let mut objection = None;
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
        objection = series.objection();
    }
    let state = serde_json::to_string(&State::of(&mut dae, scene.t_end, &y))?;
    folder.write(State::NAME, &state)?;
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
        "opposed_fibres": body.opposed_fibres,
        "newton_iterations": equilibrium.newton_iterations,
        "load_steps": equilibrium.load_steps,
        "constraint_drift": dae.constraint_drift(scene.t_end, &y).map_err(ModelError::from)?,
        "results": results,
        "inversion": volumes.inversion(),
        "volume_ratios": volumes.ratios(),
        "cpu_seconds": cpu.elapsed().as_secs_f64(),
        "wall_seconds": started.elapsed().as_secs_f64(),
    });
    document::write(&folder, &document)?;
    Ok(RunResult {
        document,
        outcome,
        notes: instability(equilibrium)
            .into_iter()
            .chain(volumes.inversion().map(|seen| seen.note(false)))
            .chain(objection)
            .collect(),
        modes: None,
    })
}

/// Goes towards the equilibrium, until the run is interrupted.
fn approach(scene: &Scene, body: &Body, options: &RunOptions<'_>) -> Result<Approach, ModelError> {
    let mut tell = search(options.progress);
    let mut watch = |at: &Search| {
        tell(at);
        match options.interrupt {
            Some(flag) if flag.load(Ordering::Relaxed) => ControlFlow::Break(()),
            _ => ControlFlow::Continue(()),
        }
    };
    statics::approach(&body.muscle, body.formulation, scene.t_end, &mut watch)
}

/// The error of a search that found no equilibrium at all, or not that of the whole load.
fn failure_of(approach: &Approach) -> Option<ModelError> {
    match approach.shortfall? {
        Shortfall::Interrupted => None,
        Shortfall::NotConverged { inverted, remedy } => Some(ModelError::NoEquilibrium {
            reached: approach.reached,
            inverted,
            remedy,
        }),
    }
}

fn outcome_of(approach: &Approach) -> Outcome {
    let kept = format!(
        "what is kept is the equilibrium under {:.1} % of the load",
        100.0 * approach.reached
    );
    match (failure_of(approach), approach.shortfall) {
        (Some(error), _) => Outcome::ended(StopReason::NoEquilibrium, format!("{error}; {kept}")),
        (None, Some(_)) => Outcome::ended(StopReason::Interrupted, format!("interrupted; {kept}")),
        (None, None) => Outcome::Finished,
    }
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
