//! What is recorded of a run: the origin's motion, drift, energies, and its smallest step.

use std::ops::ControlFlow;

use myovib_dae::Problem;
use myovib_model::{Energies, ModelError, MuscleDae, Observer, Outcome, Probe, SampleTimes, Step};
use myovib_sparse::SparseError;
use myovib_sparse::SparseOptions;
use myovib_sparse::klu::{RealNumeric, Symbolic};

use super::cell::T_END;
use myovib_scene::energy::Exchanged;

/// Time between two samples, s: twenty to a period of the load.
const EVERY: f64 = 1.0 / 160.0;
/// Weights of Simpson's rule, but for a common factor.
const SIMPSON: [f64; 3] = [1.0, 4.0, 1.0];

/// Records a run at equidistant times, without altering its steps.
pub(super) struct Watch<'a> {
    times: SampleTimes,
    origin: &'a Probe,
    y: Vec<f64>,
    y_dot: Vec<f64>,
    /// u_y at the origin, m.
    pub(super) u_y: Vec<f64>,
    /// p at the origin, Pa.
    pub(super) p: Vec<f64>,
    /// The largest constraint drift.
    pub(super) drift: f64,
    energies: Vec<Energies>,
    smallest: Option<SmallestStep>,
}

/// Where the run took its smallest step.
struct SmallestStep {
    h: f64,
    t: f64,
    /// The coefficient of ∂F/∂ẏ in Newton's matrix.
    c_j: f64,
    y: Vec<f64>,
    y_dot: Vec<f64>,
}

impl<'a> Watch<'a> {
    pub(super) fn new(n: usize, origin: &'a Probe) -> Self {
        Self {
            times: SampleTimes::new(EVERY, T_END),
            origin,
            y: vec![0.0; n],
            y_dot: vec![0.0; n],
            u_y: Vec::new(),
            p: Vec::new(),
            drift: 0.0,
            energies: Vec::new(),
            smallest: None,
        }
    }

    fn sample(&mut self, dae: &mut MuscleDae, t: f64) -> Result<(), ModelError> {
        let value = dae.read(self.origin, t, &self.y);
        self.u_y.push(value.displacement[1]);
        if dae.pressure(&self.y).is_some() {
            self.p.push(value.pressure);
        }
        self.drift = self.drift.max(dae.constraint_drift(t, &self.y)?);
        self.energies.push(dae.energies(t, &self.y, &self.y_dot)?);
        Ok(())
    }

    /// The largest violation of `kinetic + elastic + dissipated = work` beside the largest of
    /// these, powers integrated by Simpson's rule over pairs of samples (with twenty to a period
    /// its relative error is 5e-5).
    pub(super) fn imbalance(&self) -> Option<f64> {
        let mut exchanged = Exchanged::default();
        let (mut worst, mut largest) = (0.0_f64, 0.0_f64);
        for samples in self.energies.windows(3).step_by(2) {
            let [start, middle, end] = [0, 1, 2].map(|i| &samples[i]);
            exchanged.add(2.0 * EVERY, SIMPSON, [start, middle, end]);
            worst = worst.max(exchanged.imbalance(end).abs());
            let stored = end.kinetic + end.elastic;
            largest = largest.max(stored.abs()).max(exchanged.work.abs());
        }
        (largest > 0.0).then(|| worst / largest)
    }

    /// Reciprocal condition of Newton's matrix at the smallest step, as KLU estimates it; 0 if it
    /// is singular.
    pub(super) fn rcond(&self, dae: &mut MuscleDae) -> Option<f64> {
        let at = self.smallest.as_ref()?;
        let pattern = dae.jacobian_pattern();
        let mut values = vec![0.0; pattern.nnz()];
        dae.jacobian(at.t, &at.y, &at.y_dot, 1.0, at.c_j, &mut values)
            .ok()?;
        let symbolic = Symbolic::analyze(&pattern, SparseOptions::default()).ok()?;
        match RealNumeric::factor(&symbolic, &values) {
            Ok(factors) => factors.rcond().ok(),
            Err(SparseError::Singular { .. }) => Some(0.0),
            Err(_) => None,
        }
    }
}

/// c_j h of BDF of order k with the fixed leading coefficient: 1 + 1/2 + … + 1/k.
fn leading_coefficient(order: u32) -> f64 {
    (1..=order.max(1)).map(|k| 1.0 / f64::from(k)).sum()
}

impl Observer<MuscleDae> for Watch<'_> {
    fn accepted(
        &mut self,
        step: &mut Step<'_, MuscleDae>,
    ) -> Result<ControlFlow<Outcome>, ModelError> {
        while let Some(t) = self.times.due(step.to) {
            let within = t.max(step.from);
            step.integrator.dense_output(within, 0, &mut self.y)?;
            step.integrator.dense_output(within, 1, &mut self.y_dot)?;
            self.sample(step.integrator.problem_mut(), t)?;
        }
        let (h, t) = (step.to - step.from, step.to);
        if self.smallest.as_ref().is_none_or(|smallest| h < smallest.h) {
            step.integrator.dense_output(t, 0, &mut self.y)?;
            step.integrator.dense_output(t, 1, &mut self.y_dot)?;
            self.smallest = Some(SmallestStep {
                h,
                t,
                c_j: leading_coefficient(step.integrator.counts().last_order) / h,
                y: self.y.clone(),
                y_dot: self.y_dot.clone(),
            });
        }
        Ok(ControlFlow::Continue(()))
    }
}
