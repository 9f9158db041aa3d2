//! Runs that show progress and can be interrupted.

use myovib_model::{Integrator, Limits, ModelError, Observer, Statistics, run};

use crate::interrupt;
use crate::progress::Progress;
use myovib_scene::watch::Watch;

/// Runs until `t_end` (s), a stop condition, or Ctrl-C. Shows the progress under the name `name`.
pub(crate) fn run_watched<P>(
    integrator: &mut dyn Integrator<P>,
    observer: &mut dyn Observer<P>,
    (name, t_end): (&str, f64),
    progress: &Progress,
) -> Result<Statistics, ModelError> {
    let mut watch = Watch::new(name.to_owned(), t_end, progress);
    let mut limits = Limits::new(f64::INFINITY, Some(interrupt::flag()));
    run(integrator, &mut [observer, &mut watch, &mut limits])
}
