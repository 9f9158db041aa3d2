//! Predicted cost of a step whose matrices are too large for trial steps.

use myovib_dae::Problem;
use myovib_sparse::Prediction;

use crate::analysis::speed::Speed;
use crate::cpu::CpuClock;
use crate::error::ModelError;
use crate::integration::settings::Settings;
use crate::muscle_dae::MuscleDae;

/// Matrix setups, matrix evaluations and Newton iterations per step of Radau IIA, measured on the coarse ventricle,
/// whose stiffness changes throughout the motion.
const OF_RADAU: [f64; 3] = [0.8, 0.4, 3.2];
/// Matrix setups, matrix evaluations and Newton iterations per step of BDF, measured on row 1 of Table 2.
const OF_BDF: [f64; 3] = [0.13, 0.13, 1.6];

/// Predicts the CPU time (s) of a step that starts at `y` and `y_dot`. The prediction is based on the cost of the
/// matrices and the speed of this machine.
pub(super) fn step(
    dae: &mut MuscleDae,
    settings: &Settings,
    needs: Prediction,
    [y, y_dot]: [&[f64]; 2],
) -> Result<f64, ModelError> {
    let stages = settings.integrator.stages();
    let speed = Speed::measure(stages.is_some_and(|stages| stages > 1))?;
    let [set_ups, evaluations, iterations] = match stages {
        Some(_) => OF_RADAU,
        None => OF_BDF,
    };
    let mut residual = vec![0.0; y.len()];
    let clock = CpuClock::start();
    dae.residual(0.0, y, y_dot, &mut residual)?;
    let residual = clock.elapsed().as_secs_f64();
    let clock = CpuClock::start();
    dae.update_matrices(0.0, y, y_dot)?;
    let matrices = clock.elapsed().as_secs_f64();
    let residuals = stages.unwrap_or(1) as f64 * residual;
    Ok(set_ups * needs.flops / speed.operations
        + evaluations * matrices
        + iterations * (residuals + needs.entries as f64 / speed.entries))
}
