//! A run is tried before it.

use std::time::Duration;

use myovib_model::{Advance, CpuClock, Integrator};

use super::start::{Driver, start};
use super::system::System;
use crate::watch::Watcher;
use crate::{Error, Scene};

/// CPU time after which a trial ends with its step.
const PATIENCE: Duration = Duration::from_secs(1);

/// The first steps of a run, to its end if it is short: the steps that the run takes itself, as probes and fields
/// change none.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// Steps.
    pub steps: u64,
    /// The time reached, s.
    pub t: f64,
    /// CPU time, s.
    pub seconds: f64,
    /// How it ended.
    pub end: TrialEnd,
}

/// How a [`Trial`] ended.
#[derive(Debug, Clone, PartialEq)]
pub enum TrialEnd {
    /// It took long enough: the run goes on.
    Patience,
    /// As the run does: at its last time, or after as many steps as are allowed.
    Finished,
    /// As the run does: the integrator gave up, with these words.
    Stopped(String),
}

/// Tries the motion of a scene, whose conditions to stop are not looked at.
///
/// # Errors
/// What cannot start; fatal errors of the integrator.
pub fn try_out(scene: &Scene) -> Result<Trial, Error> {
    let most = scene.file.integrator.max_steps.unwrap_or(u64::MAX);
    start(scene, None, Watcher::NOBODY, Attempt { most })
}

/// A trial of so many steps at most.
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
