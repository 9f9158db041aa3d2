//! A motion over a time interval.

use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use myovib_model::{
    IdaIntegrator, Integrator, Limits, MuscleDae, Observer, Outcome, SampleTimes, StopReason, run,
};
use sundials_wrap::DaeProblem;

use super::checkpoint::{Checkpoint, Totals};
use super::document::{self, Timing};
use super::folder::Folder;
use super::outputs::{OutputWork, Outputs};
use super::recorder::{Recorder, What, quantities};
use super::stop::Condition;
use super::watch::Watch;
use super::{RunArgs, RunResult};
use crate::error::InputError;
use crate::exit::Exit;
use crate::scene::{Body, Scene};
use crate::vtu::Series;

/// Samples of the constraint drift over a run.
const DRIFT_SAMPLES: f64 = 100.0;
/// Checkpoints over a run that does not say how many.
const CHECKPOINTS: f64 = 10.0;

/// Computes the motion of a scene.
pub(super) fn compute(
    scene: &Scene,
    args: &RunArgs,
    interrupted: &AtomicBool,
) -> anyhow::Result<RunResult> {
    let started = Instant::now();
    let Some(body) = &scene.body else {
        return Err(InputError::new("the scene has no body to run").into());
    };
    let measurements = measurements(scene, body)?;
    let conditions = conditions(scene, body)?;
    let dae = MuscleDae::new(body.muscle.clone(), body.formulation)?;
    let n = dae.n_unknowns();
    let echo = serde_json::to_value(&scene.file)?;
    let checkpoint = if args.resume {
        Some(Checkpoint::read(&args.out, &echo)?)
    } else {
        None
    };
    let mut integrator = start(dae, body, checkpoint.as_ref())?;

    // Everything that could be wrong has been seen: from here on files are written.
    let folder = Folder::prepare(args)?;
    let mut outputs = Outputs {
        recorders: open(scene, measurements, &folder, checkpoint.as_ref())?,
        fields: fields(scene, &folder, checkpoint.as_ref()),
        conditions,
        checkpoints: Some(checkpoint_times(scene, checkpoint.as_ref())),
        drift_times: times(
            scene.t_end / DRIFT_SAMPLES,
            scene.t_end,
            checkpoint.as_ref(),
        ),
        drift: (0.0, 0.0),
        folder: &folder,
        scene: &echo,
        before: checkpoint
            .as_ref()
            .map_or(Totals::default(), |c| c.counts.resumed()),
        work: OutputWork::default(),
        seconds: Duration::ZERO,
        y: vec![0.0; n],
        y_dot: vec![0.0; n],
    };
    let setup = started.elapsed();
    let t_start = integrator.time();
    let mut limits = Limits::new(
        scene.file.integrator.max_cpu.unwrap_or(f64::INFINITY),
        Some(interrupted),
    );
    let mut watch = Watch::new(args.common.quiet, t_start, scene.t_end);
    let mut steps = StepLimit {
        most: scene.file.integrator.max_steps,
    };
    let mut observers: Vec<&mut dyn Observer<MuscleDae>> =
        vec![&mut outputs, &mut watch, &mut steps, &mut limits];
    let statistics = run(&mut integrator, &mut observers)?;
    drop(watch);
    if statistics.outcome.reason() == Some(StopReason::Interrupted) {
        outputs.checkpoint(&mut integrator)?;
    }

    let timing = Timing {
        setup: setup.as_secs_f64(),
        integration: statistics.wall_seconds - outputs.seconds.as_secs_f64(),
        output: outputs.seconds.as_secs_f64(),
    };
    let document = document::dynamic(scene, body, &integrator, &statistics, &outputs, &timing)?;
    document::write(&folder, &document)?;
    Ok(RunResult {
        document,
        exit: exit(&statistics.outcome),
    })
}

fn exit(outcome: &Outcome) -> Exit {
    match outcome.reason() {
        None | Some(StopReason::Event) => Exit::Done,
        Some(StopReason::Interrupted) => Exit::Interrupted,
        Some(_) => Exit::Stopped,
    }
}

/// What the probes measure, located in the mesh.
fn measurements(scene: &Scene, body: &Body) -> Result<Vec<What>, InputError> {
    let space = body.muscle.solid.space();
    let probes = scene.file.probe.iter().enumerate();
    let what = |(i, probe): (usize, &crate::scene_file::output::Probe)| {
        scene.at(&format!("probe[{i}]"), What::new(&probe.kind, space))
    };
    probes.map(what).collect()
}

fn conditions(scene: &Scene, body: &Body) -> Result<Vec<Condition>, InputError> {
    let space = body.muscle.solid.space();
    let stops = scene.file.stop.iter().enumerate();
    stops
        .map(|(i, stop)| scene.at(&format!("stop[{i}]"), Condition::new(stop, space)))
        .collect()
}

fn start(
    mut dae: MuscleDae,
    body: &Body,
    checkpoint: Option<&Checkpoint>,
) -> anyhow::Result<IdaIntegrator<MuscleDae>> {
    match checkpoint {
        Some(Checkpoint {
            t, y, y_dot, step, ..
        }) => {
            let settings = myovib_model::Settings {
                initial_step: Some(*step),
                ..body.settings.clone()
            };
            Ok(IdaIntegrator::starting_at(dae, &settings, *t, y, y_dot)?)
        }
        None => {
            refuse_sudden_loads(&mut dae)?;
            Ok(IdaIntegrator::from_rest(dae, &body.settings)?)
        }
    }
}

/// A run starts from rest without load, so that all values and derivatives are zero.
fn refuse_sudden_loads(dae: &mut MuscleDae) -> anyhow::Result<()> {
    let rest = vec![0.0; dae.n_unknowns()];
    let force = dae
        .unbalanced_force(0.0, &rest, &rest)
        .map_err(myovib_model::ModelError::from)?;
    let free = dae.muscle().solid.dofs().free_to_full();
    let largest = free.iter().map(|&i| force[i].abs()).fold(0.0, f64::max);
    if largest > 0.0 {
        return Err(InputError::new(
            "the loads do not start from zero, but the body starts at rest",
        )
        .found(format!("a nodal force of {largest:.3e} N/m at t = 0"))
        .next("let them rise: y = { type = \"step\", value = -9.81, rise = 0.1 }")
        .into());
    }
    Ok(())
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

fn checkpoint_times(scene: &Scene, checkpoint: Option<&Checkpoint>) -> SampleTimes {
    let every = scene
        .file
        .checkpoint
        .as_ref()
        .map_or(scene.t_end / CHECKPOINTS, |c| c.every);
    // The start is no checkpoint.
    let mut times = times(every, scene.t_end, checkpoint);
    if checkpoint.is_none() {
        times = times.skip(1);
    }
    times
}

/// Ends a run after a number of steps.
struct StepLimit {
    most: Option<u64>,
}

impl<P> Observer<P> for StepLimit {
    fn accepted(
        &mut self,
        step: &mut myovib_model::Step<'_, P>,
    ) -> Result<std::ops::ControlFlow<Outcome>, myovib_model::ModelError> {
        let steps = step.integrator.counts().steps;
        Ok(match self.most {
            Some(most) if steps >= most => std::ops::ControlFlow::Break(Outcome::Stopped {
                reason: StopReason::MaxSteps,
                message: format!("{steps} steps, as many as allowed; reached t = {}", step.to),
            }),
            _ => std::ops::ControlFlow::Continue(()),
        })
    }
}
