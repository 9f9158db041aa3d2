//! Trial of a run: its first steps without output.

use std::time::Duration;

use myovib_model::{Advance, CpuClock, Integrator};

use super::start::{Driver, start};
use crate::system::System;
use crate::watch::Watcher;
use crate::{Error, Scene};

/// CPU time after which a trial ends at the end of its current step.
const PATIENCE: Duration = Duration::from_secs(1);

/// First steps of a run, or all steps of a short run. They equal the steps of the run itself, since
/// probes and fields do not change the steps.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// Number of steps.
    pub steps: u64,
    /// Time reached, s.
    pub t: f64,
    /// CPU time, s.
    pub seconds: f64,
    /// Reason for the end.
    pub end: TrialEnd,
}

/// Reason for the end of a [`Trial`].
#[derive(Debug, Clone, PartialEq)]
pub enum TrialEnd {
    /// The CPU time for the trial is used up. The run itself would continue.
    Patience,
    /// The run would end here too: at its last time, or after the maximum number of steps.
    Finished,
    /// The run would stop here too; the integrator failed with this message.
    Stopped(String),
}

/// Tries the motion of a scene. Stop conditions are ignored.
///
/// # Errors
/// A system that cannot start; fatal errors of the integrator.
pub fn try_out(scene: &Scene) -> Result<Trial, Error> {
    let most = scene.file.integrator.max_steps.unwrap_or(u64::MAX);
    start(scene, None, Watcher::NOBODY, Attempt { most })
}

/// Trial with a maximum number of steps.
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
