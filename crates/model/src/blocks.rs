//! Assembly of blocks into a sparse matrix: union of the block patterns, and position of each block entry.

use nalgebra_sparse::pattern::SparsityPattern;

use myovib_sparse::Scalar;

/// A compressed-column pattern with the position of its first row and column in the assembled
/// matrix.
#[derive(Clone, Copy)]
pub(crate) struct Block<'a> {
    pub(crate) row: usize,
    pub(crate) column: usize,
    pub(crate) pattern: &'a SparsityPattern,
    /// Whether the transposed pattern is placed. The values keep the order of the original pattern.
    pub(crate) transposed: bool,
}

impl<'a> Block<'a> {
    /// Places an untransposed pattern.
    pub(crate) fn at(row: usize, column: usize, pattern: &'a SparsityPattern) -> Self {
        Self { row, column, pattern, transposed: false }
    }

    /// Returns the position (row, column) of each entry in the assembled matrix, in the order of the block's values.
    fn entries(self) -> impl Iterator<Item = (usize, usize)> + 'a {
        let Self { row: row_start, column: column_start, pattern, transposed } = self;
        pattern.entries().map(move |(major, minor)| {
            let (row, column) = if transposed { (major, minor) } else { (minor, major) };
            (row_start + row, column_start + column)
        })
    }
}

/// Pattern of the assembled matrix and, for each block, the positions of its entries in the assembled values.
#[derive(Debug, Clone)]
pub(crate) struct Blocks {
    pattern: SparsityPattern,
    positions: Vec<Positions>,
}

/// Positions of a block's entries in the assembled values.
#[derive(Debug, Clone)]
enum Positions {
    /// One position per entry.
    Single(Vec<u32>),
    /// Runs of consecutive positions (first position, length), used when columns of the block stay
    /// contiguous.
    Runs(Vec<(u32, u32)>),
}

/// Minimum mean run length for which runs are faster than single positions.
const MIN_MEAN_RUN: usize = 4;

impl Positions {
    fn new(positions: Vec<u32>) -> Self {
        let mut runs: Vec<(u32, u32)> = Vec::new();
        for &position in &positions {
            match runs.last_mut() {
                Some((start, len)) if *start + *len == position => *len += 1,
                _ => runs.push((position, 1)),
            }
        }
        if MIN_MEAN_RUN * runs.len() <= positions.len() {
            Self::Runs(runs)
        } else {
            Self::Single(positions)
        }
    }
}

impl Blocks {
    /// Places `blocks`, which may overlap, in a matrix of `shape` (rows, columns).
    ///
    /// # Panics
    /// Panics if a block extends beyond the matrix, or if the matrix has 2³² entries or more.
    pub(crate) fn new(shape: (usize, usize), blocks: &[Block<'_>]) -> Self {
        let pattern = union(shape, blocks);
        let positions =
            blocks.iter().map(|block| Positions::new(positions(&pattern, *block))).collect();
        Self { pattern, positions }
    }

    /// Returns the compressed-column pattern of the assembled matrix.
    pub(crate) fn pattern(&self) -> &SparsityPattern {
        &self.pattern
    }

    /// Adds `factor · values` to `whole` at the positions of the block with index `block`.
    pub(crate) fn add<T: Scalar>(&self, block: usize, factor: T, values: &[f64], whole: &mut [T]) {
        match &self.positions[block] {
            Positions::Single(positions) => {
                for (&position, &value) in positions.iter().zip(values) {
                    whole[position as usize] += factor * value;
                }
            }
            Positions::Runs(runs) => {
                let mut rest = values;
                for &(start, len) in runs {
                    let (run, after) = rest.split_at(len as usize);
                    rest = after;
                    for (entry, &value) in whole[start as usize..].iter_mut().zip(run) {
                        *entry += factor * value;
                    }
                }
            }
        }
    }
}

fn union((n_rows, n_columns): (usize, usize), blocks: &[Block<'_>]) -> SparsityPattern {
    // Use one contiguous allocation per array, because many small allocations would fragment the heap.
    let entries = || blocks.iter().flat_map(|block| block.entries());
    let mut starts = vec![0; n_columns + 1];
    for (_, column) in entries() {
        starts[column + 1] += 1;
    }
    for column in 0..n_columns {
        starts[column + 1] += starts[column];
    }
    let mut rows = vec![0; starts[n_columns]];
    let mut next = starts.clone();
    for (row, column) in entries() {
        rows[next[column]] = row;
        next[column] += 1;
    }
    let mut distinct = Vec::with_capacity(rows.len());
    let mut offsets = vec![0];
    for column in starts.windows(2) {
        let column = &mut rows[column[0]..column[1]];
        column.sort_unstable();
        distinct.extend(column.chunk_by(|a, b| a == b).map(|same| same[0]));
        offsets.push(distinct.len());
    }
    distinct.shrink_to_fit();
    SparsityPattern::try_from_offsets_and_indices(n_columns, n_rows, offsets, distinct)
        .expect("sorted, distinct rows make a valid pattern")
}

fn positions(whole: &SparsityPattern, block: Block<'_>) -> Vec<u32> {
    block
        .entries()
        .map(|(row, column)| {
            let within =
                whole.lane(column).binary_search(&row).expect("the union contains each block");
            u32::try_from(whole.major_offsets()[column] + within)
                .expect("fewer than 2^32 entries in a matrix")
        })
        .collect()
}
