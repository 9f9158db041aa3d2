//! Derivatives of responses with respect to parameters.

use num_complex::Complex64;

use super::{Amplitude, DynamicStiffness};
use crate::error::ModelError;
use crate::sensitivity::Stencil;

/// A body at neighboring values of a parameter, each linearized about its own equilibrium.
pub struct Neighbors {
    stencil: Stencil,
    /// Step of the stencil, in the unit of the parameter.
    step: f64,
    bodies: Vec<DynamicStiffness>,
}

impl Neighbors {
    /// Creates the neighbors from one body at each point of a stencil with the given step.
    ///
    /// # Panics
    /// Panics if the number of bodies differs from the number of points.
    pub fn new(stencil: Stencil, step: f64, bodies: Vec<DynamicStiffness>) -> Self {
        assert_eq!(stencil.points().len(), bodies.len(), "a body for each point");
        Self { stencil, step, bodies }
    }

    /// Returns the bodies, each with its weight in the difference quotient.
    pub(super) fn weighted(&self) -> impl Iterator<Item = (f64, &DynamicStiffness)> {
        let points = self.stencil.points().iter().zip(&self.bodies);
        points.map(|((_, weight), body)| (weight / self.step, body))
    }

    /// Returns the derivatives of functions of a body and its amplitude. The functions must be linear in the amplitude.
    /// `at` is the amplitude, and `derivative` its derivative with respect to the parameter.
    ///
    /// # Errors
    /// Returns the errors of `read`.
    pub fn differentiate(
        &self,
        at: &Amplitude,
        derivative: &Amplitude,
        read: impl Fn(&DynamicStiffness, &Amplitude) -> Result<Vec<Complex64>, ModelError>,
    ) -> Result<Vec<Complex64>, ModelError> {
        let mut sums = Vec::new();
        let points = self.stencil.points().iter().zip(self.weighted());
        for ((distance, _), (weight, body)) in points {
            let step = distance * self.step;
            let moved = |from: &[Complex64], along: &[Complex64]| {
                let pairs = from.iter().zip(along);
                pairs.map(|(from, along)| from + step * along).collect()
            };
            let values = read(
                body,
                &Amplitude {
                    s: at.s,
                    displacement: moved(&at.displacement, &derivative.displacement),
                    pressure: moved(&at.pressure, &derivative.pressure),
                },
            )?;
            sums.resize(values.len(), Complex64::ZERO);
            for (sum, value) in sums.iter_mut().zip(values) {
                *sum += weight * value;
            }
        }
        Ok(sums)
    }
}
