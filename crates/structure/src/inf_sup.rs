//! The discrete inf–sup constant of a mixed method, computed from its matrices.

use nalgebra_sparse::CscMatrix;

use crate::error::StructureError;
use crate::modes::modes;
use crate::rank::RankDecision;
use crate::vibration::{Constraint, Vibration};

/// Shift relative to the mean eigenvalue. It is close to zero, so that the zero eigenvalues of a rank-deficient B are
/// counted. It is not exactly zero, because the factorization would fail at zero.
const SHIFT: f64 = -1e-3;
/// Number of non-zero values to compute in addition to the zeros, so that the count of zeros is complete.
const BEYOND: usize = 3;

/// Discrete inf–sup stability of pressures p and displacements u, which are coupled by B. It is given by the
/// smallest values of
///
/// β² with B H⁻¹ Bᵀ p = β² N p,   β = inf over p of sup over u of pᵀB u / (|p|_N |u|_H).
///
/// If N is the pressure mass matrix and H the stiffness of the H1 seminorm, the smallest β approximates the
/// inf–sup constant. For a stable pair of elements, this constant is independent of the mesh. If N and H are
/// identity matrices, the values of β are the singular values of B, which decrease under refinement for any pair.
/// Paper: eq. (27).
#[derive(Debug, Clone, PartialEq)]
pub struct InfSup {
    /// Smallest non-zero values of β, ascending.
    pub constants: Vec<f64>,
    /// Decision about which of the smallest values of β² are zero. The number of zeros is the nullity of Bᵀ.
    pub decision: RankDecision,
}

impl InfSup {
    /// Computes the smallest values of β for `operator` B (one row per pressure) with the norms
    /// `displacement_norm` H and `pressure_norm` N, both symmetric positive definite.
    ///
    /// # Errors
    /// Returns [`StructureError::Sizes`] if the sizes do not match, and [`StructureError::Factorize`] if a norm is
    /// singular or an entry is not finite.
    pub fn of(
        operator: &CscMatrix<f64>,
        displacement_norm: &CscMatrix<f64>,
        pressure_norm: &CscMatrix<f64>,
    ) -> Result<Self, StructureError> {
        // The problem H w + (−Bᵀ) p = 0, −(−Bᵀ)ᵀ w = β² N p describes the vibration of a body of mass N without
        // stiffness, supported by springs of compliance H.
        let n_pressures = operator.nrows();
        let holders =
            Constraint { operator: -operator.transpose(), compliance: displacement_norm.clone() };
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
                let constants = squares[decision.nullity()..].iter().map(|s| s.sqrt()).collect();
                return Ok(Self { constants, decision });
            }
            count *= 2;
        }
    }

    /// Returns the number of independent pressures that no displacement controls.
    pub fn nullity(&self) -> usize {
        self.decision.nullity()
    }

    /// Returns the smallest non-zero β, or `None` if B is zero.
    pub fn smallest(&self) -> Option<f64> {
        self.constants.first().copied()
    }
}

/// Returns the mean of b_ij² / (h_jj n_ii) over the rows, which is the magnitude of β² for diagonal norms. Returns
/// 1 for B = 0.
fn typical_square(b: &CscMatrix<f64>, h: &CscMatrix<f64>, n: &CscMatrix<f64>) -> f64 {
    let (h, n) = (diagonal(h), diagonal(n));
    let sum: f64 = b.triplet_iter().map(|(i, j, value)| value * value / (h[j] * n[i])).sum();
    if sum == 0.0 {
        // Nothing is constrained, so any scale is valid.
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
