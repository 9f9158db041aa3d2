//! Complex values of a response: the amplitudes of the probes, and ratios of these amplitudes.

use myovib_model::ModelError;
use num_complex::Complex64;

use super::{HarmonicProbes, harmonic_probes};
use crate::probe::HarmonicMotion;
use crate::{InputError, Scene};

/// Probes and ratios whose values form a response at each frequency.
pub(crate) struct Values {
    probes: HarmonicProbes,
    ratios: Vec<Ratio>,
    /// Whether each value is needed; other values are read as zero.
    needed: Vec<bool>,
}

/// Ratio of two values of the probes.
struct Ratio {
    name: String,
    numerator: Term,
    denominator: Term,
}

/// Time derivative of a value.
struct Term {
    value: usize,
    order: u32,
}

impl Term {
    /// Finds `PROBE.COLUMN` in `names`. Velocities and accelerations are found as derivatives of displacements.
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
    /// Collects the probes and ratios of the scene.
    ///
    /// # Errors
    /// Returns the errors of [`harmonic_probes`]. Also fails if a ratio refers to an unknown value.
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
        let ratios = ratios.collect::<Result<Vec<_>, InputError>>()?;
        let needed = vec![true; names.len() + ratios.len()];
        Ok(Self { probes, ratios, needed })
    }

    /// Restricts the computation to the values with the `chosen` indices and to the terms of chosen ratios.
    pub(crate) fn only(mut self, chosen: &[usize]) -> Self {
        self.needed.fill(false);
        let n_of_probes = self.needed.len() - self.ratios.len();
        for &k in chosen {
            self.needed[k] = true;
            if let Some(ratio) = k.checked_sub(n_of_probes).map(|k| &self.ratios[k]) {
                self.needed[ratio.numerator.value] = true;
                self.needed[ratio.denominator.value] = true;
            }
        }
        self
    }

    /// Returns the name of each table and the names of its values.
    pub(crate) fn tables(&self) -> Vec<(String, Vec<String>)> {
        let probes = self.probes.iter();
        let probes = probes.map(|(name, reading)| (name.clone(), reading.names()));
        let ratios = self.ratios.iter().map(|ratio| &ratio.name);
        let ratios = ratios.map(|name| (name.clone(), vec![name.clone()]));
        probes.chain(ratios).collect()
    }

    /// Returns the index of the first value of a table.
    pub(crate) fn first(&self, table: &str) -> usize {
        let tables = self.tables().into_iter();
        tables.take_while(|(name, _)| name != table).map(|(_, values)| values.len()).sum()
    }

    /// Returns the values of all probes, but not the ratios.
    ///
    /// # Errors
    /// Returns the errors of the probes.
    pub(crate) fn read_probes(
        &self,
        motion: &HarmonicMotion<'_>,
    ) -> Result<Vec<Complex64>, ModelError> {
        let mut values = Vec::with_capacity(self.needed.len());
        for (_, reading) in &self.probes {
            let n = reading.names().len();
            let is_needed = self.needed[values.len()..][..n].contains(&true);
            match is_needed {
                true => values.extend(reading.amplitudes(motion)?),
                false => values.resize(values.len() + n, Complex64::ZERO),
            }
        }
        Ok(values)
    }

    /// Returns the values of all tables at s = iω.
    ///
    /// # Errors
    /// Returns the errors of the probes. Also fails if the denominator of a ratio is zero.
    pub(crate) fn read(
        &self,
        s: Complex64,
        motion: &HarmonicMotion<'_>,
    ) -> Result<Vec<Complex64>, ModelError> {
        let mut values = self.read_probes(motion)?;
        for ratio in &self.ratios {
            if !self.needed[values.len()] {
                values.push(Complex64::ZERO);
                continue;
            }
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

    /// Returns the derivative of the value with the index `k` at s = iω along a motion or parameter. `values` contains
    /// all values, and `changes` contains the derivatives of the probes' values.
    pub(crate) fn change(
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
