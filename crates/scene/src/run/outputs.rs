//! Outputs of a run in progress. The observer inspects each accepted step and writes only the
//! requested outputs.

use std::iter;
use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use myovib_model::{
    AcceptedStep, EndReason, EvaluationTimes, Integrator, ModelError, Observer, Outcome,
    SampleTimes, first_positive,
};

use super::checkpoint::{Checkpoint, OutputWork, Totals};
use super::indicator::Indicator;
use super::oscillations::Oscillations;
use super::recorder::{Recorder, cannot_write};
use super::stop::Condition;
use super::volume::Volumes;
use crate::system::{System, muscle_of, need_rates};
use serde_json::Value;

use crate::Error;
use crate::probe::{EnergyBalance, StateAt};
use crate::result_folder::ResultFolder;
use crate::state::State;
use crate::vtu::{NotFinite, Series};

/// Wall-clock time after which the next checkpoint is due. This time is longer if writing a checkpoint takes long.
pub(super) const CHECKPOINT_AFTER: Duration = Duration::from_secs(5);
/// Lower limit of the wall-clock time until the next checkpoint, as a multiple of the time needed to write the last
/// checkpoint. It limits the cost of these checkpoints to 2 % of the duration of a run.
const CHECKPOINT_COST: u32 = 50;

pub(super) struct Outputs<'a> {
    pub(super) recorders: Vec<Recorder>,
    pub(super) fields: Option<(Series, Oscillations, SampleTimes)>,
    pub(super) conditions: Vec<Condition>,
    pub(super) checkpoints: SampleTimes,
    /// Time of the last checkpoint in this part of the run (s).
    pub(super) checkpointed: Option<f64>,
    /// Wall-clock time of the last checkpoint, or of the start of the run.
    pub(super) last_checkpoint: Instant,
    pub(super) checkpoint_after: Duration,
    pub(super) drift_times: SampleTimes,
    /// Largest observed drift, and the time at which it occurred.
    pub(super) drift: (f64, f64),
    pub(super) volumes: Volumes,
    /// Whether the run continues if elements are inverted.
    pub(super) allows_inverted: bool,
    /// Error estimates of the integrator, accumulated for each probe.
    pub(super) indicator: Indicator,
    pub(super) folder: &'a ResultFolder,
    /// The scene and its input files.
    pub(super) origin: Value,
    /// Statistics of the parts of the run before the last resume.
    pub(super) before: Totals,
    pub(super) work: OutputWork,
    /// Wall-clock time of the outputs.
    pub(super) seconds: Duration,
    /// Times of the evaluations that the outputs requested, which are part of `seconds`.
    pub(super) times: EvaluationTimes,
    pub(super) y: Vec<f64>,
    pub(super) y_dot: Vec<f64>,
}

impl Outputs<'_> {
    /// Writes the outputs of a step. The order matters: a stop condition may shorten the step; rows and fields are
    /// written for the shortened step; and a checkpoint counts all of these rows and fields.
    fn observe<P: System>(
        &mut self,
        step: &mut AcceptedStep<'_, P>,
    ) -> Result<ControlFlow<Outcome>, ModelError> {
        let from = step.from;
        let integrator = &mut *step.integrator;
        self.indicator.add(integrator, &self.recorders, &mut self.y, &mut self.y_dot)?;
        let stopped = self.check_conditions(integrator, from, step.to)?;
        // If the run stops, the last rows and fields belong to the time at which it stops.
        let to = stopped.as_ref().map_or(step.to, |(t, _)| *t);
        step.to = to;
        for k in 0..self.recorders.len() {
            self.sample(k, integrator, from, to)?;
        }
        self.write_fields(integrator, from, to)?;
        let mut looked_at = None;
        while let Some(t) = self.drift_times.due(to) {
            let inside = t.clamp(from, to);
            integrator.dense_output(inside, 0, &mut self.y)?;
            let Some((dae, range)) = integrator.problem_mut().muscle_at(&self.y) else {
                continue;
            };
            let drift = dae.constraint_drift(inside, &self.y[range])?;
            if drift >= self.drift.0 {
                self.drift = (drift, t);
            }
            looked_at = Some(inside);
        }
        if let Some(t) = looked_at {
            let (dae, range) = muscle_of(integrator.problem_mut(), &self.y)?;
            let snapshot = dae.snapshot(t, &self.y[range.clone()], &[]);
            self.volumes.see(t, snapshot.solid, snapshot.displacement);
            self.volumes.see_contacts(t, dae, &self.y[range]);
        }
        if let Some((_, stopped)) = stopped {
            return Ok(ControlFlow::Break(stopped));
        }
        if !self.allows_inverted
            && let Some(refused) = self.volumes.refusal(true)
        {
            return Ok(ControlFlow::Break(refused));
        }
        let mut due = self.last_checkpoint.elapsed() >= self.checkpoint_after;
        while self.checkpoints.due(to).is_some() {
            due = true;
        }
        if due {
            self.checkpoint(integrator)?;
        }
        Ok(ControlFlow::Continue(()))
    }

    /// Writes all due rows of recorder `k`.
    fn sample<P: System>(
        &mut self,
        k: usize,
        integrator: &mut dyn Integrator<P>,
        from: f64,
        to: f64,
    ) -> Result<(), ModelError> {
        while let Some(t) = self.recorders[k].times.due(to) {
            let recorder = &mut self.recorders[k];
            let inside = t.clamp(from, to);
            if let Some(balance) = recorder.what.balance_mut() {
                balance.advance(integrator, from, inside)?;
            }
            integrator.dense_output(inside, 0, &mut self.y)?;
            if recorder.what.needs_rates(integrator.problem_mut(), &self.y) {
                integrator.dense_output(inside, 1, &mut self.y_dot)?;
            }
            let system = integrator.problem_mut();
            let at = StateAt { t: inside, y: &self.y, y_dot: &self.y_dot };
            let values = recorder.what.values(system, at)?;
            recorder.write(t, &values)?;
            self.work.probe_rows += 1;
            self.work.stress_evaluations += recorder.what.stress_evaluations();
        }
        if let Some(balance) = self.recorders[k].what.balance_mut() {
            balance.advance(integrator, from, to)?;
            self.work.energy_evaluations += 1;
        }
        Ok(())
    }

    fn write_fields<P: System>(
        &mut self,
        integrator: &mut dyn Integrator<P>,
        from: f64,
        to: f64,
    ) -> Result<(), ModelError> {
        let Some((series, oscillations, times)) = &mut self.fields else {
            return Ok(());
        };
        while let Some(t) = times.due(to) {
            let inside = t.clamp(from, to);
            integrator.dense_output(inside, 0, &mut self.y)?;
            if need_rates(series.quantities(), integrator.problem_mut(), &self.y) {
                integrator.dense_output(inside, 1, &mut self.y_dot)?;
            }
            let measured = oscillations.measure(integrator.problem(), &self.y)?;
            let (dae, range) = muscle_of(integrator.problem_mut(), &self.y)?;
            let snapshot = dae.snapshot(inside, &self.y[range.clone()], &self.y_dot[range]);
            self.volumes.see(t, snapshot.solid, snapshot.displacement);
            self.work.stress_evaluations += series
                .write(self.folder, t, &snapshot, &oscillations.cell_fields(&measured))
                .map_err(failed_output)?;
            oscillations.write(self.folder, t, &snapshot, &measured).map_err(failed_output)?;
            self.work.field_files += 1;
        }
        Ok(())
    }

    /// Returns the first time within the step at which a condition is met, and the resulting
    /// outcome.
    fn check_conditions<P: System>(
        &mut self,
        integrator: &mut dyn Integrator<P>,
        from: f64,
        to: f64,
    ) -> Result<Option<(f64, Outcome)>, ModelError> {
        let mut first: Option<(f64, Outcome)> = None;
        for condition in &self.conditions {
            let end = first.as_ref().map_or(to, |(t, _)| *t);
            let mut ends = match condition.reads_chain() {
                true => integrator.inner_ends(),
                false => Vec::new(),
            };
            ends.retain(|t| from < *t && *t < end);
            let starts: Vec<f64> = iter::once(from).chain(ends.iter().copied()).collect();
            ends.push(end);
            let mut met = None;
            for part in starts.into_iter().zip(ends) {
                met = first_positive(integrator, part.into(), &mut self.y, |system, t, y| {
                    condition.excess(system, t, y)
                })?;
                if met.is_some() {
                    break;
                }
            }
            if let Some(t) = met {
                let message = format!("at t = {t:.9} s, {}", condition.describe());
                first = Some((t, Outcome::ended(EndReason::Event, message)));
            }
        }
        Ok(first)
    }

    /// Returns the non-finite values in the fields.
    pub(super) fn not_finite(&self) -> Option<NotFinite> {
        let (series, ..) = self.fields.as_ref()?;
        series.not_finite()
    }

    /// Returns the last values of the first energy probe: kinetic energy, elastic energy, work, dissipated energy, and
    /// imbalance.
    pub(super) fn energy(&self) -> Option<[f64; 5]> {
        self.energy_balances().next().map(EnergyBalance::row)
    }

    /// Writes the current state as a checkpoint.
    pub(super) fn checkpoint<P: System>(
        &mut self,
        integrator: &mut dyn Integrator<P>,
    ) -> Result<(), ModelError> {
        let (t, started) = (integrator.time(), Instant::now());
        integrator.dense_output(t, 0, &mut self.y)?;
        integrator.dense_output(t, 1, &mut self.y_dot)?;
        self.work.checkpoints += 1;
        self.checkpointed = Some(t);
        // All data that the checkpoint counts must reach the disk before the checkpoint.
        for recorder in &self.recorders {
            recorder.sync()?;
        }
        let continuation = integrator.save();
        let checkpoint = Checkpoint {
            t,
            counts: match continuation {
                Some(_) => self.before,
                None => {
                    let chains = integrator.problem().chain_counts();
                    self.before.plus(integrator.counts(), chains)
                }
            },
            continuation,
            y: self.y.clone(),
            y_dot: self.y_dot.clone(),
            step: integrator.counts().last_step,
            tables: self.recorders.iter().map(|r| r.written().clone()).collect(),
            energies: self.energy_balances().cloned().collect(),
            field_times: self
                .fields
                .iter()
                .flat_map(|(series, ..)| series.listing.times())
                .collect(),
            drift: self.drift,
            volumes: self.volumes.clone(),
            not_finite: self.not_finite(),
            driven: integrator.problem().driven().cloned(),
            indicator: self.indicator.clone(),
            work: self.work,
            body_work: integrator.problem().counters(),
        };
        checkpoint.write(self.folder, &self.origin).map_err(failed_output)?;
        self.last_checkpoint = Instant::now();
        self.checkpoint_after = CHECKPOINT_AFTER.max(CHECKPOINT_COST * started.elapsed());
        Ok(())
    }

    /// Writes the final state at time `t`, from which other runs can start. `known` contains the unknowns at `t`, if
    /// available. `stopped_before` is the intended end time if the run stopped earlier.
    pub(super) fn state<P: System>(
        &mut self,
        integrator: &mut dyn Integrator<P>,
        t: f64,
        known: Option<&[f64]>,
        stopped_before: Option<f64>,
    ) -> Result<(), Error> {
        match known {
            Some(y) => self.y.copy_from_slice(y),
            None => integrator.dense_output(t, 0, &mut self.y)?,
        }
        match integrator.problem_mut().muscle_at(&self.y) {
            Some((dae, range)) => {
                let mut state = State::of(dae, t, &self.y[range]);
                state.stopped_before = stopped_before;
                self.folder.write(State::NAME, state.encode()?)
            }
            None => Ok(()),
        }
    }

    fn energy_balances(&self) -> impl Iterator<Item = &EnergyBalance> {
        self.recorders.iter().filter_map(|recorder| recorder.what.balance())
    }
}

impl<P: System> Observer<P> for Outputs<'_> {
    fn accepted(
        &mut self,
        step: &mut AcceptedStep<'_, P>,
    ) -> Result<ControlFlow<Outcome>, ModelError> {
        let times = |integrator: &dyn Integrator<P>| integrator.problem().counters().times;
        let (started, before) = (Instant::now(), times(step.integrator));
        let flow = self.observe(step);
        self.seconds += started.elapsed();
        self.times += times(step.integrator).since(&before);
        flow
    }
}

fn failed_output(error: Error) -> ModelError {
    match error {
        Error::File { path, source, .. } => cannot_write(&path, source),
        error => ModelError::Output(std::io::Error::other(error)),
    }
}
