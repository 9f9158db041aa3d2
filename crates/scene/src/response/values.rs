//! Complex values of a response: amplitudes of the probes and their ratios.

use myovib_model::ModelError;
use num_complex::Complex64;

use super::{HarmonicProbes, harmonic_probes};
use crate::probe::HarmonicMotion;
use crate::{InputError, Scene};

/// Values of a response at one frequency.
pub(crate) struct Values {
    probes: HarmonicProbes,
    ratios: Vec<Ratio>,
}

/// Ratio of two values of the probes.
struct Ratio {
    name: String,
    numerator: Term,
    denominator: Term,
}

/// Derivative of a value with respect to time.
struct Term {
    value: usize,
    order: u32,
}

impl Term {
    /// Finds `PROBE.COLUMN` in `names`; velocities and accelerations are derivatives of displacements.
    fn find(wanted: &str, names: &[String]) -> Option<Self> {
        let position = |name: &str| names.iter().position(|other| other == name);
        if let Some(value) = position(wanted) {
            return Some(Self { value, order: 0 });
        }
        let (probe, column) = wanted.rsplit_once('.')?;
        let derivative = |prefix: &str, order: u32| {
            let component = column.strip_prefix(prefix)?;
            let value = position(&format!("{probe}.u_{component}"))?;
            Some(Self { value, order })
        };
        derivative("v_", 1).or_else(|| derivative("a_", 2))
    }

    fn of(&self, s: Complex64, values: &[Complex64]) -> Complex64 {
        s.powu(self.order) * values[self.value]
    }
}

impl Values {
    /// Finds the values of the scene.
    ///
    /// # Errors
    /// Errors of [`harmonic_probes`]; ratios of unknown values.
    pub(crate) fn of_scene(scene: &Scene) -> Result<Self, InputError> {
        let probes = harmonic_probes(scene)?;
        let names = probes.iter().flat_map(|(probe, reading)| {
            let columns = reading.names().into_iter();
            columns.map(move |column| format!("{probe}.{column}"))
        });
        let names: Vec<String> = names.collect();
        let wanted = scene.file.response.iter().flat_map(|own| &own.ratio);
        let ratios = wanted.enumerate().map(|(i, wanted)| {
            let find = |key: &str, value: &str| {
                Term::find(value, &names).ok_or_else(|| {
                    let error = InputError::new("unknown value of a probe").found(value);
                    let error = error.allowed(format!(
                        "{}; for velocities and accelerations, v_ and a_ instead of u_",
                        names.join(", ")
                    ));
                    scene.wrong(&format!("response.ratio[{i}].{key}"), error)
                })
            };
            Ok(Ratio {
                name: wanted.name.clone(),
                numerator: find("numerator", &wanted.numerator)?,
                denominator: find("denominator", &wanted.denominator)?,
            })
        });
        Ok(Self { ratios: ratios.collect::<Result<_, InputError>>()?, probes })
    }

    /// Returns the name of each table with the names of its values.
    pub(crate) fn tables(&self) -> Vec<(String, Vec<String>)> {
        let probes = self.probes.iter();
        let probes = probes.map(|(name, reading)| (name.clone(), reading.names()));
        let ratios = self.ratios.iter().map(|ratio| &ratio.name);
        let ratios = ratios.map(|name| (name.clone(), vec![name.clone()]));
        probes.chain(ratios).collect()
    }

    /// Returns the values of all probes, without ratios.
    ///
    /// # Errors
    /// Errors of the probes.
    pub(super) fn read_probes(
        &self,
        motion: &HarmonicMotion<'_>,
    ) -> Result<Vec<Complex64>, ModelError> {
        let readings = self.probes.iter();
        let readings = readings.filter_map(|(_, reading)| reading.harmonic());
        let amplitudes = readings.map(|reading| reading.amplitudes(motion));
        Ok(amplitudes.collect::<Result<Vec<_>, _>>()?.concat())
    }

    /// Returns the values of all tables for s = iω.
    ///
    /// # Errors
    /// Errors of the probes; a ratio whose denominator is zero.
    pub(super) fn read(
        &self,
        s: Complex64,
        motion: &HarmonicMotion<'_>,
    ) -> Result<Vec<Complex64>, ModelError> {
        let mut values = self.read_probes(motion)?;
        for ratio in &self.ratios {
            let denominator = ratio.denominator.of(s, &values);
            if denominator == Complex64::ZERO {
                return Err(ModelError::OutOfRange {
                    name: "the denominator of a ratio",
                    value: 0.0,
                    allowed: "must be nonzero; velocities and accelerations are zero at 0 Hz",
                });
            }
            values.push(ratio.numerator.of(s, &values) / denominator);
        }
        Ok(values)
    }

    /// Returns the derivative of value number `k` for s = iω along a motion. `values` are all values, and `changes` the
    /// derivatives of the values of the probes.
    pub(super) fn change(
        &self,
        k: usize,
        s: Complex64,
        values: &[Complex64],
        changes: &[Complex64],
    ) -> Complex64 {
        let Some(ratio) = k.checked_sub(changes.len()).map(|k| &self.ratios[k]) else {
            return changes[k];
        };
        let numerator = ratio.numerator.of(s, changes);
        let denominator = ratio.denominator.of(s, changes);
        (numerator - values[k] * denominator) / ratio.denominator.of(s, values)
    }
}
