//! The discrete inf–sup constant of a mixed method, from its matrices.

use nalgebra_sparse::CscMatrix;

use crate::error::StructureError;
use crate::modes::modes;
use crate::rank::RankDecision;
use crate::vibration::{Constraint, Vibration};

/// Shift of the search relative to the mean eigenvalue: next to zero, where a rank-deficient B has
/// eigenvalues that must be counted, but not at it, where there would be nothing to factorise.
const SHIFT: f64 = -1e-3;
/// Values beyond the nullity that are looked for, so that the count is seen to end.
const BEYOND: usize = 3;

/// How well the pressures p are held by the displacements u through B: the smallest values of
///
///   β² with B H⁻¹ Bᵀ p = β² N p,   β = inf over p of sup over u of pᵀB u / (|p|_N |u|_H).
///
/// With N the pressure mass matrix and H the stiffness of the H1 seminorm the smallest one is the
/// mesh-independent constant; with identities they are the singular values of B itself, which decay
/// under refinement for any pair of spaces. Paper: eq. (27).
#[derive(Debug, Clone, PartialEq)]
pub struct InfSup {
    /// The smallest non-zero values of β, ascending.
    pub constants: Vec<f64>,
    /// Which of the smallest values of β² are zero; the number of them is the nullity of Bᵀ.
    pub decision: RankDecision,
}

impl InfSup {
    /// Finds the smallest values of β for `operator` B (a row for each pressure) in the norms
    /// `displacement_norm` H and `pressure_norm` N, both symmetric and positive definite.
    ///
    /// # Errors
    /// [`StructureError::Sizes`] when the matrices do not fit together,
    /// [`StructureError::Factorise`] when a norm is singular or an entry is not finite.
    pub fn of(
        operator: &CscMatrix<f64>,
        displacement_norm: &CscMatrix<f64>,
        pressure_norm: &CscMatrix<f64>,
    ) -> Result<Self, StructureError> {
        // Written as H w + (-Bᵀ) p = 0, -(-Bᵀ)ᵀ w = β² N p it is a body of mass N without stiffness
        // of its own, held by springs of compliance H.
        let n_pressures = operator.nrows();
        let holders = Constraint {
            operator: -operator.transpose(),
            compliance: displacement_norm.clone(),
        };
        let stiffness = CscMatrix::zeros(n_pressures, n_pressures);
        let body = Vibration::new(pressure_norm.clone(), stiffness, Some(holders))?;
        let body = body.with_displacements_last();

        let typical = typical_square(operator, displacement_norm, pressure_norm);
        let mut count = 2 * BEYOND;
        loop {
            let found = modes(&body, count, SHIFT * typical)?;
            let squares: Vec<f64> = found.iter().map(|m| m.omega_squared.max(0.0)).collect();
            let subject = "smallest eigenvalues of B H⁻¹ Bᵀ".to_owned();
            let decision = RankDecision::new(subject, &squares, typical);
            if decision.rank >= BEYOND || squares.len() < count {
                let constants = squares[decision.nullity()..]
                    .iter()
                    .map(|s| s.sqrt())
                    .collect();
                return Ok(Self {
                    constants,
                    decision,
                });
            }
            count *= 2;
        }
    }

    /// The number of independent pressures that no displacement holds.
    pub fn nullity(&self) -> usize {
        self.decision.nullity()
    }

    /// The smallest non-zero β, unless B is zero.
    pub fn smallest(&self) -> Option<f64> {
        self.constants.first().copied()
    }
}

/// The mean of b_ij² / (h_jj n_ii) over the rows: the size of β² if the norms were diagonal; 1 for
/// B = 0.
fn typical_square(b: &CscMatrix<f64>, h: &CscMatrix<f64>, n: &CscMatrix<f64>) -> f64 {
    let (h, n) = (diagonal(h), diagonal(n));
    let sum: f64 = b
        .triplet_iter()
        .map(|(i, j, value)| value * value / (h[j] * n[i]))
        .sum();
    if sum == 0.0 {
        // Nothing is held, on any scale.
        return 1.0;
    }
    sum / b.nrows() as f64
}

fn diagonal(matrix: &CscMatrix<f64>) -> Vec<f64> {
    let mut diagonal = vec![0.0; matrix.nrows()];
    for (row, column, value) in matrix.triplet_iter() {
        if row == column {
            diagonal[row] += value;
        }
    }
    diagonal
}
