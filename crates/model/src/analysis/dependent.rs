//! Pressures of an incompressible body whose volume conditions are implied by other conditions.

use std::sync::Arc;

use myovib_fem::{DofMap, Law, Solid, Space};
use myovib_sparse::{
    Elimination, Kind, LinearWork, Precision, SparseOptions, SparseSystem, Structure,
};
use nalgebra_sparse::{CooMatrix, CscMatrix};

use crate::error::ModelError;
use crate::operators::{divergence, rest};

/// Value added to the unit diagonal of the Gram matrix, so that rounding errors do not dominate the pivots of
/// dependent rows.
const SHIFT: f64 = 1e-12;
/// Pivot of the Gram matrix below which a row counts as dependent. Pressures that vary slowly over the body have
/// pivots above (h/L)² for elements of size h and a body of length L.
const DEPENDENT: f64 = 1e-10;
/// Column sum of B, relative to the largest entry of B, below which a constant pressure does no work.
const ROUNDING: f64 = 1e-9;

/// Returns the pressures whose rows of B at rest are linear combinations of the rows of pressures eliminated earlier.
/// If the whole boundary is fixed, one additional row is dependent; the last dependent pressure is then not returned.
///
/// The rows are compared by a Cholesky factorization of B̂B̂ᵀ scaled to a unit diagonal. B̂ is B with columns scaled
/// to unit length.
///
/// # Errors
/// Returns [`ModelError::Fem`] if the body cannot be built, and [`ModelError::Factorization`] if the factorization
/// fails.
pub fn dependent_pressures(space: &Arc<Space>, dofs: &DofMap) -> Result<Vec<usize>, ModelError> {
    // B at rest does not depend on the law.
    let law = Law::SmallStrain { shear_modulus: 1.0 };
    let solid = Solid::uniform(space.clone(), dofs.clone(), law, 1.0)?;
    let b = divergence(&solid, &rest(&solid))?;
    let pivots = pivots(gram(&b))?.unwrap_or_default();
    let mut dependent: Vec<usize> = (0..pivots.len()).filter(|&i| pivots[i] < DEPENDENT).collect();
    if has_no_level(&b) {
        dependent.pop();
    }
    Ok(dependent)
}

/// Returns whether a constant pressure does no work on any free displacement: ∫ div φ = 0.
pub(super) fn has_no_level(divergence: &CscMatrix<f64>) -> bool {
    let sums = divergence.col_iter().map(|column| {
        let values = column.values();
        let largest = values.iter().fold(0.0_f64, |largest, b| largest.max(b.abs()));
        (values.iter().sum::<f64>().abs(), largest)
    });
    let (net, largest) = sums
        .fold((0.0_f64, 0.0_f64), |(net, max), (sum, largest)| (net.max(sum), max.max(largest)));
    net <= ROUNDING * largest
}

/// Returns B̂B̂ᵀ scaled to a unit diagonal, plus `SHIFT` on the diagonal.
fn gram(b: &CscMatrix<f64>) -> CscMatrix<f64> {
    let mut unit = b.clone();
    for mut column in unit.col_iter_mut() {
        let length = column.values().iter().map(|b| b * b).sum::<f64>().sqrt();
        column.values_mut().iter_mut().filter(|b| **b != 0.0).for_each(|b| *b /= length);
    }
    let product = &unit * &unit.transpose();
    let mut diagonal = vec![0.0; product.nrows()];
    for (i, j, value) in product.triplet_iter().filter(|(i, j, _)| i == j) {
        diagonal[i.max(j)] = *value;
    }
    let mut scaled = CooMatrix::new(product.nrows(), product.ncols());
    for (i, j, value) in product.triplet_iter() {
        let shift = if i == j { SHIFT } else { 0.0 };
        scaled.push(i, j, value / (diagonal[i] * diagonal[j]).sqrt() + shift);
    }
    CscMatrix::from(&scaled)
}

/// Returns the pivot of each row of a symmetric matrix, or `None` if the sparse solver does not provide the pivots.
fn pivots(matrix: CscMatrix<f64>) -> Result<Option<Vec<f64>>, ModelError> {
    let structure = Structure { kind: Kind::Symmetric, ..Structure::default() };
    let options = SparseOptions { precision: Precision::Double, ..SparseOptions::default() };
    let elimination = Elimination::new(matrix.pattern(), structure, options)?;
    elimination.expect_memory()?;
    let mut system = SparseSystem::new(Arc::new(elimination));
    system.values_mut().copy_from_slice(matrix.values());
    system.renew(&mut LinearWork::default())?;
    Ok(system.pivots())
}
