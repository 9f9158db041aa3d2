//! Projection onto the constraint at chosen times, for formulations that let it drift.
//!
//! `velocity` integrates the differentiated constraint: displacement and velocity leave the
//! incompressible motions by what the steps' errors add up to. IDAS has no hook for a projection;
//! here the state is projected between two steps, made consistent anew ([`Consistent`]), and the
//! integrator starts again from it, at order 1. What that costs is in the counts, which go on over
//! all starts.
//!
//! Reference: E. Hairer, G. Wanner, *Solving Ordinary Differential Equations II*, section VII.2
//! (projection methods).

use crate::error::ModelError;
use crate::integration::ida::IdaIntegrator;
use crate::integration::integrator::{Advance, Integrator, left_to_inner};
use crate::start::Consistent;

/// IDAS with projections after the first step at or beyond each multiple of a time.
pub struct Projected<P: Consistent> {
    inner: IdaIntegrator<P>,
    every: f64,
    next: f64,
}

impl<P: Consistent> Projected<P> {
    /// Projects `inner` every so many seconds.
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] for a time that is not positive.
    pub fn new(inner: IdaIntegrator<P>, every: f64) -> Result<Self, ModelError> {
        if !(every > 0.0 && every.is_finite()) {
            return Err(ModelError::OutOfRange {
                name: "project_every",
                value: every,
                allowed: "finite and greater than 0",
            });
        }
        let next = inner.time() + every;
        Ok(Self { inner, every, next })
    }
}

/// The first of `next`, `next + every`, … after `t` ≥ `next`: a step may pass several of the times,
/// and one projection serves them all.
fn first_after(t: f64, next: f64, every: f64) -> f64 {
    let passed = ((t - next) / every).floor();
    next + (passed + 1.0) * every
}

impl<P: Consistent> Integrator<P> for Projected<P> {
    left_to_inner!(P);

    fn advance(&mut self) -> Result<Advance, ModelError> {
        if self.inner.time() >= self.next {
            self.inner.start_again(self.inner.time())?;
            self.next = first_after(self.inner.time(), self.next, self.every);
        }
        self.inner.advance()
    }
}

#[cfg(test)]
mod tests {
    use super::first_after;

    #[test]
    fn times_that_a_step_passes_are_not_caught_up_on() {
        assert_eq!(first_after(0.5, 0.5, 0.25), 0.75);
        assert_eq!(first_after(0.6, 0.5, 0.25), 0.75);
        assert_eq!(first_after(1.6, 0.5, 0.25), 1.75);
    }
}
