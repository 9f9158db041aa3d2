//! Displacements of a body's points over its last step.

use std::sync::{Arc, PoisonError, RwLock, RwLockReadGuard};

use super::chebyshev;
use super::recording::POINTS;
use crate::error::ModelError;
use crate::integration::integrator::Integrator;
use crate::reading::displacement::Displacement;
use crate::signal::timing::{Break, TimeScales};

/// Interpolating polynomials of the displacements of a body's points over its last step. The integrator of the body
/// shares them with the oscillators driven by these points.
#[derive(Debug, Default)]
pub struct StepMotion(RwLock<Polynomials>);

#[derive(Debug, Default)]
struct Polynomials {
    from: f64,
    to: f64,
    /// Values of each driving point at [`POINTS`] times of the step, without prescribed parts.
    values: Vec<[f64; POINTS]>,
}

impl StepMotion {
    fn read(&self) -> RwLockReadGuard<'_, Polynomials> {
        self.0.read().unwrap_or_else(PoisonError::into_inner)
    }

    /// Sets the displacements of the `places` at time `t` for the unknowns `y` of the body, before
    /// its first step.
    pub(super) fn start(&self, t: f64, y: &[f64], places: &[Displacement]) {
        let values = places.iter().map(|place| [place.of(y); POINTS]).collect();
        *self.0.write().unwrap_or_else(PoisonError::into_inner) =
            Polynomials { from: t, to: t, values };
    }

    /// Reads the displacements of the `places` over the last step `[from, to]` of `body`. `y` is a workspace for the
    /// unknowns of the body. Calls `on_largest` with the index of each place and its largest displacement.
    pub(super) fn record<B>(
        &self,
        body: &mut dyn Integrator<B>,
        [from, to]: [f64; 2],
        places: &[Displacement],
        y: &mut [f64],
        mut on_largest: impl FnMut(usize, f64),
    ) -> Result<(), ModelError> {
        let mut own = self.0.write().unwrap_or_else(PoisonError::into_inner);
        (own.from, own.to) = (from, to);
        if places.is_empty() {
            return Ok(());
        }
        for (k, t) in chebyshev::times(POINTS, [from, to]).enumerate() {
            body.dense_output(t, 0, y)?;
            for (values, place) in own.values.iter_mut().zip(places) {
                values[k] = place.of(y);
            }
        }
        for (i, values) in own.values.iter().enumerate() {
            on_largest(i, values.iter().fold(0.0, |max, u| u.abs().max(max)));
        }
        Ok(())
    }
}

/// The end of the body's last step is a break: the derivatives of the displacements jump there, and
/// later displacements are not known yet.
impl TimeScales for Arc<StepMotion> {
    fn next_break(&self, after: f64) -> Option<Break> {
        let t = self.read().to;
        (after < t).then_some(Break { t, order: 1 })
    }

    fn is_resolved(&self, _: f64, _: f64) -> bool {
        false
    }
}

/// A driving point of a separately integrated body.
#[derive(Debug, Clone)]
pub struct StepPoint {
    motion: Arc<StepMotion>,
    number: usize,
    prescribed: Displacement,
}

impl StepPoint {
    /// Creates the point with the given index among the driving points of a body. The point includes the prescribed
    /// displacement of `place`.
    pub(super) fn new(motion: &Arc<StepMotion>, number: usize, place: &Displacement) -> Self {
        Self {
            motion: Arc::clone(motion),
            number,
            prescribed: Displacement { unknowns: Vec::new(), prescribed: place.prescribed.clone() },
        }
    }

    pub(super) fn number(&self) -> usize {
        self.number
    }

    pub(super) fn motion(&self) -> &Arc<StepMotion> {
        &self.motion
    }

    /// Returns the displacement at a time within the last step of the body.
    pub(super) fn at(&self, t: f64) -> f64 {
        let motion = self.motion.read();
        let length = motion.to - motion.from;
        let x = if length > 0.0 { (t - motion.from) / length } else { 0.0 };
        chebyshev::interpolate(&motion.values[self.number], x) + self.prescribed.prescribed_at(t)
    }
}
