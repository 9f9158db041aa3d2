//! Error weights of multipliers that depend on the step size.
//!
//! A perturbation δ of the constraint (the residual of Newton's method, or the error of the displacement) causes an
//! error δ/h^(i−1) in a multiplier of index i. The error estimate of the multiplier therefore does not decrease with
//! the step. The error test rejects the step, the next step is smaller and its estimate larger, and so on until the
//! step size underflows. With the weight factor (Ωh)^(i−1), where Ω is the angular frequency of the drive, the error
//! of the multiplier is measured by its effect on the velocity (i = 2) or the displacement (i = 3) within the step.
//! This effect decreases with the step. If steps do not resolve the drive (Ωh > 1), the factor is 1.
//!
//! Reference: E. Hairer, C. Lubich, M. Roche, *The Numerical Solution of Differential-Algebraic
//! Systems by Runge–Kutta Methods*, Springer 1989, chapter 7 (errors of index-2 and index-3
//! components multiplied by h and h²).

use std::f64::consts::TAU;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::field::{Field, Layout};
use crate::formulation::Formulation;
use crate::integration::settings::{AbsoluteTolerances, Settings};
use crate::integration::typical::transit_time;
use crate::muscle_dae::MuscleDae;

/// Size of the next step, shared between an integrator and its weights; 0 before the first step.
#[derive(Debug, Clone, Default)]
pub struct SharedStepSize(Arc<AtomicU64>);

impl SharedStepSize {
    /// Sets the size, s.
    pub fn set(&self, h: f64) {
        self.0.store(h.to_bits(), Ordering::Relaxed);
    }

    /// Returns the size, s.
    pub fn get(&self) -> f64 {
        f64::from_bits(self.0.load(Ordering::Relaxed))
    }
}

/// Error weights of all unknowns y_j: `1/(rtol |y_j| + atol_j)`. The weights of multipliers are multiplied by
/// min(Ωh, 1)^(i−1), or by 1 before the first step.
///
/// The index i is the index of the incompressible body, because a large κ is a singular perturbation: as long as the
/// steps do not resolve compression waves, the multiplier behaves as in the limit κ → ∞.
#[derive(Debug, Clone)]
pub struct StepWeights {
    layout: Layout,
    relative: f64,
    absolute: AbsoluteTolerances,
    formulation: Formulation,
    /// Whether β > 0, which lowers the index of the multipliers.
    damped: bool,
    /// Ω, 1/s.
    omega: f64,
    step_size: SharedStepSize,
}

impl StepWeights {
    /// Creates weights for `dae` with the tolerances of `settings`. Without a drive frequency, 1/Ω is the time in which
    /// shear waves cross the body.
    pub fn new(dae: &MuscleDae, settings: &Settings, step_size: SharedStepSize) -> Self {
        let muscle = dae.muscle();
        Self {
            layout: dae.layout().clone(),
            relative: settings.relative_tolerance,
            absolute: settings.absolute_tolerances,
            formulation: dae.formulation(),
            damped: muscle.parameters.is_damped(),
            omega: muscle
                .forcing_frequency()
                .map_or_else(|| 1.0 / transit_time(muscle), |frequency| TAU * frequency),
            step_size,
        }
    }

    /// Returns the number of the muscle's unknowns.
    pub(crate) fn len(&self) -> usize {
        self.layout.n_unknowns()
    }

    pub(crate) fn step_size(&self) -> SharedStepSize {
        self.step_size.clone()
    }

    /// Writes the weights for `y`, whose first entries are the muscle's unknowns.
    pub fn write(&self, y: &[f64], weights: &mut [f64]) {
        for (field, range) in self.layout.blocks() {
            let (factor, absolute) = (self.factor(*field), self.absolute.of(*field));
            for (weight, y) in weights[range.clone()].iter_mut().zip(&y[range.clone()]) {
                *weight = factor / (self.relative * y.abs() + absolute);
            }
        }
    }

    /// Returns min(Ωh, 1)^(i−1) for a multiplier of index i. Returns 1 for displacement and velocity, and before the
    /// first step.
    fn factor(&self, field: Field) -> f64 {
        let h = self.step_size.get();
        if field.is_displacement_like() || h == 0.0 {
            return 1.0;
        }
        let index = self.formulation.limit_index(field, self.damped);
        let power = i32::from(index.saturating_sub(1));
        (self.omega * h.abs()).min(1.0).powi(power)
    }
}

#[cfg(test)]
mod tests {
    use myovib_fem::generate;

    use super::*;
    use crate::paper;

    /// Exponents i − 1 derived independently from Table 1 of the paper and from Hairer, Lubich,
    /// Roche for the indices of single variables.
    const POWERS: [(Formulation, f64, f64, Field, i32); 12] = [
        (Formulation::Position, INFINITE, 0.0, Field::Pressure, 2),
        (Formulation::Position, INFINITE, 0.0, Field::Velocity, 0),
        (Formulation::Position, INFINITE, 0.0, Field::Displacement, 0),
        // The limit of a large κ.
        (Formulation::Position, 1e5, 0.0, Field::Pressure, 2),
        (Formulation::Velocity, INFINITE, 0.0, Field::Pressure, 1),
        (Formulation::Velocity, INFINITE, 0.0, Field::Velocity, 0),
        (Formulation::Stabilized, INFINITE, 0.0, Field::Pressure, 1),
        (Formulation::Stabilized, INFINITE, 0.0, Field::GglMultiplier, 1),
        (Formulation::Rate, INFINITE, 1e-4, Field::Pressure, 1),
        (Formulation::Rate, INFINITE, 1e-4, Field::PressureRate, 2),
        (Formulation::Rate, 1e5, 1e-4, Field::PressureRate, 2),
        (Formulation::ImplicitRate, INFINITE, 1e-4, Field::Pressure, 1),
    ];
    const INFINITE: f64 = f64::INFINITY;

    /// Regression: weights with a wrong power of the step passed all other tests.
    #[test]
    fn multipliers_are_scaled_by_the_power_of_the_step_for_their_index() {
        let mesh = generate::beam(0.1, 0.02, [2, 1]).unwrap();
        for (formulation, kappa, beta, field, power) in POWERS {
            let muscle = paper::muscle(&mesh, kappa, beta).unwrap();
            let dae = MuscleDae::new(muscle, formulation).unwrap();
            let step_size = SharedStepSize::default();
            let settings = Settings::paper(formulation);
            let weights = StepWeights::new(&dae, &settings, step_size.clone());
            let n = dae.layout().n_unknowns();
            let first = dae.layout().range(field).unwrap().start;
            let at = |omega_h: f64| {
                step_size.set(omega_h / (TAU * paper::LOAD_FREQUENCY));
                let mut out = vec![0.0; n];
                weights.write(&vec![0.0; n], &mut out);
                out[first] * settings.absolute_tolerances.of(field)
            };
            let resolved = [0.5, 0.1, 1e-3].map(|omega_h: f64| (omega_h, omega_h.powi(power)));
            // Steps that do not resolve the drive, and the first step, have the factor 1.
            for (omega_h, expected) in resolved.into_iter().chain([(3.0, 1.0), (0.0, 1.0)]) {
                let found = at(omega_h);
                // Some products are rounded.
                let off = (found / expected - 1.0).abs();
                assert!(off < 1e-14, "{formulation} {field}: {found} {expected}");
            }
        }
    }
}
