//! Radau IIA with forward sensitivities, for a muscle.

use myovib_dae::Problem;
use myovib_radau::{ForwardSensitivities, SensitivityWork};

use super::dependence::Dependences;
use crate::error::ModelError;
use crate::integration::integrator::{Advance, Integrator, left_to_inner};
use crate::integration::radau::{MuscleMatrices, RadauIntegrator};
use crate::integration::settings::Settings;
use crate::muscle_dae::MuscleDae;

/// What is read off a muscle in a state (t, y, ẏ).
pub type Reading<'a> =
    dyn FnMut(&mut MuscleDae, f64, &[f64], &[f64]) -> Result<Vec<f64>, ModelError> + 'a;

/// A muscle, integrated by Radau IIA from t = 0 on together with ∂y/∂p.
pub struct SensitiveIntegrator {
    inner: RadauIntegrator<MuscleDae, MuscleMatrices>,
    sensitivities: ForwardSensitivities<Dependences>,
}

impl SensitiveIntegrator {
    /// Starts a muscle at t = 0 from a state with consistent derivatives, which the `dependences` know
    /// how it moves with their parameters; without any it is a plain integration.
    ///
    /// # Errors
    /// [`ModelError::Jump`], [`ModelError::OnlyBdf`], and [`ModelError::Radau`] for settings Radau IIA does not take.
    pub fn starting_at(
        dae: MuscleDae,
        settings: &Settings,
        [y, y_dot]: [&[f64]; 2],
        dependences: Dependences,
    ) -> Result<Self, ModelError> {
        let jump = dae.muscle().schedule().next_jump(-settings.t_end);
        let follows = dependences.count() > 0;
        if let Some(t) = jump.filter(|t| follows && *t < settings.t_end) {
            return Err(ModelError::Jump { t });
        }
        let starts = dependences.starts(dae.n_unknowns());
        let inner = RadauIntegrator::starting_at(dae, settings, 0.0, y, y_dot)?;
        let sensitivities = ForwardSensitivities::new(inner.solver(), dependences, starts)?;
        Ok(Self {
            inner,
            sensitivities,
        })
    }

    /// Solves for the sensitivities to this fraction of what an error of theirs may be.
    #[must_use]
    pub fn with_tolerance(self, tolerance: f64) -> Self {
        Self {
            sensitivities: self.sensitivities.with_tolerance(tolerance),
            ..self
        }
    }

    /// Chooses steps by the sensitivities' errors too.
    #[must_use]
    pub fn controlling_steps(self) -> Self {
        let sensitivities = self.sensitivities.controlling_steps(self.inner.solver());
        Self {
            sensitivities,
            ..self
        }
    }

    /// What the sensitivities cost beside the integration.
    pub fn work(&self) -> SensitivityWork {
        self.sensitivities.work()
    }

    /// What is read at a time within the last step.
    ///
    /// # Errors
    /// Those of the reading, and of a time outside of the step.
    pub fn read(&mut self, t: f64, read: &mut Reading<'_>) -> Result<Vec<f64>, ModelError> {
        let [y, y_dot] = self.state(t)?;
        read(self.inner.problem_mut(), t, &y, &y_dot)
    }

    /// The derivative with respect to parameter j of what is read at a time within the last step:
    /// through the state by a central difference along ∂y/∂p, and of the reading itself. `own` is
    /// the reading.
    ///
    /// # Errors
    /// As for [`read`](Self::read).
    ///
    /// # Panics
    /// If there is no such parameter.
    pub fn derivative(
        &mut self,
        j: usize,
        t: f64,
        own: &[f64],
        read: &mut Reading<'_>,
    ) -> Result<Vec<f64>, ModelError> {
        let [y, y_dot] = self.state(t)?;
        let n = y.len();
        let mut s = [vec![0.0; n], vec![0.0; n]];
        for (derivative, s) in s.iter_mut().enumerate() {
            self.sensitivities
                .dense_output(self.inner.solver(), j, t, derivative, s)?;
        }
        let dependence = self.sensitivities.parameters_mut().get_mut(j);
        // p̄ S has the size of y, of which ε^(1/3) balances truncation and rounding; most readings
        // are linear.
        let delta = f64::EPSILON.cbrt() * dependence.parameter().scale;
        let mut total = dependence.of_reading(own, &mut |twin| read(twin, t, &y, &y_dot))?;
        for sign in [1.0, -1.0] {
            let moved = |of: &[f64], s: &[f64]| -> Vec<f64> {
                of.iter()
                    .zip(s)
                    .map(|(y, s)| y + sign * delta * s)
                    .collect()
            };
            let (y, y_dot) = (moved(&y, &s[0]), moved(&y_dot, &s[1]));
            let values = read(self.inner.problem_mut(), t, &y, &y_dot)?;
            for (total, value) in total.iter_mut().zip(values) {
                *total += sign * value / (2.0 * delta);
            }
        }
        Ok(total)
    }

    fn state(&mut self, t: f64) -> Result<[Vec<f64>; 2], ModelError> {
        let n = self.inner.problem().n_unknowns();
        let mut state = [vec![0.0; n], vec![0.0; n]];
        for (derivative, out) in state.iter_mut().enumerate() {
            self.inner.dense_output(t, derivative as u32, out)?;
        }
        Ok(state)
    }
}

impl Integrator<MuscleDae> for SensitiveIntegrator {
    left_to_inner!(MuscleDae);

    fn advance(&mut self) -> Result<Advance, ModelError> {
        let advance = self.inner.advance()?;
        self.sensitivities.follow(self.inner.solver_mut())?;
        Ok(advance)
    }
}
