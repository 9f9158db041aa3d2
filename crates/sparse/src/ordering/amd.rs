//! Approximate minimum degree, by faer.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::SymbolicSparseColMatRef;
use faer::sparse::linalg::amd;

use super::adjacency::AdjacencyList;

/// Orders the nodes of a graph by approximate minimum degree.
pub(super) fn order(neighbors: &AdjacencyList) -> Vec<u32> {
    let n = neighbors.len();
    let (mut order, mut places) = (vec![0u64; n], vec![0u64; n]);
    let offsets: Vec<u64> = neighbors.offsets().iter().map(|&o| o as u64).collect();
    let indices: Vec<u64> = neighbors.indices().iter().map(|&i| u64::from(i)).collect();
    let pattern = SymbolicSparseColMatRef::new_unsorted_checked(n, n, &offsets, None, &indices);
    let scratch = amd::order_maybe_unsorted_scratch::<u64>(n, indices.len());
    amd::order_maybe_unsorted(
        &mut order,
        &mut places,
        pattern,
        amd::Control::default(),
        MemStack::new(&mut MemBuffer::new(scratch)),
    )
    .expect("64-bit indices do not overflow");
    order.iter().map(|&node| node as u32).collect()
}
