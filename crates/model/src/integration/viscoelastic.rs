//! Radau IIA for a muscle with Prony terms, whose internal stresses are internal variables of the
//! integrator.

use myovib_dae::{Suppressed, Tolerances};
use myovib_radau::RadauOptions;

use crate::error::ModelError;
use crate::field::Field;
use crate::integration::integrator::{Advance, Continuation, Integrator};
use crate::integration::radau::{RadauIntegrator, options};
use crate::integration::settings::Settings;
use crate::integration::statistics::Counts;
use crate::linear::CondensedSolver;
use crate::muscle_dae::{InternalVariableDae, MuscleDae};

/// An integrator whose vectors contain all unknowns of the muscle, while the vectors of its solver
/// exclude internal stresses.
pub(crate) struct ViscoelasticRadau(RadauIntegrator<InternalVariableDae, CondensedSolver>);

impl ViscoelasticRadau {
    /// Starts a muscle with Prony terms at time `t` from a state with consistent derivatives.
    ///
    /// # Errors
    /// Returns [`ModelError::OnlyBdf`] for settings that only BDF supports, and [`ModelError::Radau`] if a setting of
    /// Radau IIA is invalid.
    pub(crate) fn starting_at(
        dae: MuscleDae,
        settings: &Settings,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
    ) -> Result<Self, ModelError> {
        settings.expect_no_bdf_settings()?;
        let schedule = dae.muscle().schedule();
        let of_all = options(&dae, settings);
        let absolute = settings.absolute_tolerances.of(Field::InternalStress);
        let (problem, variables) = InternalVariableDae::new(dae, y, absolute);
        let n = y.len() - variables.start.len();
        let (dae, relative) = (problem.dae(), settings.relative_tolerance);
        let absolute = dae.layout().fill(|field| settings.absolute_tolerances.of(field));
        let options = RadauOptions {
            tolerances: Tolerances::vector(relative, &absolute[..n]),
            suppressed: Suppressed::Components(settings.excluded(dae.layout())[..n].to_vec()),
            ..of_all
        };
        let matrices = CondensedSolver::without_recovery(problem.dae(), options.sparse)?;
        let (times, start) = ((t, settings.t_end), (&y[..n], &y_dot[..n]));
        let inner = RadauIntegrator::with_internal_variables(
            problem, matrices, options, times, start, variables,
        )?;
        Ok(Self(inner.with_schedule(schedule)))
    }
}

impl Integrator<MuscleDae> for ViscoelasticRadau {
    fn pass_jump(&mut self) -> Result<(), ModelError> {
        if self.0.after_jump().is_some() {
            let solver = self.0.solver();
            let mut internal = vec![0.0; solver.n_internal_variables()];
            solver.internal_variables_dense_output(solver.t(), 0, &mut internal)?;
            self.0.problem_mut().keep(internal);
        }
        self.0.pass_jump()
    }

    fn advance(&mut self) -> Result<Advance, ModelError> {
        self.pass_jump()?;
        self.0.advance()
    }

    fn time(&self) -> f64 {
        self.0.time()
    }

    fn dense_output(&mut self, t: f64, derivative: u32, out: &mut [f64]) -> Result<(), ModelError> {
        let solver = self.0.solver();
        let (body, internal) = out.split_at_mut(out.len() - solver.n_internal_variables());
        solver.dense_output(t, derivative as usize, body)?;
        Ok(solver.internal_variables_dense_output(t, derivative as usize, internal)?)
    }

    fn counts(&self) -> Counts {
        self.0.counts()
    }

    fn save(&self) -> Option<Continuation> {
        self.0.save()
    }

    fn restore(&mut self, continuation: &Continuation) -> Result<(), ModelError> {
        self.0.restore(continuation)
    }

    fn problem(&self) -> &MuscleDae {
        self.0.problem().dae()
    }

    fn problem_mut(&mut self) -> &mut MuscleDae {
        self.0.problem_mut().dae_mut()
    }
}
