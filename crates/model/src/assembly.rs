//! The fixed pattern of a block matrix and the sum of matrices into it.

use std::collections::HashMap;
use std::ops::Range;

use nalgebra_sparse::pattern::SparsityPattern;

use crate::blocks::{Block, Blocks};
use crate::matrix::{Matrix, Term};

/// A term with its place in the whole matrix.
#[derive(Debug, Clone)]
struct Placed {
    matrix: Matrix,
    of_value: f64,
    of_rate: f64,
    block: usize,
}

/// A block matrix as a sum of terms, each scattered by a map computed once.
#[derive(Debug, Clone)]
pub struct Assembly {
    terms: Vec<Placed>,
    blocks: Blocks,
}

impl Assembly {
    /// Places `terms`, each with the rows and columns of its block.
    ///
    /// `pattern_of` gives the compressed-column pattern of a matrix and whether its values are
    /// those of the transposed pattern.
    ///
    /// # Panics
    /// If a term's block is larger than its matrix, or the whole has 2³² entries or more.
    pub fn new<'a>(
        n: usize,
        terms: impl IntoIterator<Item = (Range<usize>, Range<usize>, Term)>,
        pattern_of: impl Fn(Matrix) -> (&'a SparsityPattern, bool),
    ) -> Self {
        let mut blocks: Vec<Block<'_>> = Vec::new();
        let mut known: HashMap<(usize, usize, *const SparsityPattern, bool), usize> =
            HashMap::new();
        let mut placed = Vec::new();
        for (rows, columns, term) in terms {
            let (pattern, transposed) = pattern_of(term.matrix);
            let (row, column) = (rows.start, columns.start);
            let key = (row, column, std::ptr::from_ref(pattern), transposed);
            let block = *known.entry(key).or_insert_with(|| {
                blocks.push(Block {
                    row,
                    column,
                    pattern,
                    transposed,
                });
                blocks.len() - 1
            });
            let Term {
                matrix,
                of_value,
                of_rate,
                ..
            } = term;
            placed.push(Placed {
                matrix,
                of_value,
                of_rate,
                block,
            });
        }
        Self {
            terms: placed,
            blocks: Blocks::new(n, &blocks),
        }
    }

    /// The compressed-column pattern of the whole.
    pub fn pattern(&self) -> &SparsityPattern {
        self.blocks.pattern()
    }

    /// `values` ← Σ (a · of_value + b · of_rate) · matrix.
    pub fn combine<'m>(
        &self,
        a: f64,
        b: f64,
        matrix_values: impl Fn(Matrix) -> &'m [f64],
        values: &mut [f64],
    ) {
        values.fill(0.0);
        for term in &self.terms {
            let coefficient = a * term.of_value + b * term.of_rate;
            if coefficient != 0.0 {
                let matrix = matrix_values(term.matrix);
                self.blocks.add(term.block, coefficient, matrix, values);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::Field;

    fn pattern(rows: usize, columns: usize, entries: &[(usize, usize)]) -> SparsityPattern {
        let offsets = (0..=columns)
            .map(|c| entries.iter().filter(|(_, column)| *column < c).count())
            .collect();
        let minor = entries.iter().map(|(row, _)| *row).collect();
        SparsityPattern::try_from_offsets_and_indices(columns, rows, offsets, minor).unwrap()
    }

    #[test]
    fn blocks_overlap_transpose_and_sum() {
        // A 3×3 whole: a 2×2 diagonal block, twice, and a 1×2 block below with its transpose.
        let square = pattern(2, 2, &[(0, 0), (1, 1)]);
        let wide = pattern(1, 2, &[(0, 0), (0, 1)]);
        let term = |matrix, of_value, of_rate| Term {
            column: Field::Displacement,
            matrix,
            of_value,
            of_rate,
        };
        let assembly = Assembly::new(
            3,
            [
                (0..2, 0..2, term(Matrix::Mass, 0.0, 1.0)),
                (0..2, 0..2, term(Matrix::Stiffness, 1.0, 0.0)),
                (2..3, 0..2, term(Matrix::Divergence, 1.0, 0.0)),
                (0..2, 2..3, term(Matrix::DivergenceTransposed, -1.0, 0.0)),
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
            2.0,
            3.0,
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
