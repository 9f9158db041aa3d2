//! A motion over a time interval.

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use myovib_model::{
    Integrator, Limits, ModelError, Observer, Outcome, SampleTimes, Step, StopReason, run,
};
use serde_json::Value;

use super::checkpoint::{Checkpoint, Totals};
use super::document::{self, Timing};
use super::folder::Folder;
use super::outputs::{OutputWork, Outputs};
use super::recorder::{Recorder, What, quantities};
use super::stop::Condition;
use super::system::System;
use super::{Existing, RunOptions, RunResult, start};
use crate::InputError;
use crate::scene::Scene;
use crate::statistics::DRIFT_SAMPLES;
use crate::vtu::Series;
use crate::watch::Watch;

/// Checkpoints over a run that does not say how many.
const CHECKPOINTS: f64 = 10.0;

/// Computes the motion of a scene.
pub(super) fn compute(scene: &Scene, options: &RunOptions<'_>) -> anyhow::Result<RunResult> {
    let started = Instant::now();
    let echo = serde_json::to_value(&scene.file)?;
    let checkpoint = if options.existing == Existing::Resume {
        Some(Checkpoint::read(&options.out, &echo, scene.t_end)?)
    } else {
        None
    };
    let run = Motion {
        scene,
        options,
        checkpoint,
        echo,
        started,
    };
    match (&scene.body, &scene.rod) {
        (Some(body), _) if scene.chains.is_empty() => {
            let integrator = start::muscle(body, run.checkpoint.as_ref())?;
            run.drive(integrator)
        }
        (Some(body), _) if !scene.feedbacks.is_empty() => {
            let integrator = start::muscle_with_feedback(scene, body, run.checkpoint.as_ref())?;
            run.drive(integrator)
        }
        (Some(body), _) => {
            let integrator = start::muscle_and_chains(scene, body, run.checkpoint.as_ref())?;
            run.drive(integrator)
        }
        (None, Some(rod)) => {
            let integrator = start::rod(scene, rod, run.checkpoint.as_ref())?;
            run.drive(integrator)
        }
        (None, None) => {
            let integrator = start::chains(scene, run.checkpoint.as_ref())?;
            run.drive(integrator)
        }
    }
}

/// A run and what it is to write.
struct Motion<'a> {
    scene: &'a Scene,
    options: &'a RunOptions<'a>,
    checkpoint: Option<Checkpoint>,
    echo: Value,
    started: Instant,
}

impl Motion<'_> {
    fn drive<P: System>(
        &self,
        mut integrator: Box<dyn Integrator<P>>,
    ) -> anyhow::Result<RunResult> {
        let Self { scene, options, .. } = self;
        let checkpoint = self.checkpoint.as_ref();
        let measurements = measurements(scene)?;
        let conditions = conditions(scene)?;

        // Everything that could be wrong has been seen: from here on files are written.
        let folder = Folder::prepare(options)?;
        let n = integrator.problem().n_unknowns();
        let mut outputs = Outputs {
            recorders: open(scene, measurements, &folder, checkpoint)?,
            fields: fields(scene, &folder, checkpoint),
            conditions,
            checkpoints: checkpoint_times(scene, checkpoint),
            drift_times: times(scene.t_end / DRIFT_SAMPLES, scene.t_end, checkpoint),
            drift: (0.0, 0.0),
            folder: &folder,
            scene: &self.echo,
            before: checkpoint.map_or(Totals::default(), |c| c.counts.resumed()),
            work: OutputWork::default(),
            seconds: Duration::ZERO,
            y: vec![0.0; n],
            y_dot: vec![0.0; n],
        };
        let setup = self.started.elapsed();
        let most_cpu = scene.file.integrator.max_cpu.unwrap_or(f64::INFINITY);
        let mut limits = Limits::new(most_cpu, options.interrupt);
        let mut watch = Watch::new("run".into(), scene.t_end, options.progress);
        let mut steps = StepLimit {
            most: scene.file.integrator.max_steps,
        };
        let mut observers: Vec<&mut dyn Observer<P>> =
            vec![&mut outputs, &mut watch, &mut steps, &mut limits];
        let statistics = run(&mut *integrator, &mut observers)?;
        if statistics.outcome.reason() == Some(StopReason::Interrupted) {
            outputs.checkpoint(&mut *integrator)?;
        }
        let timing = Timing {
            setup: setup.as_secs_f64(),
            integration: statistics.wall_seconds - outputs.seconds.as_secs_f64(),
            output: outputs.seconds.as_secs_f64(),
        };
        let document = document::dynamic(scene, &*integrator, &statistics, &outputs, &timing)?;
        document::write(&folder, &document)?;
        Ok(RunResult {
            document,
            outcome: statistics.outcome,
        })
    }
}

/// What the probes measure, located in the mesh.
fn measurements(scene: &Scene) -> Result<Vec<What>, InputError> {
    let probes = scene.file.probe.iter().enumerate();
    probes
        .map(|(i, probe)| scene.at(&format!("probe[{i}]"), What::new(&probe.kind, scene)))
        .collect()
}

fn conditions(scene: &Scene) -> Result<Vec<Condition>, InputError> {
    let stops = scene.file.stop.iter().enumerate();
    stops
        .map(|(i, stop)| scene.at(&format!("stop[{i}]"), Condition::new(stop, scene)))
        .collect()
}

fn open(
    scene: &Scene,
    measurements: Vec<What>,
    folder: &Folder,
    checkpoint: Option<&Checkpoint>,
) -> anyhow::Result<Vec<Recorder>> {
    let mut energies = checkpoint
        .map(|c| c.energies.iter().copied())
        .into_iter()
        .flatten();
    let probes = scene.file.probe.iter().zip(measurements);
    probes
        .map(|(probe, mut what)| {
            if let (What::Energy(balance), Some(checkpoint)) = (&mut what, checkpoint) {
                balance.restore(checkpoint.t, energies.next().unwrap_or_default());
            }
            let resume_at = checkpoint.map(|c| c.t);
            Recorder::open(probe, what, scene.t_end, folder.path(), resume_at)
        })
        .collect()
}

fn fields(
    scene: &Scene,
    folder: &Folder,
    checkpoint: Option<&Checkpoint>,
) -> Option<(Series, SampleTimes)> {
    let fields = scene.file.fields.as_ref()?;
    let done = checkpoint.map_or(&[][..], |c| &c.field_times);
    let series = Series::new(folder.path(), quantities(&fields.quantities), done);
    let times = SampleTimes::new(fields.every, scene.t_end).skip(done.len() as u64);
    Some((series, times))
}

/// Times `every` apart; those before a checkpoint are over.
fn times(every: f64, t_end: f64, checkpoint: Option<&Checkpoint>) -> SampleTimes {
    let mut times = SampleTimes::new(every, t_end);
    if let Some(checkpoint) = checkpoint {
        while times.due(checkpoint.t).is_some() {}
    }
    times
}

/// Times of checkpoints; the start is none.
fn checkpoint_times(scene: &Scene, checkpoint: Option<&Checkpoint>) -> SampleTimes {
    let every = scene
        .file
        .checkpoint
        .as_ref()
        .map_or(scene.t_end / CHECKPOINTS, |c| c.every);
    let times = times(every, scene.t_end, checkpoint);
    if checkpoint.is_none() {
        times.skip(1)
    } else {
        times
    }
}

/// Ends a run after a number of steps.
struct StepLimit {
    most: Option<u64>,
}

impl<P> Observer<P> for StepLimit {
    fn accepted(&mut self, step: &mut Step<'_, P>) -> Result<ControlFlow<Outcome>, ModelError> {
        let steps = step.integrator.counts().steps;
        Ok(match self.most {
            Some(most) if steps >= most => ControlFlow::Break(Outcome::ended(
                StopReason::MaxSteps,
                format!("{steps} steps, as many as allowed; reached t = {}", step.to),
            )),
            _ => ControlFlow::Continue(()),
        })
    }
}
