//! Interface to METIS, which `metis-sys` builds from its C source.

use std::ptr;
use std::sync::{Mutex, PoisonError};

use metis_sys::{METIS_NOPTIONS, METIS_NodeND, METIS_SetDefaultOptions, idx_t};
use metis_sys::{moptions_et_METIS_OPTION_NSEPS, moptions_et_METIS_OPTION_NUMBERING};
use metis_sys::{moptions_et_METIS_OPTION_SEED, rstatus_et_METIS_OK};

use crate::ordering::adjacency::AdjacencyList;

/// Prevents concurrent calls, because METIS keeps the state of its random numbers and of its error handler in globals.
static METIS: Mutex<()> = Mutex::new(());

/// Orders the nodes of a graph by nested dissection. `weights` are the costs of the nodes in a separator.
///
/// METIS computes `separators` candidate separators of each part and selects the smallest. The order is reproducible.
/// Returns `None` if METIS fails, for example because the graph is empty or has 2³¹ edges; METIS prints the reason to
/// stderr.
pub(crate) fn nested_dissection(
    neighbors: &AdjacencyList,
    weights: &[i32],
    seed: u32,
    separators: u32,
) -> Option<Vec<u32>> {
    let n = neighbors.len();
    assert_eq!(weights.len(), n, "one weight per node");
    if n == 0 || i32::try_from(neighbors.indices().len()).is_err() {
        return None;
    }
    let narrow = |&k: &usize| k as idx_t;
    let mut offsets: Vec<idx_t> = neighbors.offsets().iter().map(narrow).collect();
    let mut indices: Vec<idx_t> = neighbors.indices().iter().map(|&k| k as idx_t).collect();
    let mut weights = weights.to_vec();
    let (mut order, mut places) = (vec![0; n], vec![0; n]);
    let mut options = [0; METIS_NOPTIONS as usize];
    let _guard = METIS.lock().unwrap_or_else(PoisonError::into_inner);
    // SAFETY: the array has the METIS_NOPTIONS entries that the function writes.
    unsafe { METIS_SetDefaultOptions(options.as_mut_ptr()) };
    options[moptions_et_METIS_OPTION_NUMBERING as usize] = 0;
    options[moptions_et_METIS_OPTION_SEED as usize] = seed as idx_t;
    options[moptions_et_METIS_OPTION_NSEPS as usize] = separators as idx_t;
    let mut n = n as idx_t;
    // SAFETY: the offsets increase from 0 to the number of indices. The indices are in 0..n, are symmetric and contain
    // no self-loops, because they are the adjacency of a graph. The weights, order and places have n entries. All
    // arrays outlive the call, and METIS keeps none of them. The lock prevents concurrent calls.
    let status = unsafe {
        METIS_NodeND(
            ptr::from_mut(&mut n),
            offsets.as_mut_ptr(),
            indices.as_mut_ptr(),
            weights.as_mut_ptr(),
            options.as_mut_ptr(),
            order.as_mut_ptr(),
            places.as_mut_ptr(),
        )
    };
    (status == rstatus_et_METIS_OK).then(|| order.iter().map(|&node| node as u32).collect())
}
