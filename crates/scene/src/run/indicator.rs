//! Error indicator for the probes. It is based on the error estimates of the integrator and has a negligible cost.
//!
//! In each step, the integrator estimates the error that the step adds to each unknown. The resulting change of a probe
//! value is the error estimate of the probe. The indicator is the sum of the magnitudes of these estimates over all
//! steps. This sum assumes that the errors accumulate and that none of them decays. With stiffness damping, the errors
//! of earlier steps decay, so the indicator may be much too large; `scripts/errors` compares it with the true errors of
//! random scenes. Radau IIA provides no such estimate, so its runs have no indicator. Indicators based on its estimates
//! of lower order were up to 1000 times too small.

use std::f64::consts::TAU;

use myovib_model::{ErrorEstimate, Integrator, ModelError};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};

use super::recorder::Recorder;
use crate::probe::{StateAt, within_half_a_turn};
use crate::system::{System, muscle_of};

/// Accumulated error estimates.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct Indicator {
    /// Sums for each probe and each column with an estimate.
    probes: Vec<Vec<Sum>>,
}

/// Accumulated error estimate of one column of a probe.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
struct Sum {
    largest: f64,
    /// Sum of the error estimates of all steps; `None` before the first finite estimate.
    error: Option<f64>,
}

impl Sum {
    /// Adds the error `estimate` of a step. `value` is the value of the probe at the end of the step.
    fn add(&mut self, value: f64, estimate: f64) {
        if value.is_finite() && estimate.is_finite() {
            self.largest = self.largest.max(value.abs());
            *self.error.get_or_insert(0.0) += estimate;
        }
    }
}

impl Indicator {
    /// Adds the step that ends at the current time of the integrator. `state` and `error` are workspaces. If there are
    /// no probes, the integrator is not called.
    pub(super) fn add<P: System>(
        &mut self,
        integrator: &mut dyn Integrator<P>,
        recorders: &[Recorder],
        state: &mut [f64],
        error: &mut [f64],
    ) -> Result<(), ModelError> {
        if recorders.is_empty() || !integrator.local_error(error)? {
            return Ok(());
        }
        let t = integrator.time();
        integrator.dense_output(t, 0, state)?;
        // The estimates apply only to the state. Errors of the derivative of the state are neglected.
        let mut rates = Vec::new();
        let stresses = recorders.iter().filter(|recorder| at_places(recorder));
        let system = integrator.problem_mut();
        if stresses.map(|r| &r.what).any(|what| what.needs_rates(system, state)) {
            rates.resize(state.len(), 0.0);
            integrator.dense_output(t, 1, &mut rates)?;
        }
        let system = integrator.problem_mut();
        let found = read(system, recorders, t, [state, &rates])?;
        for (y, e) in state.iter_mut().zip(error.iter()) {
            *y += e;
        }
        let shifted = read(system, recorders, t, [state, &rates])?;
        self.probes.resize(recorders.len(), Vec::new());
        for (k, sums) in self.probes.iter_mut().enumerate() {
            sums.resize(found[k].len(), Sum::default());
            for (j, sum) in sums.iter_mut().enumerate() {
                let difference = shifted[k][j] - found[k][j];
                let difference = match recorders[k].what.is_angle(j) {
                    true => within_half_a_turn(difference, TAU),
                    false => difference,
                };
                sum.add(found[k][j], difference.abs());
            }
        }
        Ok(())
    }

    /// Returns the errors by probe and column, in the same format as the estimate from a second run.
    pub(super) fn document(&self, recorders: &[Recorder], names: &[&str]) -> Value {
        let mut probes = Map::new();
        for ((sums, recorder), name) in self.probes.iter().zip(recorders).zip(names) {
            let columns = recorder.what.names().into_iter().zip(sums);
            let columns: Map<String, Value> = columns
                .map(|(column, sum)| {
                    let difference = sum.error.unwrap_or(f64::NAN);
                    let estimate = ErrorEstimate { size: sum.largest, difference };
                    (column, of_column(&estimate))
                })
                .collect();
            if !columns.is_empty() {
                probes.insert((*name).to_owned(), Value::Object(columns));
            }
        }
        Value::Object(probes)
    }
}

/// Returns the error report of a column. The error is `null` if no values could be compared.
pub(super) fn of_column(estimate: &ErrorEstimate) -> Value {
    json!({
        "largest": estimate.size,
        "error": estimate.difference,
        "relative": estimate.relative(),
    })
}

fn at_places(recorder: &Recorder) -> bool {
    !recorder.what.measurements().is_empty()
}

/// Returns the values of probes that depend only on the state. Other probes have no values here because they would
/// require a residual or the past motion.
fn read<P: System>(
    system: &mut P,
    recorders: &[Recorder],
    t: f64,
    [y, y_dot]: [&[f64]; 2],
) -> Result<Vec<Vec<f64>>, ModelError> {
    let mut values = vec![Vec::new(); recorders.len()];
    if recorders.iter().any(at_places) {
        // The state is expanded once for all probes.
        let (dae, range) = muscle_of(system, y)?;
        let rates = y_dot.get(range.clone()).unwrap_or_default();
        let snapshot = dae.snapshot(t, &y[range], rates);
        for (recorder, values) in recorders.iter().zip(&mut values) {
            let measurements = recorder.what.measurements().iter();
            measurements.for_each(|m| m.read(&snapshot, values));
        }
    }
    for (recorder, values) in recorders.iter().zip(&mut values) {
        let what = &recorder.what;
        let is_of_state = what.balance().is_none() && !what.needs_rates(system, y);
        if !at_places(recorder) && is_of_state && what.has_indicator() {
            let y_dot = &[][..];
            *values = what.values(system, StateAt { t, y, y_dot })?;
        }
    }
    Ok(values)
}
