//! Greedy coloring: groups items whose nodes do not overlap.

use std::collections::HashSet;

/// Distributes `n` items among groups such that no two items of a group share a node. `nodes` returns the nodes of an
/// item. Each item is added to the first possible group.
pub(crate) fn colors<I: IntoIterator<Item = usize>>(
    n: usize,
    nodes: impl Fn(usize) -> I,
) -> Vec<Vec<usize>> {
    let mut colors: Vec<Vec<usize>> = Vec::new();
    let mut taken: Vec<HashSet<usize>> = Vec::new();
    for thing in 0..n {
        let is_free =
            |taken: &HashSet<usize>| nodes(thing).into_iter().all(|x| !taken.contains(&x));
        let color = taken.iter().position(is_free).unwrap_or(colors.len());
        if color == colors.len() {
            colors.push(Vec::new());
            taken.push(HashSet::new());
        }
        colors[color].push(thing);
        taken[color].extend(nodes(thing));
    }
    colors
}
