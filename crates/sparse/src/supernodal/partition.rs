//! Supernode partition: which nodes of the elimination tree are eliminated together, and in which order.

use std::ops::Range;

use crate::ordering::{Graph, NONE, Tree};

/// Maximum fraction of explicit zeros in the result when a supernode is merged into its parent. Dense arithmetic on a
/// few zeros is cheaper than another front. In measurements on matrices of the muscle model, values between 0.1 and 0.2
/// are fastest.
const ZEROS_ALLOWED: f64 = 0.15;

/// Maximum fraction of explicit zeros for supernodes with at least [`WIDE`] columns. Their fronts are already large
/// enough, and more zeros would only cost memory and arithmetic.
const ZEROS_ALLOWED_WIDE: f64 = 0.05;
const WIDE: usize = 64;

/// Columns of a supernode, and the rows below them.
#[derive(Debug, Clone)]
pub(super) struct Shape {
    /// Columns, in the order of elimination.
    pub(super) columns: Range<usize>,
    /// Rows below the columns, in ascending order.
    pub(super) rows: Vec<u32>,
}

/// Returns the unknowns in the final order, and the supernodes. Each supernode directly follows its subtree.
pub(super) fn partition(graph: &Graph, tree: Tree) -> (Vec<u32>, Vec<Shape>) {
    let parts = merge(&tree);
    let sequence = postorder(&parts);
    shapes(graph, &tree, &parts, &sequence)
}

/// Supernode that is being merged, identified by its last node.
#[derive(Debug, Clone, Default)]
struct Part {
    /// Positions in the tree, in the order of elimination. The list is empty after the part is merged into its parent.
    nodes: Vec<u32>,
    width: usize,
    below: usize,
    /// Number of explicit zeros in L.
    zeros: usize,
    children: Vec<u32>,
}

impl Part {
    /// Returns the number of zeros added to the columns of `child` if it is merged.
    fn zeros_from(&self, child: &Self) -> usize {
        child.width * (self.width + self.below - child.below)
    }

    /// Returns whether few enough zeros are added if `child` is merged.
    fn takes(&self, child: &Self) -> bool {
        let width = self.width + child.width;
        let entries = width * (width - 1) / 2 + width * self.below;
        let zeros = self.zeros + child.zeros + self.zeros_from(child);
        let allowed = if width < WIDE { ZEROS_ALLOWED } else { ZEROS_ALLOWED_WIDE };
        zeros as f64 <= allowed * entries as f64
    }
}

/// Merges supernodes from the leaves upward, starting with the children that add the fewest zeros.
fn merge(tree: &Tree) -> Vec<Part> {
    let n = tree.order.len();
    let mut parts: Vec<Part> = vec![Part::default(); n];
    for k in 0..n {
        let mut own = Part {
            nodes: Vec::new(),
            width: tree.widths[k],
            below: tree.below[k],
            zeros: 0,
            children: Vec::new(),
        };
        let mut children = std::mem::take(&mut parts[k].children);
        children.sort_by_key(|&c| own.zeros_from(&parts[c as usize]));
        for c in children {
            if own.takes(&parts[c as usize]) {
                let child = std::mem::take(&mut parts[c as usize]);
                own.zeros += child.zeros + own.zeros_from(&child);
                own.width += child.width;
                own.children.extend(child.children);
                let earlier = std::mem::replace(&mut own.nodes, child.nodes);
                own.nodes.extend(earlier);
            } else {
                own.children.push(c);
            }
        }
        own.nodes.push(k as u32);
        parts[k] = own;
        if tree.parents[k] != NONE {
            parts[tree.parents[k] as usize].children.push(k as u32);
        }
    }
    parts
}

/// Returns the remaining supernodes in postorder. The children are sorted so that waiting updates need the least
/// storage.
///
/// J. W. H. Liu, On the storage requirement in the out-of-core multifrontal method for sparse factorization, ACM Trans.
/// Math. Softw. 12 (1986) 249–264.
fn postorder(parts: &[Part]) -> Vec<u32> {
    let n = parts.len();
    let mut peaks = vec![0; n];
    let mut sorted: Vec<Vec<u32>> = vec![Vec::new(); n];
    let mut is_child = vec![false; n];
    let update = |k: u32| parts[k as usize].below.pow(2);
    for k in (0..n).filter(|&k| !parts[k].nodes.is_empty()) {
        let mut children = parts[k].children.clone();
        children.sort_by_key(|&c| std::cmp::Reverse(peaks[c as usize] - update(c)));
        let (mut waiting, mut peak) = (0, 0);
        for &c in &children {
            is_child[c as usize] = true;
            peak = peak.max(waiting + peaks[c as usize]);
            waiting += update(c);
        }
        peaks[k] = peak.max(waiting + update(k as u32));
        sorted[k] = children;
    }
    let mut sequence = Vec::new();
    let roots =
        (0..n as u32).filter(|&k| !parts[k as usize].nodes.is_empty() && !is_child[k as usize]);
    let mut stack: Vec<(u32, bool)> = roots.map(|k| (k, false)).collect();
    stack.reverse();
    while let Some((k, children_done)) = stack.pop() {
        if children_done {
            sequence.push(k);
        } else {
            stack.push((k, true));
            stack.extend(sorted[k as usize].iter().rev().map(|&child| (child, false)));
        }
    }
    sequence
}

/// Numbers the unknowns in the sequence of supernodes. Determines the rows of each supernode from its entries and from
/// the rows of its children.
fn shapes(graph: &Graph, tree: &Tree, parts: &[Part], sequence: &[u32]) -> (Vec<u32>, Vec<Shape>) {
    // For each node of the graph, `place` is its position in the order of nodes, and `start` is its first column.
    let n = graph.n();
    let (mut place, mut start) = (vec![0u32; n], vec![0u32; n]);
    let mut nodes: Vec<u32> = Vec::with_capacity(n);
    let mut order: Vec<u32> = Vec::new();
    for &part in sequence {
        for &k in &parts[part as usize].nodes {
            let node = tree.order[k as usize];
            place[node as usize] = nodes.len() as u32;
            start[node as usize] = order.len() as u32;
            nodes.push(node);
            order.extend(graph.members.lane(node as usize));
        }
    }
    let mut shapes: Vec<Shape> = Vec::with_capacity(sequence.len());
    let mut rows: Vec<Vec<u32>> = vec![Vec::new(); parts.len()];
    let mut seen_by = vec![NONE; n];
    let mut first = 0;
    for &part in sequence {
        let own = &parts[part as usize];
        let end = first + own.nodes.len();
        let mut below: Vec<u32> = Vec::new();
        let mut see = |other: u32| {
            let other = other as usize;
            if other >= end && std::mem::replace(&mut seen_by[other], part) != part {
                below.push(other as u32);
            }
        };
        for &node in &nodes[first..end] {
            let lane = graph.neighbors.lane(node as usize).iter();
            lane.for_each(|&other| see(place[other as usize]));
        }
        for &child in &own.children {
            rows[child as usize].iter().for_each(|&other| see(other));
        }
        below.sort_unstable();
        let columns_of = |place: &u32| {
            let node = nodes[*place as usize] as usize;
            start[node]..start[node] + graph.weight(node) as u32
        };
        let column = start[nodes[first] as usize] as usize;
        shapes.push(Shape {
            columns: column..column + own.width,
            rows: below.iter().flat_map(columns_of).collect(),
        });
        for &child in &own.children {
            rows[child as usize] = Vec::new();
        }
        rows[part as usize] = below;
        first = end;
    }
    (order, shapes)
}
