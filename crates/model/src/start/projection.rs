//! Projection of displacements and velocities onto the incompressibility constraint.

use myovib_fem::Solid;

use super::motion::{Motion, largest};
use super::saddle::Saddle;
use crate::analysis::support::extent;
use crate::error::ModelError;
use crate::muscle::Muscle;
use crate::operators;

/// Maximum number of iterations. Near a solution, Newton's method converges in about five.
const MAX_ITERATIONS: usize = 30;
/// Newton's method has converged if the projected volume residual is below this value and does not decrease any
/// further. Rounding errors leave a residual of about 1e-16 times the number of terms. With index 3, a larger residual
/// would be amplified at the first step.
const CONVERGED: f64 = 1e-7;

/// Computes a displacement with ∫ψ g(J) = 0 close to `q` in the H1 seminorm, which spreads the
/// correction without adding unnecessary strain.
pub(super) fn displacement(muscle: &Muscle, t: f64, q: &[f64]) -> Result<Vec<f64>, ModelError> {
    let solid = &muscle.solid;
    let norm = operators::gradients(solid);
    let rest = vec![0.0; q.len()];
    let mut q = q.to_vec();
    let mut last = f64::INFINITY;
    for _ in 0..MAX_ITERATIONS {
        let motion = Motion::new(muscle, t, &q, &rest, &rest);
        let volume_residual = motion.volume_residual()?;
        let size = largest_projected(solid, &volume_residual);
        let rounding = f64::EPSILON * largest(&motion.displacement) / extent(muscle);
        // Newton's last step reduces the residual to rounding errors, after which it does not decrease any further.
        if size <= rounding || (size < CONVERGED && size >= 0.5 * last) {
            return Ok(q);
        }
        last = size;
        let flux: Vec<f64> = volume_residual.iter().map(|d| -d).collect();
        let (correction, _) = Saddle::factor(&norm, &motion.divergence()?)?.solve(&rest, &flux)?;
        for (q, correction) in q.iter_mut().zip(correction) {
            *q += correction;
        }
    }
    Err(ModelError::NotIncompressible { volume_residual: last })
}

/// Computes the velocity with ∫ψ g' cof F:∇v = 0 that is nearest to `v` in the norm of the kinetic
/// energy, by subtracting the pressure's impulse.
pub(super) fn velocity(
    muscle: &Muscle,
    t: f64,
    q: &[f64],
    v: &[f64],
) -> Result<Vec<f64>, ModelError> {
    let rest = vec![0.0; q.len()];
    let mut v = v.to_vec();
    let b = Motion::new(muscle, t, q, &v, &rest).divergence()?;
    let mut saddle = Saddle::factor(&operators::mass(&muscle.solid), &b)?;
    // The second pass removes rounding errors of the first.
    for _pass in 0..2 {
        let motion = Motion::new(muscle, t, q, &v, &rest);
        let flux: Vec<f64> = motion.volume_residual_rate()?.iter().map(|d| -d).collect();
        let (correction, _) = saddle.solve(&rest, &flux)?;
        for (v, correction) in v.iter_mut().zip(correction) {
            *v += correction;
        }
    }
    Ok(v)
}

/// Returns the maximum of |∫ψ_k …| / ∫ψ_k over all ψ_k.
fn largest_projected(solid: &Solid, volume_residual: &[f64]) -> f64 {
    let projected: Vec<f64> = volume_residual
        .iter()
        .zip(solid.pressure_weights())
        .map(|(volume_residual, weight)| volume_residual / weight)
        .collect();
    largest(&projected)
}
