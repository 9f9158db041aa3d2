//! Integrators that say what to do when they stop.

use super::{Advice, listed};
use crate::counters::WorkCounters;
use crate::error::ModelError;
use crate::integration::integrator::{Advance, Integrator};
use crate::integration::statistics::{Counts, StopReason};

/// An integrator that gives advice when it stops.
pub struct Advised<P> {
    inner: Box<dyn Integrator<P>>,
    advice: Advice,
    work: fn(&P) -> WorkCounters,
}

impl<P> Advised<P> {
    /// Adds `advice` to the message of `inner`; `work` is that of its problem's muscle.
    pub fn new(
        inner: Box<dyn Integrator<P>>,
        advice: Advice,
        work: fn(&P) -> WorkCounters,
    ) -> Self {
        Self {
            inner,
            advice,
            work,
        }
    }
}

impl<P> Integrator<P> for Advised<P> {
    fn advance(&mut self) -> Result<Advance, ModelError> {
        let inversions = (self.work)(self.inner.problem()).inversions;
        let advance = self.inner.advance()?;
        let Advance::Stopped {
            reason, message, ..
        } = advance
        else {
            return Ok(advance);
        };
        let work = (self.work)(self.inner.problem());
        // The error test is of a state that could be evaluated: what was inverted before was not, then.
        let refused = work.inversions > inversions && reason != StopReason::ErrorTestFailures;
        let inverted = work.inverted.filter(|_| refused);
        let message = match inverted {
            Some(at) => message + &listed(&self.advice.causes_of_inversion(at)),
            None => format!("{message}. {}", self.advice),
        };
        Ok(Advance::Stopped {
            reason,
            message,
            inverted,
        })
    }

    fn time(&self) -> f64 {
        self.inner.time()
    }

    fn dense_output(&mut self, t: f64, derivative: u32, out: &mut [f64]) -> Result<(), ModelError> {
        self.inner.dense_output(t, derivative, out)
    }

    fn counts(&self) -> Counts {
        self.inner.counts()
    }

    fn problem(&self) -> &P {
        self.inner.problem()
    }

    fn problem_mut(&mut self) -> &mut P {
        self.inner.problem_mut()
    }
}
