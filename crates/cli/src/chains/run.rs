//! A scene's chain is run, with its body or on a motion that was recorded.

use std::sync::Arc;

use anyhow::Context;
use myovib_dae::Problem;
use myovib_model::coupling::{Body, CoherenceHistory, CoupledDae, Recorder, Recording, Settling};
use myovib_model::{Displacement, Integrator, Outcome, SampleTimes, Sampler, Statistics};
use myovib_scene::scene_file::chain::Place;
use myovib_scene::{Scene, run};

use super::EVERY;
use crate::exit::Exit;
use crate::progress::Progress;
use crate::watched::run_watched;

/// A finished run of a chain, on whatever body.
pub struct ChainRun {
    /// What was run.
    pub scene: Scene,
    /// Coherence at sample times.
    pub history: CoherenceHistory,
    /// Counts and outcome.
    pub statistics: Statistics,
    /// Length of the integrator's vector.
    pub unknowns: usize,
    /// Whether the body moved with the chain, or its motion was replayed.
    pub has_body: bool,
}

impl ChainRun {
    /// Length of the window over which the run is judged: 20 s, or less for a short run.
    pub fn window(&self) -> f64 {
        20.0_f64.min(self.scene.t_end / 2.0)
    }

    /// Settled values over the window; none for a run that stopped too early to have any.
    pub fn settled(&self) -> Option<Settling> {
        self.history.settled(self.window()).ok()
    }

    /// How a command that shows this run ends; a run that stopped is shown as far as it got.
    pub fn exit(&self) -> Exit {
        Exit::of(&self.statistics.outcome)
    }

    /// Number of oscillators.
    pub fn n_oscillators(&self) -> usize {
        self.scene.chains[0].chain.omega.len()
    }
}

/// Runs the body of `scene` and its chain as one system.
///
/// # Errors
/// Fatal errors of the run.
pub fn on_its_body(scene: Scene, progress: &Progress) -> anyhow::Result<ChainRun> {
    match scene.body {
        Some(_) => observe(&mut *run::with_chains(&scene)?, scene, true, progress),
        None => observe(&mut *run::rod_with_chains(&scene)?, scene, true, progress),
    }
}

/// Runs the chain of `scene` alone, driven by a recorded motion.
///
/// # Errors
/// Fatal errors of the run.
pub fn replay(
    scene: Scene,
    motion: &Arc<Recording>,
    progress: &Progress,
) -> anyhow::Result<ChainRun> {
    observe(&mut *run::replayed(&scene, motion)?, scene, false, progress)
}

/// Integrates and observes the first network of a coupled system.
fn observe<B: Body>(
    integrator: &mut dyn Integrator<CoupledDae<B>>,
    scene: Scene,
    has_body: bool,
    progress: &Progress,
) -> anyhow::Result<ChainRun> {
    let unknowns = integrator.problem().n_unknowns();
    let mut history = CoherenceHistory::default();
    let mut sampler = Sampler::new(
        SampleTimes::new(EVERY, scene.t_end),
        unknowns,
        |dae: &mut CoupledDae<B>, t, y: &[f64]| Ok(history.record(dae, 0, t, y)?),
    );
    let statistics = run_watched(integrator, &mut sampler, ("chain", scene.t_end), progress)?;
    drop(sampler);
    Ok(ChainRun {
        scene,
        history,
        statistics,
        unknowns,
        has_body,
    })
}

/// The motion of the point of a scene's body that drives its chain, without the chain.
///
/// # Errors
/// A run that does not reach its end.
pub fn record(scene: &Scene, progress: &Progress) -> anyhow::Result<Arc<Recording>> {
    let mut alone = scene.clone();
    alone.chains.clear();
    let chain = scene.chains.first().context("the scene has no chain")?;
    let end = scene.t_end;
    if let Some(rod) = &scene.rod {
        let Some(Place::Position(x)) = chain.at else {
            anyhow::bail!("the chain is not driven");
        };
        let point = rod.displacement_at(x)?;
        return keep(
            &mut *run::rod_with_chains(&alone)?,
            ("rod", end),
            point,
            progress,
        );
    }
    let mut integrator = run::muscle_alone(&alone)?;
    let place = chain.places.first().context("the chain is not driven")?;
    let point = place.displacement(integrator.problem());
    keep(&mut *integrator, ("muscle", end), point, progress)
}

fn keep<P: Problem>(
    integrator: &mut dyn Integrator<P>,
    end: (&str, f64),
    point: Displacement,
    progress: &Progress,
) -> anyhow::Result<Arc<Recording>> {
    let mut recorder = Recorder::new(point, integrator.problem().n_unknowns());
    let statistics = run_watched(integrator, &mut recorder, end, progress)?;
    if let Outcome::Stopped { message, .. } = statistics.outcome {
        anyhow::bail!("the run of the {} stopped: {message}", end.0);
    }
    Ok(Arc::new(recorder.finish()))
}
