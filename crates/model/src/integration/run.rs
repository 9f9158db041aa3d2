//! Run driver: steps an integrator to its end and calls observers after each accepted step.

use std::ops::ControlFlow;
use std::time::Instant;

use crate::cpu::CpuClock;
use crate::error::ModelError;
use crate::integration::integrator::{Advance, Integrator};
use crate::integration::statistics::{EndReason, Outcome, Statistics};

/// An accepted step with its dense output.
pub struct AcceptedStep<'a, P> {
    /// Time before the step, s.
    pub from: f64,
    /// Time after the step, s. An observer that ends the run within the step sets this field to the end of the run.
    pub to: f64,
    /// The integrator, for dense output, counts and the problem.
    pub integrator: &'a mut dyn Integrator<P>,
}

/// Observes a run through dense output. Observers never alter the steps.
pub trait Observer<P> {
    /// Called after each accepted step; may end the run.
    ///
    /// # Errors
    /// An error of the observer ends the run.
    fn accepted(
        &mut self,
        step: &mut AcceptedStep<'_, P>,
    ) -> Result<ControlFlow<Outcome>, ModelError>;
}

/// Runs `integrator` to its end time and calls all `observers` after each accepted step.
///
/// If the integrator gives up, the result is an [`Outcome`] with statistics, not an error.
///
/// # Errors
/// Returns fatal errors of the problem, errors due to misuse of the integrator, and errors of observers.
pub fn run<P>(
    integrator: &mut dyn Integrator<P>,
    observers: &mut [&mut dyn Observer<P>],
) -> Result<Statistics, ModelError> {
    let (cpu, wall) = (CpuClock::start(), Instant::now());
    let (t_reached, outcome) = integrate(integrator, observers)?;
    Ok(Statistics {
        counts: integrator.counts(),
        t_reached,
        outcome,
        cpu_seconds: cpu.elapsed().as_secs_f64(),
        wall_seconds: wall.elapsed().as_secs_f64(),
    })
}

fn integrate<P>(
    integrator: &mut dyn Integrator<P>,
    observers: &mut [&mut dyn Observer<P>],
) -> Result<(f64, Outcome), ModelError> {
    loop {
        integrator.pass_jump()?;
        let from = integrator.time();
        let advance = integrator.advance()?;
        if let Advance::Stopped { reason, message, inverted } = advance {
            let stopped = Outcome::Stopped { reason, message, inverted };
            return Ok((integrator.time(), stopped));
        }
        let to = integrator.time();
        for observer in observers.iter_mut() {
            let mut step = AcceptedStep { from, to, integrator: &mut *integrator };
            if let ControlFlow::Break(outcome) = observer.accepted(&mut step)? {
                // A limit reached in the last step does not truncate the run.
                let is_limit =
                    matches!(outcome.reason(), Some(EndReason::Interrupted | EndReason::WorkCap));
                if is_limit && advance == Advance::Finished {
                    continue;
                }
                return Ok((step.to, outcome));
            }
        }
        if advance == Advance::Finished {
            return Ok((to, Outcome::Finished));
        }
    }
}

/// Ends a run that takes too long or is interrupted from outside.
pub struct Limits<'a> {
    /// CPU time allowed, s.
    pub cpu_seconds: f64,
    /// Flag set from outside to interrupt the run.
    pub interrupted: Option<&'a std::sync::atomic::AtomicBool>,
    started: CpuClock,
}

impl<'a> Limits<'a> {
    /// Creates limits that start counting now.
    pub fn new(cpu_seconds: f64, interrupted: Option<&'a std::sync::atomic::AtomicBool>) -> Self {
        Self { cpu_seconds, interrupted, started: CpuClock::start() }
    }
}

impl<P> Observer<P> for Limits<'_> {
    fn accepted(
        &mut self,
        step: &mut AcceptedStep<'_, P>,
    ) -> Result<ControlFlow<Outcome>, ModelError> {
        let stop = |reason, message| Ok(ControlFlow::Break(Outcome::ended(reason, message)));
        if self.interrupted.is_some_and(|flag| flag.load(std::sync::atomic::Ordering::Relaxed)) {
            return stop(EndReason::Interrupted, format!("interrupted at t = {:.6} s", step.to));
        }
        let used = self.started.elapsed().as_secs_f64();
        if used > self.cpu_seconds {
            let message = format!(
                "exceeded the CPU time limit ({used:.1} s of {} s) at t = {}",
                self.cpu_seconds, step.to
            );
            return stop(EndReason::WorkCap, message);
        }
        Ok(ControlFlow::Continue(()))
    }
}
