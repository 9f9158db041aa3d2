//! Radau IIA with recorded steps, for gradients with respect to the stiffness of each element.

use myovib_radau::{Adjoint, AdjointWork, RadauError, Recording};

use super::integrator::expect_no_jump;
use super::stiffness::ElementStiffness;
use crate::coupling::SystemMatrices;
use crate::error::ModelError;
use crate::integration::integrator::{Advance, Integrator, forward_to_inner};
use crate::integration::radau::RadauIntegrator;
use crate::integration::settings::Settings;
use crate::muscle_dae::MuscleDae;

/// A muscle integrated by Radau IIA from t = 0 with checkpoints. The discrete adjoint replays the steps backward from
/// these checkpoints.
pub struct RecordedIntegrator {
    inner: RadauIntegrator<MuscleDae, SystemMatrices<MuscleDae>>,
    recording: Recording,
}

/// The sum Σ_i c_i u(t_i), where u = Σ_k w_k y_k is a linear combination of unknowns.
#[derive(Debug, Clone, Copy)]
pub struct LinearMisfit<'a> {
    /// The unknowns and their weights w.
    pub unknowns: &'a [(usize, f64)],
    /// Ascending times t_i (s), each with the weight c_i of the value at this time.
    pub samples: &'a [(f64, f64)],
}

impl RecordedIntegrator {
    /// Starts the integration of a muscle at t = 0 from a state with consistent derivatives. The state must not depend
    /// on the stiffness of the muscle.
    ///
    /// # Errors
    /// [`ModelError::Jump`] if a load jumps, [`ModelError::OnlyBdf`] if a setting is available only for BDF,
    /// [`ModelError::Radau`] if a setting of Radau IIA is invalid or the muscle has internal variables.
    pub fn starting_at(
        dae: MuscleDae,
        settings: &Settings,
        [y, y_dot]: [&[f64]; 2],
    ) -> Result<Self, ModelError> {
        expect_no_jump(&dae, settings.t_end)?;
        let inner = RadauIntegrator::starting_at(dae, settings, 0.0, y, y_dot)?;
        let recording = Recording::of_checkpoints(inner.solver())?;
        Ok(Self { inner, recording })
    }

    /// Returns the derivative of a misfit with respect to a factor of the law's stress in each element, for the
    /// recorded steps. `on_progress` is called before each step of the backward pass and returns whether to continue.
    ///
    /// # Errors
    /// [`ModelError::Radau`] for errors of the [adjoint](Adjoint::gradient) and for an interruption by `on_progress`.
    pub fn by_stiffness(
        &mut self,
        misfit: LinearMisfit<'_>,
        on_progress: &mut dyn FnMut(f64) -> bool,
    ) -> Result<(Vec<f64>, AdjointWork), ModelError> {
        let solver = self.inner.solver_mut();
        let stiffness = ElementStiffness::new(solver.problem());
        let mut cotangent = vec![0.0; solver.y().len()];
        let mut adjoint = Adjoint::new(solver, stiffness);
        let gradient = adjoint.gradient(solver, &self.recording, &mut |step| {
            let [t, end] = step.interval();
            if !on_progress(t) {
                let message = "the backward pass was interrupted".to_owned();
                return Err(RadauError::Adjoint { t, message });
            }
            let later = misfit.samples.partition_point(|(at, _)| *at < t);
            for &(t, share) in misfit.samples[later..].iter().take_while(|(t, _)| *t <= end) {
                if !step.covers(t) {
                    continue;
                }
                cotangent.fill(0.0);
                for &(unknown, weight) in misfit.unknowns {
                    cotangent[unknown] += share * weight;
                }
                step.add(t, 0, &cotangent);
            }
            Ok(())
        })?;
        Ok((gradient.parameters, adjoint.work()))
    }
}

impl Integrator<MuscleDae> for RecordedIntegrator {
    forward_to_inner!(MuscleDae);

    fn advance(&mut self) -> Result<Advance, ModelError> {
        let advance = self.inner.advance()?;
        self.recording.follow(self.inner.solver_mut())?;
        Ok(advance)
    }
}
