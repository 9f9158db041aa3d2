//! Dynamic analysis over a time interval.

use std::mem;
use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use myovib_model::{
    AcceptedStep, Counts, EndReason, EvaluationTimes, Integrator, Limits, ModelError, Observer,
    Outcome, SampleTimes, Statistics, run,
};

use super::checkpoint::{Checkpoint, OutputWork, Totals, expect_incomplete};
use super::document::{self, Timing};
use super::driving::DrivingError;
use super::folder::{
    AT_THE_END, expect_same_run, parameter, request, was_killed_before_first_checkpoint,
};
use super::indicator::Indicator;
use super::options::{RunOptions, RunResult};
use super::oscillations::Oscillations;
use super::outputs::{CHECKPOINT_AFTER, Outputs};
use super::recorder::Recorder;
use super::start::{Driver, start};
use super::stop::Condition;
use super::verify::error_estimate;
use super::volume::Volumes;
use crate::modes::ENERGY_GAIN;
use crate::probe::Reading;
use crate::result_folder::Existing;
use crate::result_folder::{FolderRequest, ResultFolder};
use crate::scene::{DrivenChain, Scene};
use crate::statistics::DRIFT_SAMPLES;
use crate::system::System;
use crate::vtu::{self, Grid, Series};
use crate::watch::Watch;
use crate::{Error, InputError};
use serde_json::Value;

/// Default number of checkpoints per run.
const CHECKPOINTS: f64 = 10.0;

pub(super) fn compute(scene: &Scene, options: &RunOptions<'_>) -> Result<RunResult, Error> {
    let started = Instant::now();
    // The outputs are checked before the folder is changed.
    let readings = scene.readings()?;
    let conditions = conditions(scene)?;
    let mut request = request(scene, options, &lists_of_fields(scene))?;
    request.check()?;
    let is_resumed = options.existing == Existing::Resume;
    if is_resumed {
        expect_same_run(&request)?;
        expect_incomplete(&options.out, scene, options.verify)?;
    }
    let has_checkpoint = is_resumed && !was_killed_before_first_checkpoint(&options.out);
    if is_resumed && !has_checkpoint {
        request.existing = Existing::Overwrite;
    }
    // A resumed run already has a folder. The folder is locked during the initialization because another process may
    // use it. A new run is initialized before its folder is created.
    let folder = match is_resumed {
        true => Some(request.clone().open()?),
        false => None,
    };
    let checkpoint = match &folder {
        Some(folder) if has_checkpoint => {
            let origin = &request.origin;
            Some(Checkpoint::read(folder, scene, &readings, origin)?)
        }
        _ => None,
    };
    let from = checkpoint.as_ref();
    let run =
        Motion { scene, options, request, folder, checkpoint: from, readings, conditions, started };
    start(scene, from, options.watcher(), run)
}

/// Run and its outputs.
struct Motion<'a> {
    scene: &'a Scene,
    options: &'a RunOptions<'a>,
    request: FolderRequest<'a>,
    folder: Option<ResultFolder>,
    checkpoint: Option<&'a Checkpoint>,
    readings: Vec<Box<dyn Reading>>,
    conditions: Vec<Condition>,
    started: Instant,
}

impl Motion<'_> {
    /// Opens the outputs in `folder`. Also returns notes on rows that were removed from the tables of a resumed run.
    fn outputs<'f>(
        &mut self,
        folder: &'f ResultFolder,
        n_unknowns: usize,
    ) -> Result<(Outputs<'f>, Vec<String>), Error> {
        let (scene, checkpoint) = (self.scene, self.checkpoint);
        let (recorders, notes) = open(scene, mem::take(&mut self.readings), folder, checkpoint)?;
        let outputs = Outputs {
            recorders,
            fields: fields(scene, folder, checkpoint)?,
            origin: self.request.origin.clone(),
            conditions: mem::take(&mut self.conditions),
            checkpoints: checkpoint_times(scene, checkpoint),
            checkpointed: None,
            last_checkpoint: Instant::now(),
            checkpoint_after: CHECKPOINT_AFTER,
            drift_times: times(scene.t_end / DRIFT_SAMPLES, scene.t_end, checkpoint),
            drift: checkpoint.map_or((0.0, 0.0), |c| c.drift),
            volumes: checkpoint.map_or(Volumes::default(), |c| c.volumes.clone()),
            allows_inverted: scene.allows_inverted(),
            indicator: checkpoint.map_or(Indicator::default(), |c| c.indicator.clone()),
            folder,
            before: checkpoint.map_or(Totals::default(), |c| c.counts.resumed()),
            work: checkpoint.map_or(OutputWork::default(), |c| c.work),
            seconds: Duration::ZERO,
            times: EvaluationTimes::default(),
            y: vec![0.0; n_unknowns],
            y_dot: vec![0.0; n_unknowns],
        };
        Ok((outputs, notes))
    }

    /// Integrates until the run reaches its end time, a limit, or a stop condition of the scene.
    fn integrate<P: System>(
        &self,
        integrator: &mut dyn Integrator<P>,
        outputs: &mut Outputs<'_>,
    ) -> Result<Statistics, Error> {
        let Self { scene, options, .. } = self;
        let settings = &scene.file.integrator;
        let most_cpu = settings.max_cpu.unwrap_or(f64::INFINITY);
        let mut limits = Limits::new(most_cpu, options.interrupt);
        let mut watch = Watch::new("run".into(), scene.t_end, options.progress);
        let mut steps = StepLimit { most: settings.max_steps, t_end: scene.t_end };
        let mut observers: Vec<&mut dyn Observer<P>> =
            vec![outputs, &mut watch, &mut steps, &mut limits];
        Ok(run(integrator, &mut observers)?)
    }

    /// If requested, adds the error estimate to the document of a finished run. Returns false if the estimation was
    /// interrupted.
    fn verify(&self, folder: &ResultFolder, document: &mut Value) -> Result<bool, Error> {
        if !self.options.verify {
            return Ok(true);
        }
        let estimate = error_estimate(self.scene, self.options)?;
        let is_whole = estimate.is_some();
        if let Some(estimate) = estimate {
            document["error_estimate"] = estimate;
            document::write(folder, document)?;
        }
        Ok(is_whole)
    }
}

impl Driver for Motion<'_> {
    type Result = RunResult;

    fn drive<P: System>(
        mut self,
        mut integrator: Box<dyn Integrator<P>>,
    ) -> Result<RunResult, Error> {
        let (scene, checkpoint) = (self.scene, self.checkpoint);
        if let Some(checkpoint) = checkpoint {
            restore(&mut *integrator, checkpoint)?;
        }
        // All input has been checked. Files are written from here on.
        let folder = match self.folder.take() {
            Some(folder) => folder,
            None => {
                let opened = self.request.clone().open();
                opened.map_err(Error::before_any_output)?
            }
        };
        let n_unknowns = integrator.problem().state_len();
        let (mut outputs, of_resumption) = self.outputs(&folder, n_unknowns)?;
        if checkpoint.is_some() {
            for name in AT_THE_END {
                folder.remove(name)?; // these files describe the earlier end of the run
            }
        }
        let setup = self.started.elapsed();
        let before = integrator.problem().counters().times;
        // If a run was killed after the checkpoint at its end, only the files written at the end are missing.
        let at_the_end = checkpoint.filter(|c| c.t >= scene.t_end);
        let statistics = match at_the_end {
            Some(checkpoint) => ended_at(checkpoint.t, integrator.counts()),
            None => self.integrate(&mut *integrator, &mut outputs)?,
        };
        let ended = statistics.outcome == Outcome::Finished; // a finished run may be resumed with a later end time
        let interrupted = statistics.outcome.reason() == Some(EndReason::Interrupted);
        let is_written = outputs.checkpointed == Some(integrator.time()) || at_the_end.is_some();
        if interrupted || (ended && !is_written) {
            outputs.checkpoint(&mut *integrator)?;
        }
        let state = at_the_end.map(|c| &c.y[..]);
        let is_whole = ended || statistics.outcome.reason() == Some(EndReason::Event);
        let stopped_before = (!is_whole).then_some(scene.t_end);
        outputs.state(&mut *integrator, statistics.t_reached, state, stopped_before)?;
        let evaluations = integrator.problem().counters().times.since(&before);
        let timing = Timing {
            setup,
            evaluations: evaluations.since(&outputs.times),
            integration: Duration::from_secs_f64(statistics.wall_seconds),
            output: outputs.seconds,
        };
        let driving = DrivingError::all(scene, integrator.problem());
        let mut document = document::dynamic(scene, &*integrator, &statistics, &outputs, &timing)?;
        if !driving.is_empty() {
            document["driving_error"] = serde_json::to_value(&driving)?;
        }
        let body = scene.body.as_ref();
        let mut notes = Vec::new();
        // If a run ended because of an inversion, its message already describes the inversion.
        if let Some(body) =
            body.filter(|_| statistics.outcome.reason() != Some(EndReason::Inverted))
        {
            notes.extend(outputs.volumes.note(&body.muscle, true));
        }
        notes.extend(outputs.volumes.penetration_note());
        notes.extend(outputs.energy().and_then(gained_energy));
        notes.extend(outputs.not_finite().map(|seen| seen.note()));
        notes.extend(driving.iter().filter_map(|error| error.note(scene)));
        let outcome = statistics.outcome;
        let mut result = document::finish(&folder, scene, document, outcome, notes)?;
        if ended && !self.verify(&folder, &mut result.document)? {
            let message = "--verify was interrupted and measured no error; use --resume --verify to measure it";
            result.notes.push(message.to_owned());
            result.outcome = Outcome::ended(EndReason::Interrupted, message.to_owned());
        }
        // These notes are not added to the document, so that a resumed run and an uninterrupted run have identical
        // documents.
        result.notes.splice(0..0, of_resumption);
        Ok(result)
    }
}

fn restore<P: System>(
    integrator: &mut dyn Integrator<P>,
    checkpoint: &Checkpoint,
) -> Result<(), Error> {
    if let Some(continuation) = &checkpoint.continuation {
        let restored = integrator.restore(continuation);
        restored.map_err(|error| Error::before_any_output(error.into()))?;
    }
    let system = integrator.problem_mut();
    if let Some((dae, _)) = system.muscle_at(&checkpoint.y) {
        dae.set_counters(checkpoint.body_work);
    }
    if let Some(driven) = &checkpoint.driven
        && !system.set_driven(driven)
    {
        let error = InputError::new("the checkpoint belongs to other chains of oscillators");
        return Err(error.next("--overwrite computes the run from the start").into());
    }
    Ok(())
}

/// Returns the statistics of a run that had already reached its end before it was resumed.
fn ended_at(t: f64, counts: Counts) -> Statistics {
    Statistics {
        counts,
        t_reached: t,
        outcome: Outcome::Finished,
        cpu_seconds: 0.0,
        wall_seconds: 0.0,
    }
}

pub(super) fn conditions(scene: &Scene) -> Result<Vec<Condition>, InputError> {
    let stops = scene.file.stop.iter().enumerate();
    stops.map(|(i, stop)| scene.at(&format!("stop[{i}]"), Condition::new(stop, scene))).collect()
}

/// Opens the tables of the probes. Also returns notes on rows that were removed from the tables of a resumed run.
fn open(
    scene: &Scene,
    readings: Vec<Box<dyn Reading>>,
    folder: &ResultFolder,
    checkpoint: Option<&Checkpoint>,
) -> Result<(Vec<Recorder>, Vec<String>), Error> {
    let (path, t_end) = (folder.path(), scene.t_end);
    let probes = scene.file.probe.iter().zip(readings);
    let Some(checkpoint) = checkpoint else {
        let parameter = parameter(&scene.file);
        let recorders =
            probes.map(|(probe, what)| Recorder::new(probe, what, t_end, parameter, folder));
        return Ok((recorders.collect::<Result<_, _>>()?, Vec::new()));
    };
    let (mut recorders, mut notes) = (Vec::new(), Vec::new());
    let mut energies = checkpoint.energies.iter();
    for ((probe, mut what), written) in probes.zip(&checkpoint.tables) {
        if let Some(balance) = what.balance_mut() {
            *balance = energies.next().cloned().unwrap_or_default();
        }
        let (recorder, note) = Recorder::resumed(probe, what, t_end, path, written)?;
        recorders.push(recorder);
        notes.extend(note);
    }
    Ok((recorders, notes))
}

/// Returns the names of the files that list the field files of a run.
fn lists_of_fields(scene: &Scene) -> Vec<&'static str> {
    let has_fields = scene.file.fields.is_some() && scene.body.is_some();
    let has_points = scene.chains.iter().any(DrivenChain::is_at_many_points);
    let lists = [(has_fields, vtu::LIST), (has_fields && has_points, vtu::PLACES_LIST)];
    lists.into_iter().filter(|(is_written, _)| *is_written).map(|(_, list)| list).collect()
}

fn fields(
    scene: &Scene,
    folder: &ResultFolder,
    checkpoint: Option<&Checkpoint>,
) -> Result<Option<(Series, Oscillations, SampleTimes)>, Error> {
    let (Some(fields), Some(body)) = (scene.file.fields.as_ref(), scene.body.as_ref()) else {
        return Ok(None);
    };
    let done = checkpoint.map_or(&[][..], |c| &c.field_times);
    let grid = Grid::of_body(body);
    let series = Series::new(grid, fields.quantities.clone(), done)
        .with_seen(checkpoint.and_then(|c| c.not_finite));
    let oscillations = Oscillations::new(scene, done);
    let places = oscillations.cloud.iter().map(|cloud| &cloud.listing);
    let mut listings = std::iter::once(&series.listing).chain(places);
    if let Some(file) = listings.find_map(|listing| listing.missing(folder.path())) {
        let error = InputError::new("a file that the checkpoint requires is missing")
            .at(file.display())
            .next("--overwrite computes the run from the start");
        return Err(error.into());
    }
    let times = SampleTimes::new(fields.interval, scene.t_end).skip(done.len() as u64);
    Ok(Some((series, oscillations, times)))
}

/// Returns sample times with the interval `every`. If there is a checkpoint, the sample times begin after it.
fn times(every: f64, t_end: f64, checkpoint: Option<&Checkpoint>) -> SampleTimes {
    let mut times = SampleTimes::new(every, t_end);
    if let Some(checkpoint) = checkpoint {
        while times.due(checkpoint.t).is_some() {}
    }
    times
}

/// Returns the times at which checkpoints are due, excluding the start of the run.
fn checkpoint_times(scene: &Scene, checkpoint: Option<&Checkpoint>) -> SampleTimes {
    let every = scene.file.checkpoint.as_ref().map_or(scene.t_end / CHECKPOINTS, |c| c.interval);
    let times = times(every, scene.t_end, checkpoint);
    if checkpoint.is_none() { times.skip(1) } else { times }
}

/// Observer that ends a run after a maximum number of steps.
struct StepLimit {
    most: Option<u64>,
    t_end: f64,
}

impl<P> Observer<P> for StepLimit {
    fn accepted(
        &mut self,
        step: &mut AcceptedStep<'_, P>,
    ) -> Result<ControlFlow<Outcome>, ModelError> {
        let steps = step.integrator.counts().steps;
        Ok(match self.most {
            Some(most) if steps >= most && step.to < self.t_end => {
                ControlFlow::Break(Outcome::ended(
                    EndReason::MaxSteps,
                    format!("the limit of {steps} steps was reached at t = {}", step.to),
                ))
            }
            _ => ControlFlow::Continue(()),
        })
    }
}

/// Smallest reported energy gain due to damping, relative to the largest energy. Errors of the time integration are
/// smaller.
const GAINED: f64 = 0.1;

/// Returns a note if damping has increased the energy. The arguments are the kinetic and elastic energies, the work,
/// the dissipated energy, and the imbalance.
fn gained_energy([kinetic, elastic, work, dissipated, _]: [f64; 5]) -> Option<String> {
    let largest = work.abs().max(kinetic + elastic);
    (dissipated < -GAINED * largest).then(|| {
        format!("damping has added energy, `dissipated` = {dissipated:.2e}; {ENERGY_GAIN}")
    })
}

#[cfg(test)]
mod tests {
    use super::gained_energy;

    #[test]
    fn energy_from_damping_is_noted_above_errors_in_time() {
        assert!(gained_energy([1.0, 2.0, 0.5, -0.5, 0.0]).is_some());
        // The error of Radau IIA with its default tolerance is 1e-3.
        assert!(gained_energy([1.0, 2.0, 3.0, -1e-2, 0.0]).is_none());
        assert!(gained_energy([0.0, 0.0, 3.0, 3.0, 0.0]).is_none());
        assert!(gained_energy([0.0; 5]).is_none());
    }
}
