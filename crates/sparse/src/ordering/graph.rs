//! The graph of a pattern, compressed: unknowns with the same neighbours are one node.

use super::lanes::Lanes;

/// Nodes of unknowns that are eliminated together, and which of them meet.
#[derive(Debug, Clone)]
pub(crate) struct Graph {
    /// The unknowns of each node.
    pub(crate) members: Lanes,
    /// The nodes next to each node.
    pub(crate) neighbours: Lanes,
    /// Whether the unknowns of a node are constraints.
    pub(crate) constrains: Vec<bool>,
}

impl Graph {
    /// Finds the nodes in the `neighbours` of all unknowns; the components of a displacement are
    /// one. Constraints are kept apart from the unknowns they act on.
    pub(crate) fn new(neighbours: &Lanes, is_constraint: &[bool]) -> Self {
        let node_of = nodes(neighbours, is_constraint);
        let n = node_of.iter().max().map_or(0, |&last| last as usize + 1);
        let members = Lanes::group(
            n,
            node_of.iter().zip(0..).map(|(&node, k)| (node as usize, k)),
        );
        let mut seen = vec![u32::MAX; n];
        let mut between = Lanes::with_capacity(n);
        for node in 0..n as u32 {
            let first = members.lane(node as usize)[0] as usize;
            seen[node as usize] = node;
            let lane = neighbours.lane(first).iter().map(|&k| node_of[k as usize]);
            between.push(
                lane.filter(|&other| std::mem::replace(&mut seen[other as usize], node) != node),
            );
        }
        let constrains = (0..n).map(|node| is_constraint[members.lane(node)[0] as usize]);
        Self {
            constrains: constrains.collect(),
            neighbours: between,
            members,
        }
    }

    /// Each unknown a node, none a constraint.
    pub(crate) fn uncompressed(neighbours: Lanes) -> Self {
        let n = neighbours.len();
        Self {
            members: Lanes::group(n, (0..n).map(|k| (k, k as u32))),
            neighbours,
            constrains: vec![false; n],
        }
    }

    /// The number of nodes.
    pub(crate) fn n(&self) -> usize {
        self.members.len()
    }

    /// The number of unknowns of a node.
    pub(crate) fn weight(&self, node: usize) -> usize {
        self.members.lane(node).len()
    }

    /// The neighbours of `node` that are no constraints.
    pub(crate) fn constrained(&self, node: usize) -> impl Iterator<Item = usize> + '_ {
        let lane = self
            .neighbours
            .lane(node)
            .iter()
            .map(|&other| other as usize);
        lane.filter(|&other| !self.constrains[other])
    }
}

/// The node of each unknown; nodes count in the order of their first unknowns.
fn nodes(neighbours: &Lanes, is_constraint: &[bool]) -> Vec<u32> {
    let n = neighbours.len();
    let mut keys: Vec<(u64, u32)> = (0..n)
        .map(|k| {
            let own = mixed(k as u64);
            let sum = |sum: u64, &other: &u32| sum.wrapping_add(mixed(u64::from(other)));
            (neighbours.lane(k).iter().fold(own, sum), k as u32)
        })
        .collect();
    keys.sort_unstable();
    let mut first: Vec<u32> = (0..n as u32).collect();
    for same_key in keys.chunk_by(|a, b| a.0 == b.0) {
        let mut found: Vec<usize> = Vec::new();
        for k in same_key.iter().map(|&(_, k)| k as usize) {
            let alike = |&other: &usize| {
                is_constraint[k] == is_constraint[other] && meet_the_same(neighbours, k, other)
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

/// Whether two unknowns are neighbours of each other and have all others in common.
fn meet_the_same(neighbours: &Lanes, a: usize, b: usize) -> bool {
    let (of_a, of_b) = (neighbours.lane(a), neighbours.lane(b));
    let others = |lane, own: usize| {
        let lane: &[u32] = lane;
        lane.iter().filter(move |&&k| k as usize != own)
    };
    of_a.len() == of_b.len()
        && of_a.binary_search(&(b as u32)).is_ok()
        && others(of_a, b).eq(others(of_b, a))
}

/// The finaliser of splitmix64: sums of its values tell sets apart.
fn mixed(k: u64) -> u64 {
    let k = (k ^ (k >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let k = (k ^ (k >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    k ^ (k >> 31)
}
