//! Harmonic response of any differential-algebraic system.

use std::sync::Arc;

use myovib_dae::Problem;
use myovib_sparse::{Elimination, LinearWork, SparseOptions, SparseSystem, Structure};
use num_complex::Complex64;

use crate::error::StructureError;

/// Solves (∂F/∂y + s ∂F/∂ẏ) ŷ = f̂ in place for the linearization of `problem` at (t, y, 0). The result is the
/// motion y + Re(ŷ e^{st}) under the load Re(f̂ e^{st}), with s = iω. The system may have any index.
///
/// # Shapes
/// `amplitudes` has one entry per unknown: f̂ on entry, ŷ on return.
///
/// # Errors
/// Returns [`StructureError::Linearize`] if the Jacobian cannot be evaluated, and [`StructureError::Factorize`] if
/// the matrix is singular.
///
/// # Panics
/// Panics if a length is wrong.
pub fn harmonic_response(
    problem: &mut dyn Problem,
    (t, y): (f64, &[f64]),
    s: Complex64,
    amplitudes: &mut [Complex64],
) -> Result<(), StructureError> {
    let pattern = problem.jacobian_pattern();
    let rest = vec![0.0; y.len()];
    let (mut by_y, mut by_rate) = (vec![0.0; pattern.nnz()], vec![0.0; pattern.nnz()]);
    problem
        .jacobian_parts(t, y, &rest, [&mut by_y, &mut by_rate])
        .map_err(|source| StructureError::Linearize { t, source })?;
    let options = SparseOptions { btf: false, ..SparseOptions::default() };
    let elimination = Elimination::new(&pattern, Structure::default(), options)?;
    let mut system = SparseSystem::new(Arc::new(elimination));
    let values = system.values_mut().iter_mut().zip(by_y.iter().zip(&by_rate));
    for (value, (by_y, by_rate)) in values {
        *value = by_y + s * by_rate;
    }
    let mut work = LinearWork::default();
    system.renew(&mut work)?;
    system.solve(amplitudes, &mut work)?;
    Ok(())
}
