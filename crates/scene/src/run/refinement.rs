//! Refinement of an approximate state to a periodic state.

use myovib_model::periodic::{
    Multipliers, PeriodMap, PeriodicState, Shooting, StartInterval, multipliers, shoot,
};
use myovib_model::start::Consistent;
use myovib_model::{Limits, ModelError};

use crate::system::System;
use crate::watch::Watcher;

/// Maximum number of times that the number of fixed steps is doubled.
const DOUBLINGS: usize = 6;
/// Factor by which tolerances are multiplied if they are too loose for the motion. Examples are absolute tolerances for
/// a small vibration about a large preload, and relative tolerances for material laws with kinks.
const TIGHTER: f64 = 0.1;
/// Smallest relative tolerance.
const SMALLEST_RTOL: f64 = 1e-14;

/// Refinement of an approximate state to a periodic state. The search uses fixed steps; the final check uses adaptive
/// steps.
pub(super) struct Refinement<'a, P, S> {
    pub(super) map: &'a mut PeriodMap<P, S>,
    pub(super) watcher: Watcher<'a>,
    /// Relative tolerance of the integrator.
    pub(super) rtol: f64,
    /// Options for searches with adaptive steps and with fixed steps.
    pub(super) adaptive: Shooting,
    pub(super) fixed: Shooting,
    /// Number of fixed steps per period, and the number of times that it has been doubled.
    pub(super) n_steps: u64,
    pub(super) doublings: usize,
    /// Smallest residual of all states so far.
    pub(super) smallest: f64,
}

impl<P: System + Consistent + Clone, S: StartInterval<P>> Refinement<'_, P, S> {
    /// Finds the periodic state near `found`. An integration from `found` over one period with adaptive steps reaches
    /// `end`.
    pub(super) fn state(
        &mut self,
        found: &[f64],
        end: &[f64],
    ) -> Result<PeriodicState, ModelError> {
        let tolerance = self.adaptive.tolerance;
        let is_met = |residual: f64| residual <= tolerance; // false for NaN
        let residual = self.adaptive.residual(found, end);
        let mut found = PeriodicState { state: found.to_vec(), residual, iterations: 0 };
        while !is_met(found.residual) {
            match self.with_fixed_steps(&found.state) {
                Ok(next) => {
                    // If the state also repeats with twice as many fixed steps, the remaining residual is due to the
                    // adaptive steps.
                    if next.iterations == 0 && self.doublings > 0 {
                        self.tighten();
                    }
                    let end = self.end(&next.state)?;
                    let residual = self.adaptive.residual(&next.state, &end);
                    let iterations = found.iterations + next.iterations;
                    found = PeriodicState { state: next.state, residual, iterations };
                }
                Err(ModelError::PeriodStopped { .. }) if self.doublings < DOUBLINGS => {}
                Err(error) => return Err(error),
            }
            if !is_met(found.residual) {
                if self.doublings == DOUBLINGS {
                    let (residual, map_error) = (found.residual, self.fixed.map_error);
                    return Err(ModelError::NoPeriodicState { residual, tolerance, map_error });
                }
                self.double();
            }
        }
        Ok(found)
    }

    /// Finds the state that repeats after one period with fixed steps.
    fn with_fixed_steps(&mut self, near: &[f64]) -> Result<PeriodicState, ModelError> {
        let fixed = self.fixed.clone();
        self.map.set_steps(Some(self.n_steps));
        let found = shoot(&mut |state| self.end(state), near, &fixed);
        self.map.set_steps(None);
        found
    }

    /// Returns the `count` leading multipliers, if any. Deviations from the periodic state may require shorter steps or, at
    /// kinks, adaptive steps.
    pub(super) fn multipliers(
        &mut self,
        state: &[f64],
        count: usize,
    ) -> Result<Multipliers, ModelError> {
        if count == 0 {
            return Ok(Multipliers::default());
        }
        loop {
            let is_fixed = self.doublings <= DOUBLINGS;
            let shooting = match is_fixed {
                true => self.fixed.clone(),
                false => self.adaptive.clone(),
            };
            self.map.set_steps(is_fixed.then_some(self.n_steps));
            let leading = multipliers(&mut |state| self.end(state), state, &shooting, count);
            self.map.set_steps(None);
            match leading {
                Err(ModelError::PeriodStopped { .. }) if is_fixed => self.double(),
                leading => return leading,
            }
        }
    }

    /// Integrates one period from a state and reports the progress.
    fn end(&mut self, state: &[f64]) -> Result<Vec<f64>, ModelError> {
        let (n, steps) = (self.map.evaluations(), self.map.counts().steps);
        let (smallest, tolerance) = (self.smallest, self.adaptive.tolerance);
        let Watcher { progress, interrupt } = self.watcher;
        progress.on_progress(&|| {
            let found = match smallest <= tolerance {
                true => "the state is found, its multipliers follow".to_owned(),
                false => format!("end states differ by {smallest:.1e} (tolerance {tolerance:.1e})"),
            };
            format!("periodic: {n} periods integrated in {steps} steps, {found}")
        });
        let mut limits = Limits::new(f64::INFINITY, interrupt);
        let end = self.map.observed(state, &mut [&mut limits])?;
        self.smallest = smallest.min(self.adaptive.residual(state, &end));
        Ok(end)
    }

    fn double(&mut self) {
        (self.doublings, self.n_steps) = (self.doublings + 1, 2 * self.n_steps);
    }

    fn tighten(&mut self) {
        let factor = TIGHTER * self.map.tolerance_factor();
        let smallest = SMALLEST_RTOL / self.rtol;
        self.map.set_tolerance_factor(factor.max(smallest));
    }
}
