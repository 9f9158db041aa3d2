//! Patterns and constant matrices of a body.

use nalgebra_sparse::pattern::SparsityPattern;

use super::Solid;
use crate::operators::mass::SymmetricMatrix;
use crate::space::sparsity::entry_index;

impl Solid {
    /// Returns the pattern of tangents with respect to the displacement: n_free × n_free, by compressed columns.
    pub fn displacement_pattern(&self) -> &SparsityPattern {
        &self.displacement_pattern
    }

    /// Returns the pattern of B: n_pressures × n_free, by compressed columns.
    pub fn divergence_pattern(&self) -> &SparsityPattern {
        &self.divergence_pattern
    }

    /// Returns the pattern of the pressure mass matrix: n_pressures × n_pressures.
    pub fn pressure_pattern(&self) -> &SparsityPattern {
        &self.pressure_mass.pattern
    }

    /// Returns the mass matrix ρ ∫ φ_i φ_j for the free components, in the displacement pattern.
    pub fn mass_values(&self) -> Vec<f64> {
        self.on_free_components(&self.mass)
    }

    /// Returns ∫ ∇φ_i : ∇φ_j for the free components, in the displacement pattern. This matrix defines the squared
    /// H1 seminorm, which is used for inf–sup constants. Paper, eq. (27).
    pub fn gradient_values(&self) -> Vec<f64> {
        self.on_free_components(&SymmetricMatrix::node_gradients(&self.space))
    }

    /// Expands a nodal matrix to a matrix for the free components, in the displacement pattern.
    pub(super) fn on_free_components(&self, nodal: &SymmetricMatrix) -> Vec<f64> {
        let pattern = &self.displacement_pattern;
        let mut values = vec![0.0; pattern.nnz()];
        let free_to_full = self.dofs.free_to_full();
        let dimension = self.space.dimension();
        for (column, range) in pattern.major_offsets().windows(2).enumerate() {
            for &row in &pattern.minor_indices()[range[0]..range[1]] {
                let (a, b) = (free_to_full[row], free_to_full[column]);
                if a % dimension == b % dimension {
                    let value = entry_index(&nodal.pattern, a / dimension, b / dimension);
                    values[entry_index(pattern, row, column)] = nodal.values[value];
                }
            }
        }
        values
    }

    /// Returns the pressure mass matrix ∫ ψ_k ψ_l in the pressure pattern.
    pub fn pressure_mass_values(&self) -> &[f64] {
        &self.pressure_mass.values
    }

    /// Writes M a over all nodes to `out`, including constrained components.
    ///
    /// # Panics
    /// Panics unless both lengths are `n_components`.
    pub fn apply_mass(&self, a: &[f64], out: &mut [f64]) {
        self.mass.apply_interleaved(self.space.dimension(), a, out);
    }
}
