//! Elimination tree of a graph for a given order of elimination.

use super::graph::Graph;

/// Marker for a root, which has no parent.
pub(crate) const NONE: u32 = u32::MAX;

/// Parent and number of rows below the diagonal for each node.
///
/// J. W. H. Liu, The role of elimination trees in sparse factorization, SIAM J. Matrix Anal. Appl. 11 (1990) 134–172.
#[derive(Debug, Clone)]
pub(crate) struct Tree {
    /// Nodes of the graph in the order of elimination.
    pub(crate) order: Vec<u32>,
    /// Position of the parent of each node in the elimination order, indexed by the position of the node.
    pub(crate) parents: Vec<u32>,
    /// Number of unknowns of each node, by position.
    pub(crate) widths: Vec<usize>,
    /// Number of rows of L below each node, by position.
    pub(crate) below: Vec<usize>,
}

impl Tree {
    /// Computes the tree of `graph` for the given `order` of its nodes.
    pub(crate) fn new(graph: &Graph, order: Vec<u32>) -> Self {
        let n = order.len();
        let mut place = vec![0; n];
        for (k, &node) in (0..).zip(&order) {
            place[node as usize] = k;
        }
        let earlier = |k: usize| {
            let lane = graph.neighbors.lane(order[k] as usize).iter();
            lane.map(|&node| place[node as usize]).filter(move |&i| (i as usize) < k)
        };
        let parents = parents(n, earlier);
        let widths: Vec<usize> = order.iter().map(|&k| graph.weight(k as usize)).collect();
        // Row k of L consists of the tree paths from its entries in A up to k.
        let mut below = vec![0; n];
        let mut seen_by = vec![NONE; n];
        for k in 0..n {
            seen_by[k] = k as u32;
            for mut i in earlier(k).map(|i| i as usize) {
                while seen_by[i] != k as u32 {
                    seen_by[i] = k as u32;
                    below[i] += widths[k];
                    i = parents[i] as usize;
                }
            }
        }
        Self { order, parents, widths, below }
    }

    /// Returns the number of multiplications of an LU factorization without explicit zeros. The result is a float,
    /// because the number may exceed any integer type for poor orders of large graphs.
    pub(crate) fn multiplications(&self) -> f64 {
        let nodes = self.widths.iter().zip(&self.below);
        nodes
            .flat_map(|(&width, &below)| (0..width).map(move |p| (below + p) as f64))
            .map(|rows| rows * rows)
            .sum()
    }
}

/// Computes the parent of each position from its `earlier` neighbors.
fn parents<I: Iterator<Item = u32>>(n: usize, earlier: impl Fn(usize) -> I) -> Vec<u32> {
    let mut parents = vec![NONE; n];
    // Shortcuts to the current roots (path compression).
    let mut ancestors = vec![NONE; n];
    for k in 0..n {
        for mut i in earlier(k) {
            loop {
                let up = std::mem::replace(&mut ancestors[i as usize], k as u32);
                if up == NONE {
                    parents[i as usize] = k as u32;
                    break;
                }
                if up == k as u32 {
                    break;
                }
                i = up;
            }
        }
    }
    parents
}
