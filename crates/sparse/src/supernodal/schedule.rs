//! Distribution of supernodes among threads, and positions of updates that wait for their parents.

use std::ops::Range;

use super::analysis::{Analysis, Supernode};
use crate::Kind;

/// Subtrees are split until the work of the largest is at most this fraction of one thread's share, so that all threads
/// finish at nearly the same time.
const PART_OF_SHARE: f64 = 0.25;

/// Position of a waiting update: the index of a pair of stacks, and the offset in one of these stacks.
///
/// Each subtree has two stacks, and so do the remaining supernodes together: one stack for even depth and one for odd
/// depth. Therefore, an update can be formed in its final position while the updates of its children are read.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Place {
    pub(super) stacks: usize,
    pub(super) offset: usize,
}

/// Supernodes eliminated by one thread. The last supernode is the root of the subtree.
#[derive(Debug, Clone)]
pub(super) struct Subtree {
    pub(super) nodes: Range<usize>,
    /// Number of multiplications.
    pub(super) work: f64,
}

/// Sizes of the stacks of a subtree or of the remaining supernodes.
#[derive(Debug, Clone, Default)]
pub(super) struct StackSizes {
    /// Heights of the stacks for even and for odd depth.
    pub(super) heights: [usize; 2],
    /// Maximum number of entries in rows of U stored separately from the factors.
    pub(super) upper: usize,
}

/// Order of work for a given number of threads. The computed values do not depend on this number.
#[derive(Debug, Clone)]
pub(super) struct Schedule {
    /// Subtrees eliminated concurrently.
    pub(super) subtrees: Vec<Subtree>,
    /// All other supernodes. They are eliminated one after the other when the subtrees are complete.
    pub(super) rest: Vec<u32>,
    /// Position of the update of each supernode.
    pub(super) places: Vec<Place>,
    /// Stack sizes of each subtree, followed by the stack sizes of the rest.
    pub(super) stacks: Vec<StackSizes>,
}

impl Schedule {
    pub(super) fn new(analysis: &Analysis, n_threads: usize) -> Self {
        let n = analysis.supernodes.len();
        let subtrees = match n_threads {
            1 => Vec::new(),
            _ => subtrees(analysis, n_threads),
        };
        let mut owner = vec![subtrees.len(); n];
        for (s, subtree) in subtrees.iter().enumerate() {
            owner[subtree.nodes.clone()].fill(s);
        }
        let rest: Vec<u32> =
            (0..n as u32).filter(|&k| owner[k as usize] == subtrees.len()).collect();
        let mut places = vec![Place::default(); n];
        let mut tops = vec![[0; 2]; subtrees.len() + 1];
        let mut sizes = vec![StackSizes::default(); tops.len()];
        // The subtrees are complete before the rest begins.
        let in_time = subtrees
            .iter()
            .flat_map(|subtree| subtree.nodes.clone())
            .chain(rest.iter().map(|&k| k as usize));
        for k in in_time {
            let node = &analysis.supernodes[k];
            let (stacks, side) = (owner[k], usize::from(node.is_odd));
            let top = &mut tops[stacks][side];
            places[k] = Place { stacks, offset: *top };
            *top += node.layout(analysis.kind).n_entries();
            let size = &mut sizes[stacks];
            size.heights[side] = size.heights[side].max(*top);
            if analysis.kind == Kind::Symmetric {
                size.upper = size.upper.max(node.n_columns() * node.n_rows());
            }
            for child in &node.children {
                tops[owner[child.node as usize]][1 - side] -=
                    child.layout(analysis.kind).n_entries();
            }
        }
        Self { subtrees, rest, places, stacks: sizes }
    }

    /// Returns the total number of entries of all stacks.
    pub(super) fn n_entries(&self) -> usize {
        let stacks = self.stacks.iter();
        stacks.map(|size| size.heights[0] + size.heights[1] + size.upper).sum()
    }
}

/// Returns the largest subtrees that are small enough for an even distribution.
fn subtrees(analysis: &Analysis, n_threads: usize) -> Vec<Subtree> {
    let supernodes = &analysis.supernodes;
    let mut first: Vec<usize> = (0..supernodes.len()).collect();
    let mut work: Vec<f64> = Vec::with_capacity(supernodes.len());
    for (k, node) in supernodes.iter().enumerate() {
        let children = node.children.iter().map(|child| child.node as usize);
        first[k] = children.clone().map(|c| first[c]).min().unwrap_or(k);
        let below: f64 = children.map(|c| work[c]).sum();
        work.push(below + node.n_multiplications(analysis.kind));
    }
    let share = analysis.n_multiplications() / n_threads as f64;
    let is_root = |node: &Supernode| node.n_rows() == 0;
    let roots = (0..supernodes.len()).filter(|&k| is_root(&supernodes[k]));
    let mut pending: Vec<usize> = roots.collect();
    let mut found = Vec::new();
    while let Some(k) = pending.pop() {
        if work[k] <= PART_OF_SHARE * share {
            found.push(Subtree { nodes: first[k]..k + 1, work: work[k] });
        } else {
            pending.extend(supernodes[k].children.iter().map(|child| child.node as usize));
        }
    }
    found.sort_unstable_by_key(|subtree| subtree.nodes.start);
    found
}
