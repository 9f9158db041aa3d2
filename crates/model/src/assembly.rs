//! The fixed pattern of a block matrix and the sum of matrices into it.

use std::collections::HashMap;
use std::ops::Range;

use nalgebra_sparse::pattern::SparsityPattern;

use crate::matrix::{Matrix, Term};

/// A term with its place in the whole matrix.
#[derive(Debug, Clone)]
struct Placed {
    matrix: Matrix,
    of_value: f64,
    of_rate: f64,
    /// Index into the assembly's list of maps.
    map: usize,
}

/// A block matrix as a sum of terms, each scattered by a map computed once.
#[derive(Debug, Clone)]
pub struct Assembly {
    pattern: SparsityPattern,
    terms: Vec<Placed>,
    /// For each distinct block, where entry k of the block lies in the whole.
    maps: Vec<Vec<u32>>,
}

/// A pattern of a block, entered as it is or transposed.
#[derive(Clone, Copy)]
struct Block<'a> {
    pattern: &'a SparsityPattern,
    transposed: bool,
}

impl<'a> Block<'a> {
    /// (row, column) of each entry, in the order of the block's values.
    fn entries(self) -> impl Iterator<Item = (usize, usize)> + 'a {
        self.pattern.entries().map(move |(major, minor)| {
            if self.transposed {
                (major, minor)
            } else {
                (minor, major)
            }
        })
    }
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
        let mut blocks: Vec<(usize, usize, Block<'a>)> = Vec::new();
        let mut known: HashMap<(usize, usize, *const SparsityPattern, bool), usize> =
            HashMap::new();
        let mut placed = Vec::new();
        for (rows, columns, term) in terms {
            let (pattern, transposed) = pattern_of(term.matrix);
            let key = (
                rows.start,
                columns.start,
                std::ptr::from_ref(pattern),
                transposed,
            );
            let map = *known.entry(key).or_insert_with(|| {
                blocks.push((
                    rows.start,
                    columns.start,
                    Block {
                        pattern,
                        transposed,
                    },
                ));
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
                map,
            });
        }
        let pattern = union(n, &blocks);
        let maps = blocks
            .iter()
            .map(|block| positions(&pattern, block))
            .collect();
        Self {
            pattern,
            terms: placed,
            maps,
        }
    }

    /// The compressed-column pattern of the whole.
    pub fn pattern(&self) -> &SparsityPattern {
        &self.pattern
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
            if coefficient == 0.0 {
                continue;
            }
            for (&position, value) in self.maps[term.map].iter().zip(matrix_values(term.matrix)) {
                values[position as usize] += coefficient * value;
            }
        }
    }
}

fn union(n: usize, blocks: &[(usize, usize, Block<'_>)]) -> SparsityPattern {
    let mut columns: Vec<Vec<usize>> = vec![Vec::new(); n];
    for (row_start, column_start, block) in blocks {
        for (row, column) in block.entries() {
            columns[column_start + column].push(row_start + row);
        }
    }
    let mut offsets = vec![0];
    let mut rows = Vec::new();
    for column in &mut columns {
        column.sort_unstable();
        column.dedup();
        rows.append(column);
        offsets.push(rows.len());
    }
    SparsityPattern::try_from_offsets_and_indices(n, n, offsets, rows)
        .expect("sorted, deduplicated columns make a valid pattern")
}

fn positions(whole: &SparsityPattern, block: &(usize, usize, Block<'_>)) -> Vec<u32> {
    let (row_start, column_start, block) = block;
    block
        .entries()
        .map(|(row, column)| {
            let column = column_start + column;
            let within = whole
                .lane(column)
                .binary_search(&(row_start + row))
                .expect("the whole contains each block");
            u32::try_from(whole.major_offsets()[column] + within)
                .expect("fewer than 2^32 entries in a matrix")
        })
        .collect()
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
