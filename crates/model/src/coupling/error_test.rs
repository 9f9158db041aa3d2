//! Which errors the integrator of a coupled system looks at, and how closely.
//!
//! IDAS has one relative tolerance for all components, and its norm is the root mean square over
//! all N of them: among the 3034 unknowns of the muscle the error of ten oscillators would be seen
//! through √(10/3034) = 1/17. Here each component has a relative tolerance of its own, and the
//! weights of each network of n states are √(N/n) times as large, so that it passes by its own root
//! mean square. The body's part of the norm stays what it is without oscillators, but for N.
//!
//! Internal stresses of Prony terms may be many more than all other unknowns of a muscle: they and
//! the others pass by their own root mean squares, too.

use std::ops::Range;

use myovib_dae::Problem;

use super::dae::CoupledDae;
use crate::field::{Field, Layout};
use crate::integration::settings::{MultiplierWeights, Settings};
use crate::integration::step_weights::{StepSize, StepWeights};
use crate::muscle_dae::MuscleDae;

/// Tolerances of the states of a rod or of oscillators.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StateTolerances {
    /// Relative tolerance.
    pub relative: f64,
    /// Absolute tolerance; the response of an oscillator begins near 2e-5.
    pub absolute: f64,
    /// Whether the states take part in the error test.
    pub tested: bool,
}

impl Default for StateTolerances {
    /// Relative 1e-7, absolute 1e-10, in the error test.
    fn default() -> Self {
        Self {
            relative: 1e-7,
            absolute: 1e-10,
            tested: true,
        }
    }
}

/// The error test by component.
#[derive(Debug, Clone, Default)]
pub struct ErrorTest {
    relative: Vec<f64>,
    absolute: Vec<f64>,
    importance: Vec<f64>,
    left_out: Vec<bool>,
    /// Weights of the muscle's part that follow the step.
    by_step: Option<StepWeights>,
}

impl ErrorTest {
    /// The muscle's part, as its settings say.
    pub fn of_muscle(dae: &MuscleDae, settings: &Settings) -> Self {
        let layout = dae.layout();
        let scaled = settings.multiplier_weights == MultiplierWeights::StepScaled;
        Self {
            by_step: scaled.then(|| StepWeights::new(dae, settings, StepSize::default())),
            relative: layout.fill(|_| settings.relative_tolerance),
            absolute: layout.fill(|field| settings.absolute_tolerances.of(field)),
            importance: importance(layout),
            left_out: settings.left_out(layout),
        }
    }

    /// The same tolerances for `n` states of a body (0 for no body).
    pub fn of_states(n: usize, tolerances: StateTolerances) -> Self {
        let mut test = Self::default();
        test.extend(n, tolerances);
        test
    }

    /// Adds the oscillators of `dae` to its body's part.
    ///
    /// # Panics
    /// When the body's part has not one entry per unknown of the body.
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
        self.left_out.resize(end, !tolerances.tested);
    }

    /// The same test with tolerances times a factor that depends on the relative one.
    #[must_use]
    pub fn scaled(mut self, factor: impl Fn(f64) -> f64) -> Self {
        for (relative, absolute) in self.relative.iter_mut().zip(&mut self.absolute) {
            let factor = factor(*relative);
            *relative *= factor;
            *absolute *= factor;
        }
        self
    }

    /// The smallest relative tolerance.
    pub fn smallest_relative(&self) -> f64 {
        self.relative.iter().copied().fold(1.0, f64::min)
    }

    /// Where weights that follow the step read its size, if they do.
    pub(crate) fn step_size(&self) -> Option<StepSize> {
        self.by_step.as_ref().map(StepWeights::step_size)
    }

    /// Components left out of the error test.
    pub fn left_out(&self) -> &[bool] {
        &self.left_out
    }

    /// Absolute tolerances by component.
    pub fn absolute(&self) -> &[f64] {
        &self.absolute
    }

    /// `weights` ← importance / (relative |y| + absolute).
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

/// √(N/n) for the n internal stresses among N unknowns of a muscle, and for the n others.
fn importance(layout: &Layout) -> Vec<f64> {
    let n_internal = layout
        .range(Field::InternalStress)
        .map_or(0, |own| own.len());
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
