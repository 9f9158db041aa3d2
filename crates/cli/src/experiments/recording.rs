//! A body's motion, integrated once and kept for the chains that follow it.

use std::sync::Arc;

use myovib_dae::Problem;
use myovib_model::coupling::{Recorder, Recording};
use myovib_model::{Displacement, Integrator, Outcome};

use super::{Course, run_watched};

/// Runs a body to the end and keeps the motion of `point`.
///
/// # Errors
/// A run that does not reach its end.
pub(super) fn record<P: Problem>(
    integrator: &mut dyn Integrator<P>,
    name: &str,
    point: Displacement,
    course: Course,
) -> anyhow::Result<Arc<Recording>> {
    let mut recorder = Recorder::new(point, integrator.problem().n_unknowns());
    let end = (name, course.t_end);
    let statistics = run_watched(integrator, &mut recorder, end, course.progress)?;
    if let Outcome::Stopped { message, .. } = statistics.outcome {
        anyhow::bail!("{name} stopped: {message}");
    }
    Ok(Arc::new(recorder.finish()))
}
