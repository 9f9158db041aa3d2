//! Symmetry of a reduced matrix, and the row signs that make it symmetric.

use std::collections::HashMap;

use super::Quadratic;
use crate::assembly::Entry;
use crate::matrix::Matrix;

/// Returns the row signs that make the matrix of these `entries` symmetric for every c. The signs are indexed by the
/// first row of each block, and the sign of the first block is positive. Returns `None` if there are no such signs.
pub(super) fn symmetric_signs(entries: &[Entry<Quadratic>]) -> Option<HashMap<usize, f64>> {
    signs_of(&sums(entries), |matrix| matrix.properties().transpose)
}

/// Returns the nonzero coefficients by row, column and matrix.
fn sums(entries: &[Entry<Quadratic>]) -> HashMap<(usize, usize, Matrix), [f64; 3]> {
    let mut sums: HashMap<(usize, usize, Matrix), [f64; 3]> = HashMap::new();
    for entry in entries {
        let at = (entry.rows.start, entry.columns.start, entry.matrix);
        let sum = sums.entry(at).or_default();
        for (sum, p) in sum.iter_mut().zip(entry.coefficient.0) {
            *sum += p;
        }
    }
    sums.retain(|_, sum| *sum != [0.0; 3]);
    sums
}

/// Returns the signs that make a matrix with these coefficients symmetric.
fn signs_of(
    sums: &HashMap<(usize, usize, Matrix), [f64; 3]>,
    transposed: impl Fn(Matrix) -> Option<Matrix>,
) -> Option<HashMap<usize, f64>> {
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

/// A symmetric approximation of the matrix of a body with damping by β or under follower pressures.
///
/// After the rows of the constraint are multiplied by −(1 + βc), the unsymmetric terms are D = ∂(B v)/∂q, whose
/// transpose does not occur, and the stiffness of pressures and of velocity-dependent stresses (the caller replaces
/// the latter). Each of these terms is replaced by its symmetric part. The neglected part is a small part of a small
/// term, and the factorization costs half as much.
pub(super) struct NearlySymmetric {
    pub(super) entries: Vec<Entry<Quadratic>>,
    /// First row of the balance of momentum.
    pub(super) balance: usize,
    /// Factor of the rows of the constraint.
    pub(super) scale: Quadratic,
    pub(super) signs: HashMap<usize, f64>,
}

impl NearlySymmetric {
    /// Returns the symmetric approximation of the matrix of `entries`, or `None` if the matrix does not have this
    /// form.
    pub(super) fn of(entries: &[Entry<Quadratic>]) -> Option<Self> {
        let is_mass = |entry: &&Entry<Quadratic>| entry.matrix == Matrix::Mass;
        let balance = entries.iter().find(is_mass)?.rows.start;
        let minus_b = sums(entries).into_iter().find(|((row, _, matrix), _)| {
            *row == balance && *matrix == Matrix::DivergenceTransposed
        });
        let scale = minus_b.map_or([1.0, 0.0, 0.0], |(_, sum)| sum);
        let mut near = Vec::new();
        for entry in entries {
            let mut entry = entry.clone();
            if entry.matrix == Matrix::PressureStiffness {
                entry.matrix = Matrix::PressureSymmetricStiffness;
            }
            if entry.rows.start != balance {
                let [p, 0.0, 0.0] = entry.coefficient.0 else {
                    return None;
                };
                entry.coefficient = Quadratic(scale.map(|s| p * s));
            } else if entry.matrix == Matrix::DivergenceRateTransposed {
                let half = Quadratic(entry.coefficient.0.map(|p| 0.5 * p));
                entry.coefficient = half;
                near.push(Entry {
                    rows: entry.columns.clone(),
                    columns: entry.rows.clone(),
                    matrix: Matrix::DivergenceRate,
                    coefficient: half,
                });
            }
            near.push(entry);
        }
        let signs = signs_of(&sums(&near), |matrix| match matrix {
            // Symmetric: third derivatives of an energy along a velocity, and scaled parts of the stiffness.
            Matrix::RateStiffness | Matrix::DampedStiffness => Some(matrix),
            _ => matrix.properties().transpose,
        });
        Some(Self { entries: near, balance, scale: Quadratic(scale), signs: signs? })
    }
}
