//! Balance of viscous stresses and loads in a body without inertia.

use nalgebra_sparse::CscMatrix;

use super::dynamics::momentum;
use super::motion::{Motion, largest};
use super::saddle::Saddle;
use crate::error::ModelError;
use crate::field::Field;
use crate::muscle_dae::MuscleDae;
use crate::operators;

/// Time over which the elastic response is included, relative to the retardation time. The relative error of the
/// velocity is of the same size. The elastic response determines the velocity of parts without viscosity.
const ELASTIC_TIME: f64 = 1e-7;

/// Corrects the velocity in `y` by v and, for κ = ∞, the pressure by π. The corrections solve
/// `(D + h K) v − Bᵀπ = −f` and `B v = −g`, where D is the damping, K the stiffness, f the unbalanced force and g the
/// rate of volume change. The elastic response is included over the time h. Without damping, for example if the active
/// stress is zero, `y` does not change.
pub(super) fn balance(dae: &mut MuscleDae, t: f64, y: &mut [f64]) -> Result<(), ModelError> {
    let range = |field| dae.layout().range(field);
    let velocity = range(Field::Velocity).expect("all formulations have v");
    let displacement = range(Field::Displacement).expect("all formulations have q");
    let pressure = range(Field::Pressure).filter(|_| dae.muscle().parameters.is_incompressible());
    let rates = vec![0.0; y.len()];
    let force = momentum(dae, t, &[y], &[&rates])?;
    dae.update_matrices(t, y, &rates)?;
    let damping = derivative(dae, Field::Velocity);
    if largest(damping.values()) == 0.0 {
        return Ok(());
    }
    let stiffness = derivative(dae, Field::Displacement);
    let time = ELASTIC_TIME * largest(damping.values()) / largest(stiffness.values());
    let matrix = damping + stiffness * time;
    let negative = |x: &[f64]| -> Vec<f64> { x.iter().map(|x| -x).collect() };
    let motion =
        Motion::new(dae.muscle(), t, &y[displacement], &y[velocity.clone()], &y[velocity.clone()]);
    let (b, flux) = match pressure {
        Some(_) => (motion.divergence()?, motion.volume_residual_rate()?),
        None => (CscMatrix::zeros(0, velocity.len()), Vec::new()),
    };
    let mut saddle = Saddle::factor(&matrix, &b)?;
    let (v, pi) = saddle.solve(&negative(&force), &negative(&flux))?;
    for (sum, v) in y[velocity].iter_mut().zip(&v) {
        *sum += v;
    }
    for (p, pi) in y[pressure.unwrap_or_default()].iter_mut().zip(&pi) {
        *p += pi;
    }
    Ok(())
}

/// Returns the derivative of the force balance with respect to the displacement or velocity.
fn derivative(dae: &MuscleDae, column: Field) -> CscMatrix<f64> {
    let n = dae.muscle().solid.dofs().n_free();
    let terms = dae.terms().into_iter().filter(|(rows, term)| {
        *rows == Field::Velocity && term.column == column && term.df_dy != 0.0
    });
    terms.fold(CscMatrix::zeros(n, n), |sum, (_, term)| {
        let (pattern, _) = dae.pattern_of(term.matrix);
        let values = dae.matrix_values(term.matrix).to_vec();
        sum + operators::matrix(pattern, values) * term.df_dy
    })
}
