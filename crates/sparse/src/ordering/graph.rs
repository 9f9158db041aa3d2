//! The compressed graph of a pattern: unknowns with the same neighbors form one node.

use super::adjacency::AdjacencyList;

/// Nodes of unknowns eliminated together, and the adjacency of these nodes.
#[derive(Debug, Clone)]
pub(crate) struct Graph {
    /// Unknowns of each node.
    pub(crate) members: AdjacencyList,
    /// Adjacent nodes of each node.
    pub(crate) neighbors: AdjacencyList,
    /// Whether the unknowns of a node are constraints.
    pub(crate) constrains: Vec<bool>,
}

impl Graph {
    /// Compresses the graph given by the `neighbors` of all unknowns. The components of a displacement become one node.
    /// A constraint never shares a node with the unknowns it acts on.
    pub(crate) fn new(neighbors: &AdjacencyList, is_constraint: &[bool]) -> Self {
        let node_of = nodes(neighbors, is_constraint);
        let n = node_of.iter().max().map_or(0, |&last| last as usize + 1);
        let members =
            AdjacencyList::group(n, node_of.iter().zip(0..).map(|(&node, k)| (node as usize, k)));
        let mut seen = vec![u32::MAX; n];
        let mut between = AdjacencyList::with_capacity(n);
        for node in 0..n as u32 {
            let first = members.lane(node as usize)[0] as usize;
            seen[node as usize] = node;
            let lane = neighbors.lane(first).iter().map(|&k| node_of[k as usize]);
            between.push(
                lane.filter(|&other| std::mem::replace(&mut seen[other as usize], node) != node),
            );
        }
        let constrains = (0..n).map(|node| is_constraint[members.lane(node)[0] as usize]);
        Self { constrains: constrains.collect(), neighbors: between, members }
    }

    /// Creates a graph with one node for each unknown and no constraints.
    #[cfg(test)]
    pub(crate) fn uncompressed(neighbors: AdjacencyList) -> Self {
        let n = neighbors.len();
        Self {
            members: AdjacencyList::group(n, (0..n).map(|k| (k, k as u32))),
            neighbors,
            constrains: vec![false; n],
        }
    }

    pub(crate) fn n(&self) -> usize {
        self.members.len()
    }

    /// Returns the number of unknowns of a node.
    pub(crate) fn weight(&self, node: usize) -> usize {
        self.members.lane(node).len()
    }

    /// Returns the neighbors of `node` that are not constraints.
    pub(crate) fn constrained(&self, node: usize) -> impl Iterator<Item = usize> + '_ {
        let lane = self.neighbors.lane(node).iter().map(|&other| other as usize);
        lane.filter(|&other| !self.constrains[other])
    }
}

/// Returns the node of each unknown. Nodes are numbered in the order of their first unknowns.
fn nodes(neighbors: &AdjacencyList, is_constraint: &[bool]) -> Vec<u32> {
    let n = neighbors.len();
    let mut keys: Vec<(u64, u32)> = (0..n)
        .map(|k| {
            let own = mixed(k as u64);
            let sum = |sum: u64, &other: &u32| sum.wrapping_add(mixed(u64::from(other)));
            (neighbors.lane(k).iter().fold(own, sum), k as u32)
        })
        .collect();
    keys.sort_unstable();
    let mut first: Vec<u32> = (0..n as u32).collect();
    for same_key in keys.chunk_by(|a, b| a.0 == b.0) {
        let mut found: Vec<usize> = Vec::new();
        for k in same_key.iter().map(|&(_, k)| k as usize) {
            let alike = |&other: &usize| {
                is_constraint[k] == is_constraint[other]
                    && have_equal_neighbors(neighbors, k, other)
            };
            match found.iter().copied().find(alike) {
                Some(other) => first[k] = other as u32,
                None => found.push(k),
            }
        }
    }
    let mut count = 0;
    let mut node_of = vec![0; n];
    for k in 0..n {
        if first[k] as usize == k {
            node_of[k] = count;
            count += 1;
        } else {
            node_of[k] = node_of[first[k] as usize];
        }
    }
    node_of
}

/// Returns whether two unknowns are adjacent and have the same other neighbors.
fn have_equal_neighbors(neighbors: &AdjacencyList, a: usize, b: usize) -> bool {
    let (of_a, of_b) = (neighbors.lane(a), neighbors.lane(b));
    let others = |lane, own: usize| {
        let lane: &[u32] = lane;
        lane.iter().filter(move |&&k| k as usize != own)
    };
    of_a.len() == of_b.len()
        && of_a.binary_search(&(b as u32)).is_ok()
        && others(of_a, b).eq(others(of_b, a))
}

/// Mixes the bits of `k` with the finalizer of splitmix64. Sums of the results distinguish sets of indices.
fn mixed(k: u64) -> u64 {
    let k = (k ^ (k >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let k = (k ^ (k >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    k ^ (k >> 31)
}
