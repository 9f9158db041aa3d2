//! Block matrix with a fixed pattern, assembled as a linear combination of matrices.

use std::collections::HashMap;
use std::ops::Range;

use nalgebra_sparse::pattern::SparsityPattern;

use crate::blocks::{Block, Blocks};
use crate::matrix::Matrix;
use myovib_sparse::Scalar;

/// A matrix of the muscle, the block that contains it, and the data from which its coefficient is computed.
#[derive(Debug, Clone)]
pub struct Entry<C> {
    /// Rows of the block.
    pub rows: Range<usize>,
    /// Columns of the block.
    pub columns: Range<usize>,
    /// Matrix in the block.
    pub matrix: Matrix,
    /// Passed to the `factor` argument of [`combine`](Assembly::combine).
    pub coefficient: C,
}

/// A matrix placed in a block, with the data of its coefficients. The coefficients are summed.
#[derive(Debug, Clone)]
struct Placed<C> {
    matrix: Matrix,
    coefficients: Vec<C>,
    block: usize,
}

/// A block matrix assembled as a sum of matrices. The map that scatters each matrix is computed only once.
#[derive(Debug, Clone)]
pub struct Assembly<C> {
    terms: Vec<Placed<C>>,
    blocks: Blocks,
}

impl<C: Copy> Assembly<C> {
    /// Places `entries` in a matrix of `shape` (rows, columns).
    ///
    /// `pattern_of` returns the compressed-column pattern that determines the order of a matrix's values, and whether
    /// the matrix has the transpose of this pattern.
    ///
    /// # Panics
    /// Panics if a block extends beyond the assembled matrix, or if the assembled matrix has 2³² entries or more.
    pub fn new<'a>(
        shape: (usize, usize),
        entries: impl IntoIterator<Item = Entry<C>>,
        pattern_of: impl Fn(Matrix) -> (&'a SparsityPattern, bool),
    ) -> Self {
        let mut blocks: Vec<Block<'_>> = Vec::new();
        let mut known: HashMap<(usize, usize, *const SparsityPattern, bool), usize> =
            HashMap::new();
        let mut terms: Vec<Placed<C>> = Vec::new();
        for entry in entries {
            let (pattern, transposed) = pattern_of(entry.matrix);
            let (row, column) = (entry.rows.start, entry.columns.start);
            let key = (row, column, std::ptr::from_ref(pattern), transposed);
            let block = *known.entry(key).or_insert_with(|| {
                blocks.push(Block { row, column, pattern, transposed });
                blocks.len() - 1
            });
            let same = |term: &&mut Placed<C>| term.block == block && term.matrix == entry.matrix;
            match terms.iter_mut().find(same) {
                Some(term) => term.coefficients.push(entry.coefficient),
                None => terms.push(Placed {
                    matrix: entry.matrix,
                    coefficients: vec![entry.coefficient],
                    block,
                }),
            }
        }
        Self { terms, blocks: Blocks::new(shape, &blocks) }
    }

    /// Returns the compressed-column pattern of the assembled matrix.
    pub fn pattern(&self) -> &SparsityPattern {
        self.blocks.pattern()
    }

    /// Computes `values` ← Σ factor(matrix, coefficient) · matrix.
    pub fn combine<'m, T: Scalar>(
        &self,
        factor: impl Fn(Matrix, &C) -> T,
        matrix_values: impl Fn(Matrix) -> &'m [f64],
        values: &mut [T],
    ) {
        values.fill(T::zero());
        for term in &self.terms {
            let mut sum = T::zero();
            for coefficient in &term.coefficients {
                sum += factor(term.matrix, coefficient);
            }
            if sum != T::zero() {
                let matrix = matrix_values(term.matrix);
                self.blocks.add(term.block, sum, matrix, values);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pattern(rows: usize, columns: usize, entries: &[(usize, usize)]) -> SparsityPattern {
        let offsets = (0..=columns)
            .map(|c| entries.iter().filter(|(_, column)| *column < c).count())
            .collect();
        let minor = entries.iter().map(|(row, _)| *row).collect();
        SparsityPattern::try_from_offsets_and_indices(columns, rows, offsets, minor).unwrap()
    }

    #[test]
    fn blocks_overlap_transpose_and_sum() {
        // A 3×3 matrix: a 2×2 diagonal block added twice, a 1×2 block below it, and the transpose of the 1×2
        // block.
        let square = pattern(2, 2, &[(0, 0), (1, 1)]);
        let wide = pattern(1, 2, &[(0, 0), (0, 1)]);
        let entry =
            |rows, columns, matrix, coefficient| Entry { rows, columns, matrix, coefficient };
        let assembly = Assembly::new(
            (3, 3),
            [
                entry(0..2, 0..2, Matrix::Mass, 4.0),
                entry(0..2, 0..2, Matrix::Stiffness, 2.0),
                entry(0..2, 0..2, Matrix::Mass, -1.0),
                entry(2..3, 0..2, Matrix::Divergence, 2.0),
                entry(0..2, 2..3, Matrix::DivergenceTransposed, -2.0),
            ],
            |matrix| match matrix {
                Matrix::Divergence => (&wide, false),
                Matrix::DivergenceTransposed => (&wide, true),
                _ => (&square, false),
            },
        );
        let (mass, stiffness, divergence) = ([1.0, 2.0], [10.0, 20.0], [5.0, 7.0]);
        let mut values = vec![f64::NAN; assembly.pattern().nnz()];
        assembly.combine(
            |_, coefficient: &f64| *coefficient,
            |matrix| match matrix {
                Matrix::Mass => &mass,
                Matrix::Stiffness => &stiffness,
                _ => &divergence,
            },
            &mut values,
        );
        // Columns: (2·10 + 3·1, 2·5), (2·20 + 3·2, 2·7), (-2·5, -2·7).
        assert_eq!(values, [23.0, 10.0, 46.0, 14.0, -10.0, -14.0]);
    }
}
