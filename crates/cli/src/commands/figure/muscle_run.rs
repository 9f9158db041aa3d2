//! Run of the muscle for Figures 5 and 6 and for a movie.

use anyhow::Context;
use myovib_dae::Problem;
use myovib_fem::Space;
use myovib_model::{MuscleDae, Probe, SampleTimes, Sampler, Statistics};
use myovib_scene::{Scene, run, statistics};
use serde_json::{Value, json};

use super::last_period::{LastPeriod, PER_PERIOD};
use crate::exit::Exit;
use crate::progress::Progress;
use crate::watched::run_watched;

/// Recorded values of the run.
pub(in crate::commands) struct MuscleRun {
    scene: Scene,
    pub(super) space: Space,
    pub(super) statistics: Statistics,
    /// Rows of t, u_x, u_y and p at the origin.
    pub(super) origin: Vec<[f64; 4]>,
    /// Displacement of every node.
    pub(super) last_period: LastPeriod<Vec<[f64; 2]>>,
}

impl MuscleRun {
    pub(in crate::commands) fn compute(scene: Scene, progress: &Progress) -> anyhow::Result<Self> {
        let mut integrator = run::muscle_alone(&scene)?;
        let muscle = integrator.problem().muscle();
        let period = 1.0 / muscle.forcing_frequency().context("the load has no period")?;
        let space = Space::clone(muscle.solid.space());
        let origin = Probe::at(&space, [0.0, 0.0])?;
        let unknowns = integrator.problem().n_unknowns();

        let (mut values, mut last_period) = (Vec::new(), LastPeriod::new(period));
        let times = SampleTimes::new(period / PER_PERIOD, scene.t_end);
        let mut sampler = Sampler::new(times, unknowns, |dae: &mut MuscleDae, t, y: &[f64]| {
            let value = dae.read(&origin, t, y);
            let [u_x, u_y, _] = value.displacement;
            values.push([t, u_x, u_y, value.pressure]);
            let (displacement, _) = dae.nodal_motion(t, y);
            let nodal = displacement.chunks_exact(2).map(|u| [u[0], u[1]]).collect();
            last_period.push(t, nodal);
            Ok(())
        });
        let end = ("muscle", scene.t_end);
        let statistics = run_watched(&mut *integrator, &mut sampler, end, progress)?;
        drop(sampler);
        Ok(Self { space, scene, statistics, origin: values, last_period })
    }

    /// Returns parameters, settings and statistics for the document of a figure.
    pub(super) fn document(&self) -> anyhow::Result<Value> {
        let body = self.scene.body.as_ref().context("the scene has no body")?;
        let mut document = statistics::of_body(&self.statistics, &body.settings, body.formulation);
        document["formulation"] = json!(body.formulation.name());
        document["beta"] = json!(body.muscle.parameters.beta);
        if let Some(solid) = &self.scene.file().solid {
            document["kappa"] = json!(solid.bulk_modulus);
        }
        Ok(document)
    }

    /// Returns the exit code. The plot of a run that stopped early ends at its last time.
    pub(in crate::commands) fn exit(&self) -> Exit {
        Exit::of(&self.statistics.outcome)
    }
}
