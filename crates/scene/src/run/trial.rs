//! Trial of a run: computation of the first steps without output.

use std::ops::{ControlFlow, Range};
use std::time::Duration;

use myovib_model::periodic::{PeriodMap, StartInterval};
use myovib_model::start::Consistent;
use myovib_model::{
    AcceptedStep, Advance, CpuClock, EndReason, Integrator, ModelError, Observer, Outcome,
};

use super::period::{Period, Task};
use super::start::{Driver, start};
use crate::system::System;
use crate::watch::Watcher;
use crate::{Error, Scene};

/// CPU time limit of a trial. A trial that exceeds this limit ends after its current step.
const PATIENCE: Duration = Duration::from_secs(1);

/// Result of the first steps of a run, or of all steps of a short run. The run itself takes identical steps because
/// probes and fields do not affect them.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    pub steps: u64,
    /// Time reached (s).
    pub t: f64,
    /// CPU time (s).
    pub seconds: f64,
    pub end: TrialEnd,
}

#[derive(Debug, Clone, PartialEq)]
pub enum TrialEnd {
    /// The CPU time for the trial is used up. The run itself would continue.
    Patience,
    /// The run would also end here, at its end time or after the maximum number of steps.
    Finished,
    /// The run would also stop here, because the integrator failed with this message.
    Stopped(String),
}

/// Computes the first steps of the motion of a scene. Stop conditions are ignored.
///
/// # Errors
/// Fails if the system cannot start or if the integrator encounters a fatal error.
pub fn try_out(scene: &Scene) -> Result<Trial, Error> {
    let most = scene.file.integrator.max_steps.unwrap_or(u64::MAX);
    start(scene, None, Watcher::NOBODY, Attempt { most })
}

struct Attempt {
    most: u64,
}

impl Driver for Attempt {
    type Result = Trial;

    fn drive<P: System>(self, mut integrator: Box<dyn Integrator<P>>) -> Result<Trial, Error> {
        let clock = CpuClock::start();
        let end = loop {
            match integrator.advance()? {
                Advance::Finished => break TrialEnd::Finished,
                Advance::Stopped { message, .. } => break TrialEnd::Stopped(message),
                Advance::Stepped if integrator.counts().steps >= self.most => {
                    break TrialEnd::Finished;
                }
                Advance::Stepped if clock.elapsed() > PATIENCE => break TrialEnd::Patience,
                Advance::Stepped => {}
            }
        };
        Ok(Trial {
            steps: integrator.counts().steps,
            t: integrator.time(),
            seconds: clock.elapsed().as_secs_f64(),
            end,
        })
    }
}

/// Result of a trial integration over one period from the initial state. The trial uses the tolerances of the search
/// for a periodic state.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct PeriodTrial {
    pub unknowns: usize,
    pub differential_variables: usize,
    /// Integrated fraction of the period, at most 1.
    pub part: f64,
    pub steps: u64,
    /// CPU time (s).
    pub seconds: f64,
    /// Error message if the integrator failed before the end of the period.
    pub stopped: Option<String>,
}

/// Integrates the system of a scene over one period until the CPU time limit is reached.
///
/// # Errors
/// Fails if the scene has no periodic state.
pub fn try_period(scene: &Scene) -> Result<PeriodTrial, Error> {
    let period = Period::of(scene)?;
    period.run(Some(Watcher::NOBODY), TryOut { times: period.times })
}

/// Task that integrates over a period between two times.
struct TryOut {
    times: [f64; 2],
}

/// Observer that records the progress of an integration and ends it when the CPU time limit is exceeded.
struct Progress {
    clock: CpuClock,
    steps: u64,
    t: f64,
}

impl<P> Observer<P> for Progress {
    fn accepted(
        &mut self,
        step: &mut AcceptedStep<'_, P>,
    ) -> Result<ControlFlow<Outcome>, ModelError> {
        (self.steps, self.t) = (step.integrator.counts().steps, step.to);
        Ok(match self.clock.elapsed() > PATIENCE {
            true => ControlFlow::Break(Outcome::ended(EndReason::Interrupted, String::new())),
            false => ControlFlow::Continue(()),
        })
    }
}

impl Task for TryOut {
    type Out = PeriodTrial;

    fn of_system<P: System + Consistent + Clone>(
        self,
        dae: P,
        start: impl StartInterval<P>,
        y: Vec<f64>,
        _: Vec<Range<usize>>,
    ) -> Result<PeriodTrial, Error> {
        let [from, to] = self.times;
        let mut map = PeriodMap::new(dae, start, self.times, &y)?;
        let state = map.restrict(&y);
        let mut progress = Progress { clock: CpuClock::start(), steps: 0, t: from };
        let stopped = match map.observed(&state, &mut [&mut progress]) {
            Ok(_) | Err(ModelError::Interrupted) => None,
            Err(error @ ModelError::PeriodStopped { .. }) => Some(error.to_string()),
            Err(error) => return Err(error.into()),
        };
        Ok(PeriodTrial {
            unknowns: map.n_unknowns(),
            differential_variables: map.differential().len(),
            part: ((progress.t - from) / (to - from)).min(1.0),
            steps: progress.steps,
            seconds: progress.clock.elapsed().as_secs_f64(),
            stopped,
        })
    }
}
