//! Energy balance of a run.

use myovib_model::{Energies, Integrator, ModelError, MuscleDae, Powers};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::energy::Exchanged;
use crate::system::{System, muscle_of};

/// Current energies, and the work and dissipation since the start.
///
/// Powers are integrated over each accepted step by applying the quadrature rule of [`Exchanged`] to the dense output.
/// If samples divide a step into parts, each part is integrated separately.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(crate) struct EnergyBalance {
    t: f64,
    /// Sum of kinetic and elastic energy at the start (J).
    #[serde(deserialize_with = "nan_of_null")]
    initial: f64,
    #[serde(with = "with_nan")]
    last: Option<Energies>,
    exchanged: Exchanged,
    /// Workspace for y and ẏ.
    #[serde(skip)]
    state: [Vec<f64>; 2],
}

/// Reads `null` as NaN: energies may be non-finite, and JSON stores non-finite numbers as `null`.
pub(crate) fn nan_of_null<'de, D: Deserializer<'de>>(json: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(json)?.unwrap_or(f64::NAN))
}

/// Serializes [`Energies`] as a list, and reads `null` as NaN.
mod with_nan {
    use super::{Deserialize, Deserializer, Energies, Serialize, Serializer};

    pub(super) fn serialize<S: Serializer>(
        energies: &Option<Energies>,
        json: S,
    ) -> Result<S::Ok, S::Error> {
        energies.map(|e| [e.kinetic, e.elastic]).serialize(json)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(
        json: D,
    ) -> Result<Option<Energies>, D::Error> {
        let list = Option::<[Option<f64>; 2]>::deserialize(json)?;
        let [kinetic, elastic] = match list {
            None => return Ok(None),
            Some(list) => list.map(|value| value.unwrap_or(f64::NAN)),
        };
        Ok(Some(Energies { kinetic, elastic }))
    }
}

impl EnergyBalance {
    /// Integrates the powers up to time `t` within the last step, which began at `from`.
    pub(crate) fn advance<P: System>(
        &mut self,
        integrator: &mut dyn Integrator<P>,
        from: f64,
        t: f64,
    ) -> Result<(), ModelError> {
        self.t = self.t.max(from);
        if self.last.is_none() {
            let start =
                self.at(integrator, self.t, |dae, t, y, y_dot| dae.energies(t, y, y_dot))?;
            self.initial = start.kinetic + start.elastic;
            self.last = Some(start);
        }
        let h = t - self.t;
        if h > 0.0 {
            let mut at = [Powers::default(); 4];
            for (inner, place) in at.iter_mut().zip(Exchanged::PLACES) {
                let t = (self.t + place * h).max(from);
                *inner = self.at(integrator, t, |dae, t, y, y_dot| dae.powers(t, y, y_dot))??;
            }
            self.exchanged.add(h, &at);
            let end = self.at(integrator, t, |dae, t, y, y_dot| dae.energies(t, y, y_dot))?;
            (self.t, self.last) = (t, Some(end));
        }
        Ok(())
    }

    /// Calls `read` with the body and its state at time `t` within the last step.
    fn at<P: System, R>(
        &mut self,
        integrator: &mut dyn Integrator<P>,
        t: f64,
        read: impl FnOnce(&mut MuscleDae, f64, &[f64], &[f64]) -> R,
    ) -> Result<R, ModelError> {
        let n = integrator.problem().state_len();
        let [y, y_dot] = &mut self.state;
        y.resize(n, 0.0);
        y_dot.resize(n, 0.0);
        integrator.dense_output(t, 0, y)?;
        integrator.dense_output(t, 1, y_dot)?;
        let (dae, range) = muscle_of(integrator.problem_mut(), y)?;
        Ok(read(dae, t, &y[range.clone()], &y_dot[range]))
    }

    /// Returns the values at the time to which the powers have been integrated.
    pub(crate) fn row(&self) -> [f64; 5] {
        let now = self.last.unwrap_or_default();
        let Exchanged { work, dissipated } = self.exchanged;
        let imbalance = self.exchanged.imbalance(&now) - self.initial;
        [now.kinetic, now.elastic, work, dissipated, imbalance]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Regression: a checkpoint with NaN could not be read.
    #[test]
    fn energies_that_are_not_finite_come_back_as_nan() {
        let balance = EnergyBalance {
            initial: f64::NAN,
            last: Some(Energies { kinetic: 1.5, elastic: f64::INFINITY }),
            ..EnergyBalance::default()
        };
        let text = serde_json::to_string(&balance).unwrap();
        let back: EnergyBalance = serde_json::from_str(&text).unwrap();
        assert!(back.initial.is_nan());
        let last = back.last.unwrap();
        assert_eq!(last.kinetic, 1.5);
        assert!(last.elastic.is_nan());
    }
}
