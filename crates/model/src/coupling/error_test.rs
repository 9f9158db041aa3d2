//! Component-wise error-test weights of coupled systems.
//!
//! IDAS has a single relative tolerance, and its norm is the root mean square over all N components. With the 3034
//! unknowns of the muscle, the error of the 20 states of ten oscillators would be scaled by √(20/3054) ≈ 1/12. Here,
//! each component has its own relative tolerance, and the weights of a network with n states are multiplied by √(N/n).
//! The error of each network is thus tested by the root mean square over this network alone. The body's part of the
//! norm changes only through N.
//!
//! The internal stresses of Prony terms may outnumber all other unknowns of a muscle. The internal stresses and the
//! other unknowns are therefore scaled in the same way.

use std::ops::Range;

use myovib_dae::Problem;

use super::dae::CoupledDae;
use crate::field::{Field, Layout};
use crate::integration::settings::{MultiplierWeights, Settings};
use crate::integration::step_weights::{SharedStepSize, StepWeights};
use crate::muscle_dae::MuscleDae;

/// Tolerances of the states of a rod or of oscillators.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StateTolerances {
    /// Relative tolerance.
    pub relative: f64,
    /// Absolute tolerance.
    pub absolute: f64,
    /// Whether the states are included in the error test.
    pub tested: bool,
}

impl Default for StateTolerances {
    /// Relative 1e-7, absolute 1e-10, included in the error test.
    fn default() -> Self {
        Self { relative: 1e-7, absolute: 1e-10, tested: true }
    }
}

/// Error test with separate weights for each component.
#[derive(Debug, Clone, Default)]
pub struct ErrorTest {
    relative: Vec<f64>,
    absolute: Vec<f64>,
    importance: Vec<f64>,
    excluded: Vec<bool>,
    /// Weights of the muscle that depend on the step size.
    by_step: Option<StepWeights>,
}

impl ErrorTest {
    /// Builds the error test of a muscle from its settings.
    pub fn of_muscle(dae: &MuscleDae, settings: &Settings) -> Self {
        let layout = dae.layout();
        let scaled = settings.multiplier_weights == MultiplierWeights::StepScaled;
        Self {
            by_step: scaled.then(|| StepWeights::new(dae, settings, SharedStepSize::default())),
            relative: layout.fill(|_| settings.relative_tolerance),
            absolute: layout.fill(|field| settings.absolute_tolerances.of(field)),
            importance: importance(layout),
            excluded: settings.excluded(layout),
        }
    }

    /// Builds an error test with equal tolerances for `n` states of a body (0 without a body).
    pub fn of_states(n: usize, tolerances: StateTolerances) -> Self {
        let mut test = Self::default();
        test.extend(n, tolerances);
        test
    }

    /// Appends the oscillators of `dae` to the body's part.
    ///
    /// # Panics
    /// Panics if the body's part does not have one entry per unknown of the body.
    #[must_use]
    pub fn with_oscillators<B: Problem>(
        mut self,
        dae: &CoupledDae<B>,
        tolerances: StateTolerances,
    ) -> Self {
        assert_eq!(self.relative.len(), dae.body_range().len(), "body's part");
        let n = dae.n_unknowns() as f64;
        for k in 0..dae.n_networks() {
            let range: Range<usize> = dae.range(k);
            let importance = (n / range.len() as f64).sqrt();
            self.extend(range.len(), tolerances);
            self.importance[range].fill(importance);
        }
        self
    }

    fn extend(&mut self, n: usize, tolerances: StateTolerances) {
        let end = self.relative.len() + n;
        self.relative.resize(end, tolerances.relative);
        self.absolute.resize(end, tolerances.absolute);
        self.importance.resize(end, 1.0);
        self.excluded.resize(end, !tolerances.tested);
    }

    /// Multiplies the tolerances of each component by a factor that depends on its relative tolerance.
    #[must_use]
    pub fn scaled(mut self, factor: impl Fn(f64) -> f64) -> Self {
        for (relative, absolute) in self.relative.iter_mut().zip(&mut self.absolute) {
            let factor = factor(*relative);
            *relative *= factor;
            *absolute *= factor;
        }
        self
    }

    /// Returns the smallest relative tolerance, or 1 if all relative tolerances are larger.
    pub(crate) fn smallest_relative(&self) -> f64 {
        self.relative.iter().copied().fold(1.0, f64::min)
    }

    /// Returns the shared step size that the step-dependent weights read, or `None` if there are no such weights.
    pub(crate) fn step_size(&self) -> Option<SharedStepSize> {
        self.by_step.as_ref().map(StepWeights::step_size)
    }

    /// Returns which components are excluded from the error test.
    pub fn excluded(&self) -> &[bool] {
        &self.excluded
    }

    /// Sets `weights` to importance / (relative |y| + absolute), or to importance times the
    /// step-dependent weights of the muscle.
    pub fn weights(&self, y: &[f64], weights: &mut [f64]) {
        for (i, (weight, y)) in weights.iter_mut().zip(y).enumerate() {
            let allowed = self.relative[i] * y.abs() + self.absolute[i];
            *weight = self.importance[i] / allowed;
        }
        if let Some(by_step) = &self.by_step {
            by_step.write(y, weights);
            for (weight, importance) in weights.iter_mut().zip(&self.importance[..by_step.len()]) {
                *weight *= importance;
            }
        }
    }
}

/// Returns √(N/n) for each of the N unknowns of a muscle. For internal stresses, n is the number of internal stresses;
/// for the other unknowns, it is the number of the other unknowns. Returns 1 for all unknowns if there are no internal
/// stresses.
fn importance(layout: &Layout) -> Vec<f64> {
    let n_internal = layout.range(Field::InternalStress).map_or(0, |own| own.len());
    let n = layout.n_unknowns();
    if n_internal == 0 {
        return vec![1.0; n];
    }
    layout.fill(|field| {
        let own = match field {
            Field::InternalStress => n_internal,
            _ => n - n_internal,
        };
        (n as f64 / own as f64).sqrt()
    })
}
