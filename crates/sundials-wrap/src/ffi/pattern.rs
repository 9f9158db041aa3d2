//! Sparsity patterns as the C libraries take them.

/// Offsets or indices with the 64 bits of the C libraries; a length in memory always fits.
pub(super) fn widened(indices: &[usize]) -> Box<[i64]> {
    indices.iter().map(|&i| i as i64).collect()
}
