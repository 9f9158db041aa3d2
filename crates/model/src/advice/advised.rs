//! Integrators that add advice to their message when they stop.

use myovib_dae::Problem;

use super::{Advice, listed};
use crate::counters::WorkCounters;
use crate::coupling::{CoupledDae, FeedbackDae};
use crate::error::ModelError;
use crate::integration::integrator::{Advance, Continuation, Integrator, forward_to_inner};
use crate::integration::statistics::EndReason;
use crate::muscle_dae::MuscleDae;

/// A system that contains a muscle.
pub trait WithMuscle {
    /// Returns the number of unknowns of the system.
    fn unknowns(&self) -> usize;

    /// Returns the work counters of the muscle.
    fn work(&self) -> WorkCounters;

    /// Returns the smallest det F of the muscle at time `t` for the unknowns `y` of the system, and the element in
    /// which it occurs.
    fn least_volume_ratio(&mut self, t: f64, y: &[f64]) -> (f64, usize);
}

impl WithMuscle for MuscleDae {
    fn unknowns(&self) -> usize {
        self.n_unknowns()
    }

    fn work(&self) -> WorkCounters {
        *self.counters()
    }

    fn least_volume_ratio(&mut self, t: f64, y: &[f64]) -> (f64, usize) {
        let body = self.snapshot(t, y, &[]);
        let ratios = body.solid.volume_ratios(body.displacement);
        (ratios.smallest, ratios.at.element)
    }
}

impl WithMuscle for CoupledDae<MuscleDae> {
    fn unknowns(&self) -> usize {
        self.n_unknowns()
    }

    fn work(&self) -> WorkCounters {
        self.body().work()
    }

    fn least_volume_ratio(&mut self, t: f64, y: &[f64]) -> (f64, usize) {
        let own = self.body_range();
        self.body_mut().least_volume_ratio(t, &y[own])
    }
}

impl WithMuscle for FeedbackDae {
    fn unknowns(&self) -> usize {
        self.n_unknowns()
    }

    fn work(&self) -> WorkCounters {
        self.one_way().work()
    }

    fn least_volume_ratio(&mut self, t: f64, y: &[f64]) -> (f64, usize) {
        let own = self.one_way().body_range();
        self.muscle_at(y).least_volume_ratio(t, &y[own])
    }
}

/// An integrator that adds advice to its message when it stops.
pub struct Advised<P> {
    inner: Box<dyn Integrator<P>>,
    advice: Advice,
}

impl<P: WithMuscle> Advised<P> {
    /// Wraps `inner` and adds `advice` to its messages.
    pub fn new(inner: Box<dyn Integrator<P>>, advice: Advice) -> Self {
        Self { inner, advice }
    }

    /// Returns advice on a stop without inverted elements, based on the current state. Before the first step, no state
    /// is available.
    fn explain(&mut self) -> String {
        let t = self.inner.time();
        let mut y = vec![0.0; self.inner.problem().unknowns()];
        let reached = self.inner.dense_output(t, 0, &mut y);
        let flat = reached.ok().and_then(|()| {
            let (ratio, element) = self.inner.problem_mut().least_volume_ratio(t, &y);
            self.advice.flatness(ratio, element)
        });
        let causes: Vec<_> = flat.into_iter().chain(self.advice.causes()).collect();
        format!(". {}{}", self.advice.subject(), listed(&causes))
    }
}

impl<P: WithMuscle> Integrator<P> for Advised<P> {
    forward_to_inner!(P);

    fn advance(&mut self) -> Result<Advance, ModelError> {
        let inversions = self.inner.problem().work().inversions;
        let advance = self.inner.advance()?;
        let Advance::Stopped { reason, message, .. } = advance else {
            return Ok(advance);
        };
        let work = self.inner.problem().work();
        // The error test evaluates a state without inverted elements, so earlier inversions are not
        // the cause.
        let refused = work.inversions > inversions && reason != EndReason::ErrorTestFailures;
        let inverted = work.inverted.filter(|_| refused);
        let explanation = match inverted {
            Some(at) => listed(&self.advice.causes_of_inversion(at)),
            None => self.explain(),
        };
        Ok(Advance::Stopped { reason, message: message + &explanation, inverted })
    }

    fn save(&self) -> Option<Continuation> {
        self.inner.save()
    }

    fn restore(&mut self, continuation: &Continuation) -> Result<(), ModelError> {
        self.inner.restore(continuation)
    }
}
