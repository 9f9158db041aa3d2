//! Orders of elimination.
//!
//! Unknowns with the same neighbors form [one node](Graph). The nodes are ordered by nested dissection (METIS, feature
//! `metis`) and by minimum degree, and the order with the lower predicted work is used. A constraint (a pressure) is
//! ordered directly after a node it acts on. Its pivot is then −b S⁻¹ bᵀ with S positive definite, even if its own
//! diagonal entry is small. The constraint is delayed until at least [`MIN_ELIMINATED`] of the unknowns it acts on are
//! eliminated.

pub(crate) mod adjacency;
mod amd;
mod graph;
mod tree;

pub(crate) use adjacency::AdjacencyList;
pub(crate) use graph::Graph;
pub(crate) use tree::{NONE, Tree};

/// Number of unknowns eliminated before a constraint that acts on them. One unknown with b ≠ 0 is sufficient, but the b
/// of an element may vanish by symmetry at the constraint's own vertex. In measurements on the muscle with all values
/// from 1 to the number of such unknowns, the backward error is always about 1e-15, and the fill does not grow for
/// values up to 12.
const MIN_ELIMINATED: usize = 12;

/// Work per unknown, in multiplications of a real LU, that takes as long on one thread as one search with
/// [`SEPARATORS`] separators. The value was measured on blocks and shells with 10 000 to 200 000 unknowns.
const WORK_PER_SEARCH: f64 = 5e5;

/// Maximum number of searches. The predicted work differs by about 5 % between orders. Eight searches would save 2 %
/// more than four.
const MAX_SEARCHES: usize = 4;

/// Number of candidate separators for each part in an additional search.
const SEPARATORS: u32 = 5;

/// Returns the elimination tree with the lowest predicted work. The search takes about as long as one real LU on one
/// thread, or less.
pub(crate) fn least_work(graph: &Graph) -> Tree {
    let merged = ConstraintMerge::new(graph);
    let tree = |order: Vec<u32>| Tree::new(graph, merged.expand(graph, &order));
    let dissected = |seed, separators| dissection(&merged, seed, separators).map(tree);
    let lesser = |a: Tree, b: Tree| match a.multiplications() <= b.multiplications() {
        true => a,
        false => b,
    };
    let by_degree = tree(amd::order(&merged.neighbors));
    let first = dissected(0, 1).into_iter().fold(by_degree, lesser);
    let n_unknowns: usize = (0..graph.n()).map(|node| graph.weight(node)).sum();
    let searches = first.multiplications() / (WORK_PER_SEARCH * n_unknowns as f64);
    // METIS finds the same order for the seeds 0 and 1.
    let others = (2..).take((searches as usize).min(MAX_SEARCHES));
    let others = others.filter_map(|seed| dissected(seed, SEPARATORS));
    others.fold(first, lesser)
}

/// Orders the nodes by nested dissection with the given `seed`. Selects the smallest of `separators` candidate
/// separators for each part.
#[cfg(feature = "metis")]
fn dissection(merged: &ConstraintMerge, seed: u32, separators: u32) -> Option<Vec<u32>> {
    crate::ffi::metis::nested_dissection(&merged.neighbors, &merged.weights, seed, separators)
}

#[cfg(not(feature = "metis"))]
fn dissection(_: &ConstraintMerge, _seed: u32, _separators: u32) -> Option<Vec<u32>> {
    None
}

/// A graph in which each constraint is merged into a node that it acts on.
struct ConstraintMerge {
    /// Original nodes of each merged node, with the constraints last.
    members: AdjacencyList,
    neighbors: AdjacencyList,
    /// Number of unknowns of each merged node, balanced by METIS.
    #[cfg(feature = "metis")]
    weights: Vec<i32>,
}

impl ConstraintMerge {
    fn new(graph: &Graph) -> Self {
        let n = graph.n();
        let representatives: Vec<usize> = (0..n).map(|node| representative(graph, node)).collect();
        let mut place = vec![u32::MAX; n];
        let mut n_merged = 0;
        for node in (0..n).filter(|&node| representatives[node] == node) {
            place[node] = n_merged as u32;
            n_merged += 1;
        }
        let own = (0..n).map(|node| (place[representatives[node]] as usize, node as u32));
        let of_kind = |constrains| {
            let kind =
                move |&(_, node): &(usize, u32)| graph.constrains[node as usize] == constrains;
            own.clone().filter(kind)
        };
        let members = AdjacencyList::group(n_merged, of_kind(false).chain(of_kind(true)));
        let mut seen = vec![u32::MAX; n_merged];
        let mut neighbors = AdjacencyList::with_capacity(n_merged);
        for k in 0..n_merged as u32 {
            seen[k as usize] = k;
            let around = |&node: &u32| graph.neighbors.lane(node as usize);
            let all = members.lane(k as usize).iter().flat_map(around);
            let nodes = all.map(|&node| place[representatives[node as usize]]);
            neighbors.push(nodes.filter(|&h| std::mem::replace(&mut seen[h as usize], k) != k));
        }
        #[cfg(feature = "metis")]
        let weight = |k| {
            let members = members.lane(k).iter();
            members.map(|&node| graph.weight(node as usize) as i32).sum()
        };
        Self {
            #[cfg(feature = "metis")]
            weights: (0..n_merged).map(weight).collect(),
            members,
            neighbors,
        }
    }

    /// Expands an `order` of merged nodes to the nodes of `graph`. Each constraint is delayed until enough of the
    /// unknowns that it acts on are eliminated.
    fn expand(&self, graph: &Graph, order: &[u32]) -> Vec<u32> {
        let mut waits_for: Vec<usize> = (0..graph.n())
            .map(|node| {
                let all: usize = graph.constrained(node).map(|k| graph.weight(k)).sum();
                all.min(MIN_ELIMINATED)
            })
            .collect();
        let mut is_due = vec![false; graph.n()];
        let mut result = Vec::with_capacity(graph.n());
        let members = order.iter().flat_map(|&k| self.members.lane(k as usize));
        for &node in members {
            let k = node as usize;
            is_due[k] = true;
            if graph.constrains[k] {
                if waits_for[k] == 0 {
                    result.push(node);
                }
                continue;
            }
            result.push(node);
            for &other in graph.neighbors.lane(k) {
                let o = other as usize;
                if !graph.constrains[o] || waits_for[o] == 0 {
                    continue;
                }
                waits_for[o] = waits_for[o].saturating_sub(graph.weight(k));
                if waits_for[o] == 0 && is_due[o] {
                    result.push(other);
                }
            }
        }
        result
    }
}

/// Returns the node into which `node` is merged. For a constraint, this is the neighbor with the same neighborhood (its
/// own vertex) or, if no such node exists, the neighbor with the fewest neighbors.
fn representative(graph: &Graph, node: usize) -> usize {
    if !graph.constrains[node] {
        return node;
    }
    let mut own: Vec<usize> = graph.constrained(node).collect();
    own.sort_unstable();
    let acts_on_the_same = |&k: &usize| {
        let mut all: Vec<usize> = graph.constrained(k).chain([k]).collect();
        all.len() == own.len() && {
            all.sort_unstable();
            all == own
        }
    };
    let vertex = own.iter().copied().find(acts_on_the_same);
    let fewest = || own.iter().copied().min_by_key(|&k| graph.neighbors.lane(k).len());
    vertex.or_else(fewest).unwrap_or(node)
}

#[cfg(all(test, feature = "metis"))]
mod tests {
    use super::*;

    /// Returns the graph of a grid of points with three unknowns each. Points of a common cell are adjacent.
    fn grid([a, b, c]: [usize; 3]) -> Graph {
        let n = a * b * c;
        let mut neighbors = AdjacencyList::with_capacity(n);
        for k in 0..n {
            let (x, y, z) = (k % a, k / a % b, k / (a * b));
            let around = |x: usize, n: usize| x.saturating_sub(1)..(x + 2).min(n);
            let plane = move |z| around(y, b).map(move |y| (z * b + y) * a);
            let points = around(z, c).flat_map(plane);
            let points = points.flat_map(|row| around(x, a).map(move |x| row + x));
            neighbors.push(points.filter(|&other| other != k).map(|other| other as u32));
        }
        Graph {
            members: AdjacencyList::group(n, (0..3 * n).map(|k| (k / 3, k as u32))),
            neighbors,
            constrains: vec![false; n],
        }
    }

    /// Checks that additional searches find a better order for a cube. The factors of a plate are too cheap to justify
    /// such searches.
    #[test]
    fn a_better_ordering_is_sought_for_expensive_factors() {
        for (points, is_dear) in [([26, 26, 26], true), ([80, 80, 2], false)] {
            let graph = grid(points);
            let merged = ConstraintMerge::new(&graph);
            let first = dissection(&merged, 0, 1).expect("METIS finds an order");
            let first = Tree::new(&graph, merged.expand(&graph, &first)).multiplications();
            let best = least_work(&graph).multiplications();
            assert_eq!(best < first, is_dear, "{best:e} of {first:e}");
        }
    }
}
