//! Greedy coloring: groups items whose nodes do not overlap.

use std::collections::HashSet;

/// Distributes `n` items into groups whose members share none of their `nodes`. Each item joins the
/// first possible group.
pub(crate) fn colours<I: IntoIterator<Item = usize>>(
    n: usize,
    nodes: impl Fn(usize) -> I,
) -> Vec<Vec<usize>> {
    let mut colours: Vec<Vec<usize>> = Vec::new();
    let mut taken: Vec<HashSet<usize>> = Vec::new();
    for thing in 0..n {
        let is_free =
            |taken: &HashSet<usize>| nodes(thing).into_iter().all(|x| !taken.contains(&x));
        let colour = taken.iter().position(is_free).unwrap_or(colours.len());
        if colour == colours.len() {
            colours.push(Vec::new());
            taken.push(HashSet::new());
        }
        colours[colour].push(thing);
        taken[colour].extend(nodes(thing));
    }
    colours
}
