//! Small undamped vibrations, with or without a constraint.

use std::sync::Arc;

use myovib_sparse::{Elimination, Kind, LinearWork, SparseSystem, Structure};
use myovib_sparse::{Ordering, SparseOptions};
use nalgebra::{DVector, DVectorView};
use nalgebra_sparse::ops::Op;
use nalgebra_sparse::ops::serial::spmm_csc_dense;
use nalgebra_sparse::{CooMatrix, CscMatrix};

use crate::error::StructureError;

/// A constraint C p + B u = 0 with the multiplier p, which exerts the force Bᵀ p on u.
///
/// For nearly incompressible tissue, B is the volume operator, and C = M_p/κ is the pressure mass matrix divided
/// by the bulk modulus. C = 0 is the incompressible limit.
#[derive(Debug, Clone)]
pub struct Constraint {
    /// The matrix B, with one row for each multiplier.
    pub operator: CscMatrix<f64>,
    /// The matrix C, symmetric and positive semidefinite. It has no entries for a rigid constraint.
    pub compliance: CscMatrix<f64>,
}

/// Small free vibrations about an equilibrium: M ü + K u - Bᵀ p = 0, C p + B u = 0.
///
/// M is symmetric and positive definite, and K is symmetric. The harmonic motions u e^(iωt) solve
///
///   K u - Bᵀ p = ω² M u,   C p + B u = 0.
#[derive(Debug, Clone)]
pub struct Vibration {
    mass: CscMatrix<f64>,
    stiffness: CscMatrix<f64>,
    constraint: Option<Constraint>,
    /// Whether to eliminate the displacements after the multipliers that act on them. This order is suitable if
    /// the large pivots are in C.
    displacements_last: bool,
}

impl Vibration {
    /// Creates the vibration problem with mass M, stiffness K and an optional constraint.
    ///
    /// # Errors
    /// Returns [`StructureError::Sizes`] if the sizes do not match.
    pub fn new(
        mass: CscMatrix<f64>,
        stiffness: CscMatrix<f64>,
        constraint: Option<Constraint>,
    ) -> Result<Self, StructureError> {
        let n = mass.nrows();
        let sized = |name, matrix: &CscMatrix<f64>, rows: usize, columns: usize| {
            let got = (matrix.nrows(), matrix.ncols());
            if got == (rows, columns) {
                Ok(())
            } else {
                Err(StructureError::Sizes { matrix: name, got, expected: (rows, columns) })
            }
        };
        sized("mass", &mass, n, n)?;
        sized("stiffness", &stiffness, n, n)?;
        if let Some(Constraint { operator, compliance }) = &constraint {
            let n_multipliers = operator.nrows();
            sized("constraint operator", operator, n_multipliers, n)?;
            sized("compliance", compliance, n_multipliers, n_multipliers)?;
        }
        Ok(Self { mass, stiffness, constraint, displacements_last: false })
    }

    /// Returns the problem with an elimination order suited to large pivots of C and small pivots of K − σ M.
    pub(crate) fn with_displacements_last(self) -> Self {
        Self { displacements_last: true, ..self }
    }

    /// Returns uᵀ K u / uᵀ M u, ignoring the constraint.
    ///
    /// # Panics
    /// Panics if `u` has the wrong length.
    pub fn quotient(&self, u: &[f64]) -> f64 {
        let u = DVector::from_column_slice(u);
        u.dot(&(&self.stiffness * &u)) / u.dot(&self.mass_times(&u))
    }

    pub(crate) fn n_displacements(&self) -> usize {
        self.mass.nrows()
    }

    pub(crate) fn n_multipliers(&self) -> usize {
        self.constraint.as_ref().map_or(0, |c| c.operator.nrows())
    }

    /// Computes M u. M is symmetric, so each entry of the product is a sum over a column.
    pub(crate) fn mass_times(&self, u: &DVector<f64>) -> DVector<f64> {
        let u = u.as_slice();
        let entries = self.mass.col_iter().map(|column| {
            let terms = column.row_indices().iter().zip(column.values());
            terms.map(|(&i, mass)| mass * u[i]).sum()
        });
        DVector::from_iterator(u.len(), entries)
    }

    /// Computes K u − Bᵀ p − ω² M u.
    pub(crate) fn imbalance(
        &self,
        omega_squared: f64,
        u: &DVector<f64>,
        p: &DVector<f64>,
    ) -> DVector<f64> {
        let mut force = &self.stiffness * u - &self.mass * u * omega_squared;
        if let Some(Constraint { operator, .. }) = &self.constraint {
            spmm_csc_dense(1.0, &mut force, -1.0, Op::Transpose(operator), Op::NoOp(p));
        }
        force
    }

    /// Factorizes the symmetric matrix (K − σ M, −Bᵀ; −B, −C).
    pub(crate) fn shifted(&self, shift: f64) -> Result<Shifted, StructureError> {
        let n = self.n_displacements();
        let size = n + self.n_multipliers();
        let mut matrix = CooMatrix::new(size, size);
        for (row, column, value) in self.stiffness.triplet_iter() {
            matrix.push(row, column, *value);
        }
        for (row, column, value) in self.mass.triplet_iter() {
            matrix.push(row, column, -shift * value);
        }
        if let Some(Constraint { operator, compliance }) = &self.constraint {
            for (row, column, value) in operator.triplet_iter() {
                matrix.push(n + row, column, -value);
                matrix.push(column, n + row, -value);
            }
            for (row, column, value) in compliance.triplet_iter() {
                matrix.push(n + row, n + column, -value);
            }
        }
        let matrix = CscMatrix::from(&matrix);
        let options =
            SparseOptions { ordering: Ordering::Amd, btf: false, ..SparseOptions::default() };
        let structure = Structure {
            kind: Kind::Symmetric,
            constraints: match self.displacements_last {
                true => 0..n,
                false => n..size,
            },
        };
        let elimination = Elimination::new(matrix.pattern(), structure, options)?;
        elimination.expect_memory()?;
        let mut factors = SparseSystem::new(Arc::new(elimination));
        factors.values_mut().copy_from_slice(matrix.values());
        let mut work = LinearWork::default();
        factors.renew(&mut work)?;
        Ok(Shifted { n, factors, work, solution: vec![0.0; size] })
    }
}

/// The factors of the shifted matrix, with workspace for a right-hand side.
pub(crate) struct Shifted {
    n: usize,
    factors: SparseSystem<f64>,
    work: LinearWork,
    solution: Vec<f64>,
}

impl Shifted {
    /// Returns the number of values ω² below the shift. By Sylvester's law, it is the number of negative pivots
    /// minus the number of multipliers. Returns `None` if rows were exchanged.
    pub(crate) fn n_below(&self) -> Option<usize> {
        let pivots = self.factors.pivots()?;
        let negative = pivots.iter().filter(|pivot| **pivot < 0.0).count();
        Some(negative.saturating_sub(pivots.len() - self.n))
    }

    /// Solves (K − σ M) u − Bᵀ p = f, B u + C p = 0 for (u, p).
    pub(crate) fn solve(
        &mut self,
        f: &DVector<f64>,
    ) -> Result<(DVectorView<'_, f64>, DVectorView<'_, f64>), StructureError> {
        let (displacements, multipliers) = self.solution.split_at_mut(self.n);
        displacements.copy_from_slice(f.as_slice());
        multipliers.fill(0.0);
        self.factors.solve(&mut self.solution, &mut self.work)?;
        let (u, p) = self.solution.split_at(self.n);
        Ok((DVectorView::from_slice(u, u.len()), DVectorView::from_slice(p, p.len())))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Six unit masses are supported by springs of stiffness 1 to 6, and a multiplier couples the first two masses.
    /// With a rigid coupling, the coupled masses have ω² = 3/2; with the compliance 1/2, they have ω² = 7/2 ± √17/2.
    /// The pivots of multipliers are negative but do not count.
    #[test]
    fn the_number_of_modes_below_a_shift_excludes_multipliers() {
        let diagonal = |values: &[f64]| {
            let mut matrix = CooMatrix::new(values.len(), values.len());
            values.iter().enumerate().for_each(|(i, value)| matrix.push(i, i, *value));
            CscMatrix::from(&matrix)
        };
        let mut operator = CooMatrix::new(1, 6);
        operator.push(0, 0, 1.0);
        operator.push(0, 1, -1.0);
        let operator = CscMatrix::from(&operator);
        let root = 17.0_f64.sqrt();
        for (compliance, coupled) in [
            (CscMatrix::zeros(1, 1), vec![1.5]),
            (diagonal(&[0.5]), vec![3.5 - root / 2.0, 3.5 + root / 2.0]),
        ] {
            let constraint = Constraint { operator: operator.clone(), compliance };
            let stiffness = diagonal(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
            let vibration = Vibration::new(diagonal(&[1.0; 6]), stiffness, Some(constraint));
            let omega_squared = [&coupled[..], &[3.0, 4.0, 5.0, 6.0]].concat();
            for shift in [0.0, 1.45, 2.9, 5.8, 7.0] {
                let below = omega_squared.iter().filter(|value| **value < shift).count();
                let found = vibration.as_ref().unwrap().shifted(shift).unwrap().n_below();
                assert_eq!(found, Some(below), "{omega_squared:?} {shift}");
            }
        }
    }
}
