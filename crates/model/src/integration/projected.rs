//! Periodic projection onto the constraint, for formulations whose constraint drifts.
//!
//! The formulation `velocity` integrates the differentiated constraint. The displacement and the velocity therefore
//! drift away from incompressible motions as the errors of the steps accumulate. IDAS has no hook for projections.
//! Here, the state is projected between two steps and made consistent ([`Consistent`]), and the integrator restarts
//! from this state at order 1. The counts accumulate over all starts and thus include the additional steps.
//!
//! Reference: E. Hairer, G. Wanner, *Solving Ordinary Differential Equations II*, section VII.2
//! (projection methods).

use crate::error::ModelError;
use crate::integration::ida::IdaIntegrator;
use crate::integration::integrator::{Advance, Integrator, forward_to_inner};
use crate::start::Consistent;

/// IDAS with a projection after the first step that reaches each multiple of a time interval.
pub struct Projected<P: Consistent> {
    inner: IdaIntegrator<P>,
    every: f64,
    next: f64,
}

impl<P: Consistent> Projected<P> {
    /// Projects the state of `inner` every `every` seconds.
    ///
    /// # Errors
    /// Returns [`ModelError::OutOfRange`] if `every` is not positive and finite.
    pub fn new(inner: IdaIntegrator<P>, every: f64) -> Result<Self, ModelError> {
        if !(every > 0.0 && every.is_finite()) {
            return Err(ModelError::OutOfRange {
                name: "projection_interval",
                value: every,
                allowed: "finite and greater than 0",
            });
        }
        let next = inner.time() + every;
        Ok(Self { inner, every, next })
    }
}

/// Returns the first of `next`, `next + every`, … after `t` ≥ `next`. A step may pass several of these times; a single
/// projection then suffices.
fn first_after(t: f64, next: f64, every: f64) -> f64 {
    let passed = ((t - next) / every).floor();
    next + (passed + 1.0) * every
}

impl<P: Consistent> Integrator<P> for Projected<P> {
    forward_to_inner!(P);

    fn advance(&mut self) -> Result<Advance, ModelError> {
        if self.inner.time() >= self.next {
            self.inner.restart(self.inner.time())?;
            self.next = first_after(self.inner.time(), self.next, self.every);
        }
        self.inner.advance()
    }
}

#[cfg(test)]
mod tests {
    use super::first_after;

    #[test]
    fn times_passed_within_a_step_are_skipped() {
        assert_eq!(first_after(0.5, 0.5, 0.25), 0.75);
        assert_eq!(first_after(0.6, 0.5, 0.25), 0.75);
        assert_eq!(first_after(1.6, 0.5, 0.25), 1.75);
    }
}
