//! Runs of the chain of a scene, either with its body or on a recorded motion.

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

/// Finished run of a chain, either with its body or on a recorded motion.
pub struct ChainRun {
    pub scene: Scene,
    /// Coherence at sample times.
    pub history: CoherenceHistory,
    /// Counters and outcome of the integrator.
    pub statistics: Statistics,
    /// Number of unknowns of the integrator.
    pub unknowns: usize,
    /// Whether the body moved together with the chain; otherwise its motion was replayed.
    pub has_body: bool,
}

impl ChainRun {
    /// Returns the length (s) of the window in which the run is evaluated: 20 s, or half of a run shorter than
    /// 40 s.
    pub fn window(&self) -> f64 {
        20.0_f64.min(self.scene.t_end / 2.0)
    }

    /// Returns the settled values in the window, or `None` if the run stopped before the window.
    pub fn settled(&self) -> Option<Settling> {
        self.history.settled(self.window()).ok()
    }

    /// Returns the exit code of a command that shows this run. A run that stopped early is shown up to its last time.
    pub fn exit(&self) -> Exit {
        Exit::of(&self.statistics.outcome)
    }

    pub fn n_oscillators(&self) -> usize {
        self.scene.chains[0].chain.omega.len()
    }
}

/// Integrates the body of `scene` and its chain as one system.
pub fn on_its_body(scene: Scene, progress: &Progress) -> anyhow::Result<ChainRun> {
    match scene.body {
        Some(_) => observe(&mut *run::with_chains(&scene)?, scene, true, progress),
        None => observe(&mut *run::rod_with_chains(&scene)?, scene, true, progress),
    }
}

/// Runs the chain of `scene` alone, driven by a recorded motion.
pub fn replay(
    scene: Scene,
    motion: &Arc<Recording>,
    progress: &Progress,
) -> anyhow::Result<ChainRun> {
    observe(&mut *run::replayed(&scene, motion)?, scene, false, progress)
}

/// Integrates a coupled system and observes its first network.
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
    Ok(ChainRun { scene, history, statistics, unknowns, has_body })
}

/// Records the motion of the point that drives the chain of a scene, without integrating the chain.
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
        return keep(&mut *run::rod_with_chains(&alone)?, ("rod", end), point, progress);
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
