//! Orders of elimination.
//!
//! Unknowns with the same neighbours are [one node](Graph); nested dissection (METIS, feature
//! `metis`) and minimum degree order the nodes, and the order that predicts less work is taken.
//! A constraint (a pressure) is ordered with one of the nodes it acts on, right after it: its pivot
//! is then −b S⁻¹ bᵀ with S positive definite, however small its own entry on the diagonal is. It
//! waits longer where fewer than [`BEFORE_A_CONSTRAINT`] unknowns are eliminated before it.

mod amd;
mod graph;
pub(crate) mod lanes;
mod tree;

pub(crate) use graph::Graph;
pub(crate) use lanes::Lanes;
pub(crate) use tree::{NONE, Tree};

/// Unknowns to be eliminated before a constraint that acts on them. One with b ≠ 0 is enough, but
/// an element's b may vanish by symmetry on the constraint's own vertex. Measured on the muscle
/// from 1 to all: the backward error stays at 1e-15, and up to twelve the fill does not grow.
const BEFORE_A_CONSTRAINT: usize = 12;

/// Multiplications of a real LU, by the number of unknowns, that take as long on one thread as a search of
/// [`CAREFUL`]. Measured on blocks and shells of 10 000 to 200 000 unknowns.
const WORTH_A_SEARCH: f64 = 5e5;

/// Most searches. Their orders differ by some 5 % of the work; eight would save 2 % more than four.
const MOST_SEARCHES: usize = 4;

/// Separators of each part that a further search chooses from.
const CAREFUL: u32 = 5;

/// The nodes of `graph` in the order of elimination that predicts the least work, and their tree.
/// The search for it takes about as long as one real LU on one thread, at most.
pub(crate) fn least_work(graph: &Graph) -> Tree {
    let hosts = Hosts::new(graph);
    let tree = |order: Vec<u32>| Tree::new(graph, hosts.expand(graph, &order));
    let dissected = |seed, separators| dissection(&hosts, seed, separators).map(tree);
    let lesser = |a: Tree, b: Tree| match a.multiplications() <= b.multiplications() {
        true => a,
        false => b,
    };
    let by_degree = tree(amd::order(&hosts.neighbours));
    let first = dissected(0, 1).into_iter().fold(by_degree, lesser);
    let n_unknowns: usize = (0..graph.n()).map(|node| graph.weight(node)).sum();
    let searches = first.multiplications() / (WORTH_A_SEARCH * n_unknowns as f64);
    // METIS finds the same order for the seeds 0 and 1.
    let others = (2..).take((searches as usize).min(MOST_SEARCHES));
    let others = others.filter_map(|seed| dissected(seed, CAREFUL));
    others.fold(first, lesser)
}

/// One of many orders of nested dissection, by a `seed` of random numbers; each separator is the smallest of
/// so many.
#[cfg(feature = "metis")]
fn dissection(hosts: &Hosts, seed: u32, separators: u32) -> Option<Vec<u32>> {
    crate::ffi::metis::nested_dissection(&hosts.neighbours, &hosts.weights, seed, separators)
}

#[cfg(not(feature = "metis"))]
fn dissection(_: &Hosts, _seed: u32, _separators: u32) -> Option<Vec<u32>> {
    None
}

/// A graph with each constraint merged into a node that it acts on.
struct Hosts {
    /// The nodes of a graph in each node of this one, constraints last.
    guests: Lanes,
    neighbours: Lanes,
    /// Unknowns of each, by which METIS balances.
    #[cfg(feature = "metis")]
    weights: Vec<i32>,
}

impl Hosts {
    fn new(graph: &Graph) -> Self {
        let n = graph.n();
        let host: Vec<usize> = (0..n).map(|node| host(graph, node)).collect();
        let mut place = vec![u32::MAX; n];
        let mut n_hosts = 0;
        for node in (0..n).filter(|&node| host[node] == node) {
            place[node] = n_hosts as u32;
            n_hosts += 1;
        }
        let own = (0..n).map(|node| (place[host[node]] as usize, node as u32));
        let of_kind = |constrains| {
            let kind =
                move |&(_, node): &(usize, u32)| graph.constrains[node as usize] == constrains;
            own.clone().filter(kind)
        };
        let guests = Lanes::group(n_hosts, of_kind(false).chain(of_kind(true)));
        let mut seen = vec![u32::MAX; n_hosts];
        let mut neighbours = Lanes::with_capacity(n_hosts);
        for k in 0..n_hosts as u32 {
            seen[k as usize] = k;
            let around = |&node: &u32| graph.neighbours.lane(node as usize);
            let all = guests.lane(k as usize).iter().flat_map(around);
            let hosts = all.map(|&node| place[host[node as usize]]);
            neighbours.push(hosts.filter(|&h| std::mem::replace(&mut seen[h as usize], k) != k));
        }
        #[cfg(feature = "metis")]
        let weight = |k| {
            let guests = guests.lane(k).iter();
            guests.map(|&node| graph.weight(node as usize) as i32).sum()
        };
        Self {
            #[cfg(feature = "metis")]
            weights: (0..n_hosts).map(weight).collect(),
            guests,
            neighbours,
        }
    }

    /// The nodes of the whole `graph` from an `order` of hosts, constraints put off until enough
    /// of what they act on is eliminated.
    fn expand(&self, graph: &Graph, order: &[u32]) -> Vec<u32> {
        let mut waits_for: Vec<usize> = (0..graph.n())
            .map(|node| {
                let all: usize = graph.constrained(node).map(|k| graph.weight(k)).sum();
                all.min(BEFORE_A_CONSTRAINT)
            })
            .collect();
        let mut is_due = vec![false; graph.n()];
        let mut result = Vec::with_capacity(graph.n());
        let guests = order.iter().flat_map(|&k| self.guests.lane(k as usize));
        for &node in guests {
            let k = node as usize;
            is_due[k] = true;
            if graph.constrains[k] {
                if waits_for[k] == 0 {
                    result.push(node);
                }
                continue;
            }
            result.push(node);
            for &other in graph.neighbours.lane(k) {
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

/// The node that `node` is ordered with: itself, or for a constraint the one that acts on the same
/// nodes (its own vertex), or where there is none the one with the fewest neighbours.
fn host(graph: &Graph, node: usize) -> usize {
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
    let fewest = || {
        own.iter()
            .copied()
            .min_by_key(|&k| graph.neighbours.lane(k).len())
    };
    vertex.or_else(fewest).unwrap_or(node)
}

#[cfg(all(test, feature = "metis"))]
mod tests {
    use super::*;

    /// Points of a grid with three unknowns each, next to all they share a cell with.
    fn grid([a, b, c]: [usize; 3]) -> Graph {
        let n = a * b * c;
        let mut neighbours = Lanes::with_capacity(n);
        for k in 0..n {
            let (x, y, z) = (k % a, k / a % b, k / (a * b));
            let around = |x: usize, n: usize| x.saturating_sub(1)..(x + 2).min(n);
            let plane = move |z| around(y, b).map(move |y| (z * b + y) * a);
            let points = around(z, c).flat_map(plane);
            let points = points.flat_map(|row| around(x, a).map(move |x| row + x));
            neighbours.push(points.filter(|&other| other != k).map(|other| other as u32));
        }
        Graph {
            members: Lanes::group(n, (0..3 * n).map(|k| (k / 3, k as u32))),
            neighbours,
            constrains: vec![false; n],
        }
    }

    /// Of a cube an order that takes less is looked for and found; the factors of a plate are too cheap for
    /// that.
    #[test]
    fn a_better_order_is_looked_for_where_factors_take_long() {
        for (points, is_dear) in [([26, 26, 26], true), ([80, 80, 2], false)] {
            let graph = grid(points);
            let hosts = Hosts::new(&graph);
            let first = dissection(&hosts, 0, 1).expect("METIS finds an order");
            let first = Tree::new(&graph, hosts.expand(&graph, &first)).multiplications();
            let best = least_work(&graph).multiplications();
            assert_eq!(best < first, is_dear, "{best:e} of {first:e}");
        }
    }
}
