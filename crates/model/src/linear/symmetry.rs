//! Whether a reduced matrix is symmetric, and which rows must change sign for that.

use std::collections::HashMap;

use super::Quadratic;
use crate::assembly::Entry;
use crate::matrix::Matrix;

/// The transpose of a matrix among the others; `None` where there is none. The stiffness of added
/// stresses counts as symmetric: where it is not, its symmetric part is asked about.
fn transposed(matrix: Matrix) -> Option<Matrix> {
    match matrix {
        Matrix::DisplacementIdentity
        | Matrix::PressureIdentity
        | Matrix::Mass
        | Matrix::DampingMass
        | Matrix::PressureMass
        | Matrix::Stiffness
        | Matrix::MultiplierStiffness
        | Matrix::BedStiffness
        | Matrix::BedDamping
        | Matrix::AddedStiffness
        | Matrix::AddedSymmetricStiffness
        | Matrix::AddedDamping
        | Matrix::RelaxingGeometric
        | Matrix::RelaxingStiffness(_) => Some(matrix),
        Matrix::Divergence => Some(Matrix::DivergenceTransposed),
        Matrix::DivergenceTransposed => Some(Matrix::Divergence),
        Matrix::DivergenceRate => Some(Matrix::DivergenceRateTransposed),
        Matrix::DivergenceRateTransposed => Some(Matrix::DivergenceRate),
        Matrix::RateStiffness
        | Matrix::DampedStiffness
        | Matrix::DampedDivergenceTransposed
        | Matrix::DampedDivergenceRateTransposed
        | Matrix::PressureStiffness
        | Matrix::CoherenceStiffness
        | Matrix::CoherenceDamping
        | Matrix::TensionForce
        | Matrix::TensionIdentity
        | Matrix::TensionDecay => None,
    }
}

/// The signs, by the first row of each block, that make the matrix of these `entries` symmetric for
/// each c, the first block keeping its own; `None` if no signs do.
pub(super) fn symmetric_signs(entries: &[Entry<Quadratic>]) -> Option<HashMap<usize, f64>> {
    let mut sums: HashMap<(usize, usize, Matrix), [f64; 3]> = HashMap::new();
    for entry in entries {
        let at = (entry.rows.start, entry.columns.start, entry.matrix);
        let sum = sums.entry(at).or_default();
        for (sum, p) in sum.iter_mut().zip(entry.coefficient.0) {
            *sum += p;
        }
    }
    sums.retain(|_, sum| *sum != [0.0; 3]);
    let mut known = HashMap::from([(0, 1.0)]);
    let mut pending = vec![0];
    while let Some(row) = pending.pop() {
        for (&(_, column, matrix), sum) in sums.iter().filter(|((r, ..), _)| *r == row) {
            let mirrored = sums.get(&(column, row, transposed(matrix)?))?;
            let ratio = if mirrored == sum {
                1.0
            } else if mirrored.map(|p| -p) == *sum {
                -1.0
            } else {
                return None;
            };
            let sign = known[&row] * ratio;
            match known.insert(column, sign) {
                None => pending.push(column),
                Some(before) if before != sign => return None,
                Some(_) => {}
            }
        }
    }
    Some(known)
}
