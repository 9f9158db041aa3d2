//! Energy balance of a run.

use myovib_model::{Energies, Integrator, ModelError};
use serde::{Deserialize, Serialize};

use crate::energy::Exchanged;
use crate::run::system::{System, muscle_of};

/// Energies, and work and dissipation since the start.
///
/// Powers are integrated over each accepted step (and each part of it between samples) by the
/// quadrature rule of [`Exchanged`] on the dense output.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(crate) struct EnergyBalance {
    t: f64,
    /// Kinetic and elastic energy at the start, J.
    initial: f64,
    last: Option<Energies>,
    exchanged: Exchanged,
    /// Workspace for y and ẏ.
    #[serde(skip)]
    state: [Vec<f64>; 2],
}

impl EnergyBalance {
    /// Names of the columns.
    pub(crate) const NAMES: [&'static str; 5] =
        ["kinetic", "elastic", "work", "dissipated", "imbalance"];

    /// Integrates up to time `t` within the last step, which began at `from`.
    pub(crate) fn advance<P: System>(
        &mut self,
        integrator: &mut dyn Integrator<P>,
        from: f64,
        t: f64,
    ) -> Result<(), ModelError> {
        let start = match self.last {
            // Powers may change in a jump.
            Some(_) if self.t < from => self.energies_at(integrator, from)?,
            Some(energies) => energies,
            None => {
                let start = self.energies_at(integrator, self.t.max(from))?;
                self.initial = start.kinetic + start.elastic;
                start
            }
        };
        self.t = self.t.max(from);
        self.last = Some(start);
        let h = t - self.t;
        if h > 0.0 {
            let [mut a, mut b, mut c] = [start; 3];
            for (inner, place) in [&mut a, &mut b, &mut c].into_iter().zip(Exchanged::PLACES) {
                *inner = self.energies_at(integrator, (self.t + place * h).max(from))?;
            }
            let end = self.energies_at(integrator, t)?;
            let at = [&start, &a, &b, &c, &end];
            self.exchanged.add(h, Exchanged::WEIGHTS, at);
            (self.t, self.last) = (t, Some(end));
        }
        Ok(())
    }

    fn energies_at<P: System>(
        &mut self,
        integrator: &mut dyn Integrator<P>,
        t: f64,
    ) -> Result<Energies, ModelError> {
        let n = integrator.problem().n_unknowns();
        let [y, y_dot] = &mut self.state;
        y.resize(n, 0.0);
        y_dot.resize(n, 0.0);
        integrator.dense_output(t, 0, y)?;
        integrator.dense_output(t, 1, y_dot)?;
        let (dae, range) = muscle_of(integrator.problem_mut(), y)?;
        dae.energies(t, &y[range.clone()], &y_dot[range])
    }

    /// Returns the values at the time reached.
    pub(crate) fn row(&self) -> [f64; 5] {
        let now = self.last.unwrap_or_default();
        let Exchanged { work, dissipated } = self.exchanged;
        let imbalance = self.exchanged.imbalance(&now) - self.initial;
        [now.kinetic, now.elastic, work, dissipated, imbalance]
    }
}
