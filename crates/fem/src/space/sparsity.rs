//! Sparsity patterns (compressed columns) and the locations of element entries in them.

use std::collections::BTreeSet;

use nalgebra_sparse::pattern::SparsityPattern;

use crate::simd::batch::Batch;
use crate::simd::lanes::LANES;
use crate::space::Space;
use crate::space::dofs::{CONSTRAINED, DofMap};

/// Value that marks a missing entry: a constrained row or column, or an unused lane.
pub(crate) const NO_ENTRY: u32 = u32::MAX;

/// Creates a pattern from the sorted rows of each column.
pub(crate) fn pattern(n_rows: usize, columns: impl Iterator<Item = Vec<usize>>) -> SparsityPattern {
    let (mut offsets, mut rows) = (vec![0], Vec::new());
    for column in columns {
        rows.extend(column);
        offsets.push(rows.len());
    }
    SparsityPattern::try_from_offsets_and_indices(offsets.len() - 1, n_rows, offsets, rows)
        .expect("rows are sorted, distinct and in range")
}

/// Nodes or pressures of an element.
pub(crate) type Members = fn(&Space, usize) -> &[usize];

/// Returns a sorted set of row items for each of `n_columns` column items. The set contains the row items that
/// share an element with the column item.
fn neighbors(
    space: &Space,
    n_columns: usize,
    columns: Members,
    rows: Members,
) -> Vec<BTreeSet<usize>> {
    let mut sets = vec![BTreeSet::new(); n_columns];
    for element in 0..space.n_elements() {
        for &column in columns(space, element) {
            sets[column].extend(rows(space, element));
        }
    }
    sets
}

/// Returns the n × n pattern of items that share an element: of all nodes, or of all pressures.
pub(crate) fn pattern_of(space: &Space, n: usize, items: Members) -> SparsityPattern {
    let sets = neighbors(space, n, items, items);
    pattern(n, sets.into_iter().map(|set| set.into_iter().collect()))
}

/// Returns the n_free × n_free pattern of components whose nodes share an element.
pub(crate) fn displacement_pattern(space: &Space, dofs: &DofMap) -> SparsityPattern {
    let sets = neighbors(space, space.n_nodes(), Space::element_nodes, Space::element_nodes);
    let dimension = space.dimension();
    let columns = dofs.free_to_full().iter().map(|&full| {
        let components = sets[full / dimension]
            .iter()
            .flat_map(|&node| dimension * node..dimension * (node + 1));
        components
            .map(|component| dofs.full_to_free()[component])
            .filter(|&free| free != CONSTRAINED)
            .map(|free| free as usize)
            .collect()
    });
    pattern(dofs.n_free(), columns)
}

/// Returns the n_pressures × n_free pattern of pressures and components that share an element.
pub(crate) fn divergence_pattern(space: &Space, dofs: &DofMap) -> SparsityPattern {
    let sets = neighbors(space, space.n_nodes(), Space::element_nodes, Space::element_pressures);
    let columns = dofs
        .free_to_full()
        .iter()
        .map(|&full| sets[full / space.dimension()].iter().copied().collect());
    pattern(space.n_pressures(), columns)
}

/// Returns the index of an entry among the values of a pattern.
pub(crate) fn entry_index(pattern: &SparsityPattern, row: usize, column: usize) -> usize {
    let offset = pattern.major_offsets()[column];
    offset + pattern.lane(column).binary_search(&row).expect("the entry is in the pattern")
}

/// Entry index for each lane.
pub(crate) type LaneIndices = [u32; LANES];

/// Entry indices of element matrices, indexed by `[b][k][a][i]`.
type DisplacementIndices<const D: usize, const N: usize> = [[[[LaneIndices; D]; N]; D]; N];

/// Indices of the element matrix entries of a batch in the global matrices.
#[derive(Debug, Clone)]
pub(crate) struct ScatterMap<const D: usize, const N: usize, const P: usize> {
    /// `displacement[b][k][a][i]` is the index of the entry in row (node a, component i) and column (node b,
    /// component k).
    pub(crate) displacement: Box<DisplacementIndices<D, N>>,
    /// `divergence[b][k][v]` is the index of the entry in row v (a pressure) and column (node b, component k).
    pub(crate) divergence: Box<[[[LaneIndices; P]; D]; N]>,
}

impl<const D: usize, const N: usize, const P: usize> ScatterMap<D, N, P> {
    /// Returns indices into a buffer that stores the element matrices of a batch one after the other.
    pub(crate) fn element_by_element() -> Self {
        use std::array::from_fn;
        let index = |l: usize, column: usize, rows: usize, row: usize| {
            u32::try_from((l * N * D + column) * rows + row).expect("element matrices are small")
        };
        Self {
            displacement: Box::new(from_fn(|b| {
                from_fn(|k| {
                    from_fn(|a| from_fn(|i| from_fn(|l| index(l, b * D + k, N * D, a * D + i))))
                })
            })),
            divergence: Box::new(from_fn(|b| {
                from_fn(|k| from_fn(|v| from_fn(|l| index(l, b * D + k, P, v))))
            })),
        }
    }

    pub(crate) fn new(
        batch: &Batch<D, N, P>,
        dofs: &DofMap,
        displacement: &SparsityPattern,
        divergence: &SparsityPattern,
    ) -> Self {
        let free = |a: usize, i: usize, l: usize| dofs.full_to_free()[D * batch.nodes[a][l] + i];
        let find = |pattern: &SparsityPattern, row: u32, column: u32, l: usize| {
            if l >= batch.count || row == CONSTRAINED || column == CONSTRAINED {
                return NO_ENTRY;
            }
            u32::try_from(entry_index(pattern, row as usize, column as usize))
                .ok()
                .filter(|&index| index != NO_ENTRY)
                .expect("fewer than 2^32 matrix entries")
        };
        use std::array::from_fn;
        let pressure = |v: usize, l: usize| {
            u32::try_from(batch.pressures[v][l]).expect("fewer than 2^32 pressures")
        };
        Self {
            displacement: Box::new(from_fn(|b| {
                from_fn(|k| {
                    from_fn(|a| {
                        from_fn(|i| {
                            from_fn(|l| find(displacement, free(a, i, l), free(b, k, l), l))
                        })
                    })
                })
            })),
            divergence: Box::new(from_fn(|b| {
                from_fn(|k| {
                    from_fn(|v| from_fn(|l| find(divergence, pressure(v, l), free(b, k, l), l)))
                })
            })),
        }
    }
}
