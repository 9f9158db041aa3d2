//! Radau IIA whose steps are kept, for gradients by the stiffness of each element.

use myovib_radau::{Adjoint, AdjointWork, RadauError, Recording};

use super::integrator::expect_no_jump;
use super::stiffness::ElementStiffness;
use crate::error::ModelError;
use crate::integration::integrator::{Advance, Integrator, left_to_inner};
use crate::integration::radau::{MuscleMatrices, RadauIntegrator};
use crate::integration::settings::Settings;
use crate::muscle_dae::MuscleDae;

/// A muscle, integrated by Radau IIA from t = 0 on, with checkpoints from which the discrete adjoint takes
/// its steps back.
pub struct RecordedIntegrator {
    inner: RadauIntegrator<MuscleDae, MuscleMatrices>,
    recording: Recording,
}

/// A sum Σ_i c_i u(t_i) of what is a sum of unknowns, u = Σ_k w_k y_k.
#[derive(Debug, Clone, Copy)]
pub struct LinearMisfit<'a> {
    /// The unknowns and their weights w.
    pub unknowns: &'a [(usize, f64)],
    /// The times, s, which ascend, and the weights c of the values then.
    pub samples: &'a [(f64, f64)],
}

impl RecordedIntegrator {
    /// Starts a muscle at t = 0 from a state with consistent derivatives, which does not depend on its
    /// stiffness.
    ///
    /// # Errors
    /// [`ModelError::Jump`], [`ModelError::OnlyBdf`], and [`ModelError::Radau`] for settings Radau IIA does not take
    /// or a muscle with a fading memory.
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

    /// The derivative of a misfit by a factor of the law's stress in each element, at the steps that were taken.
    /// `tell` hears the beginning of each step on the way back, and says whether to go on.
    ///
    /// # Errors
    /// [`ModelError::Radau`]: those of the [adjoint](Adjoint::gradient), and when it is not to go on.
    pub fn by_stiffness(
        &mut self,
        misfit: LinearMisfit<'_>,
        tell: &mut dyn FnMut(f64) -> bool,
    ) -> Result<(Vec<f64>, AdjointWork), ModelError> {
        let solver = self.inner.solver_mut();
        let stiffness = ElementStiffness::new(solver.problem());
        let mut cotangent = vec![0.0; solver.y().len()];
        let mut adjoint = Adjoint::new(solver, stiffness);
        let gradient = adjoint.gradient(solver, &self.recording, &mut |step| {
            let [t, end] = step.interval();
            if !tell(t) {
                let message = "it was interrupted".to_owned();
                return Err(RadauError::Adjoint { t, message });
            }
            let later = misfit.samples.partition_point(|(at, _)| *at < t);
            for &(t, share) in misfit.samples[later..]
                .iter()
                .take_while(|(t, _)| *t <= end)
            {
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
    left_to_inner!(MuscleDae);

    fn advance(&mut self) -> Result<Advance, ModelError> {
        let advance = self.inner.advance()?;
        self.recording.follow(self.inner.solver_mut())?;
        Ok(advance)
    }
}
