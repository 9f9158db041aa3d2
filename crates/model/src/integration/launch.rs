//! Starts a muscle with the integrator selected in its settings.

use myovib_dae::Problem;

use crate::advice::{Advice, Advised};
use crate::error::ModelError;
use crate::integration::ida::IdaIntegrator;
use crate::integration::integrator::Integrator;
use crate::integration::projected::Projected;
use crate::integration::radau::RadauIntegrator;
use crate::integration::settings::{LinearSolverKind, Settings};
use crate::integration::viscoelastic::ViscoelasticRadau;
use crate::muscle_dae::MuscleDae;

/// Starts a muscle at rest at t = 0 with the integrator selected in `settings`. If the
/// integration stops early, its message includes advice on the index.
///
/// # Errors
/// Returns an error if the integrator does not support a setting.
pub fn start_at_rest(
    dae: MuscleDae,
    settings: &Settings,
) -> Result<Box<dyn Integrator<MuscleDae>>, ModelError> {
    let zero = vec![0.0; dae.n_unknowns()];
    start_from(dae, settings, 0.0, &zero, &zero)
}

/// Starts a muscle at time `t` from a state with consistent derivatives, with the integrator
/// selected in `settings`.
///
/// # Errors
/// Returns an error if the integrator does not support a setting.
pub fn start_from(
    dae: MuscleDae,
    settings: &Settings,
    t: f64,
    y: &[f64],
    y_dot: &[f64],
) -> Result<Box<dyn Integrator<MuscleDae>>, ModelError> {
    let advice = Advice::new(dae.muscle(), dae.formulation(), settings);
    let relaxes = dae.muscle().solid.n_internal() > 0;
    let integrator: Box<dyn Integrator<MuscleDae>> = match settings.integrator.stages() {
        None => {
            let ida = IdaIntegrator::starting_at(dae, settings, t, y, y_dot)?;
            match settings.projection_interval {
                Some(every) => Box::new(Projected::new(ida, every)?),
                None => Box::new(ida),
            }
        }
        Some(_) if relaxes && settings.linear_solver == LinearSolverKind::Condensed => {
            Box::new(ViscoelasticRadau::starting_at(dae, settings, t, y, y_dot)?)
        }
        Some(_) => Box::new(RadauIntegrator::starting_at(dae, settings, t, y, y_dot)?),
    };
    Ok(Box::new(Advised::new(integrator, advice)))
}
