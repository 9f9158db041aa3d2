//! Readings of quantities at points, shared by the probes for points, lines and averages.

use myovib_fem::{Solid, Space};
use myovib_model::{Measurement, ModelError, Quantity};
use num_complex::Complex64;

use super::kind::{HarmonicMotion, InvalidPlace, Reading, StateAt, Wrong, at};
use crate::system::{System, muscle_of, need_rates};

/// Returns the quantities measured by default.
pub(super) fn displacement_and_pressure() -> Vec<Quantity> {
    vec![Quantity::Displacement, Quantity::Pressure]
}

/// Rejects a reference to an unknown group.
pub(super) fn check_reference(
    solid: &Solid,
    group: Option<&str>,
) -> Result<(), Wrong<InvalidPlace>> {
    group.map_or(Ok(()), |group| at(".relative_to", solid.space().quadrature(group)).map(drop))
}

/// Returns the reading of a measurement. If a group is given, the values are relative to this group.
pub(super) fn relative(
    space: &Space,
    measurement: Measurement,
    group: Option<&str>,
) -> Result<Box<dyn Reading>, ModelError> {
    let measurement = match group {
        Some(group) => measurement.relative_to(space, group)?,
        None => measurement,
    };
    Ok(Box::new(Places(vec![measurement])))
}

/// Quantities at one position or at several numbered positions.
pub(super) struct Places(pub(super) Vec<Measurement>);

impl Reading for Places {
    fn names(&self) -> Vec<String> {
        match &self.0[..] {
            [one] => one.names(),
            several => several
                .iter()
                .enumerate()
                .flat_map(|(i, m)| m.names().into_iter().map(move |name| format!("{name}_{i}")))
                .collect(),
        }
    }

    fn values(&self, system: &mut dyn System, at: StateAt<'_>) -> Result<Vec<f64>, ModelError> {
        let StateAt { t, y, y_dot } = at;
        let (dae, range) = muscle_of(system, y)?;
        let rates = y_dot.get(range.clone()).unwrap_or_default();
        let snapshot = dae.snapshot(t, &y[range], rates);
        let mut values = Vec::new();
        for measurement in &self.0 {
            measurement.read(&snapshot, &mut values);
        }
        Ok(values)
    }

    fn needs_rates(&self, system: &mut dyn System, y: &[f64]) -> bool {
        let mut measurements = self.0.iter();
        measurements.any(|measurement| need_rates(measurement.quantities(), system, y))
    }

    fn stress_evaluations(&self) -> u64 {
        self.0.iter().map(|m| m.stress_evaluations() as u64).sum()
    }

    fn measurements(&self) -> &[Measurement] {
        &self.0
    }

    fn retain(&mut self, is_kept: &dyn Fn(Quantity) -> bool) {
        self.0.iter_mut().for_each(|measurement| measurement.retain(is_kept));
    }

    fn is_harmonic(&self) -> bool {
        true
    }

    fn amplitudes(&self, of: &HarmonicMotion<'_>) -> Result<Vec<Complex64>, ModelError> {
        let (stiffness, amplitude) = of.body()?;
        Ok(stiffness.amplitudes(amplitude, |snapshot| {
            let mut values = Vec::new();
            for measurement in &self.0 {
                measurement.read(snapshot, &mut values);
            }
            values
        }))
    }
}
