//! Connected parts of a mesh.

use super::facets::{by_vertices, sorted_facets};
use super::simplices::Simplices;

/// Returns the zero-based index of the connected part of each element. Parts are in the order of their first
/// elements. Elements belong to the same part if they are connected through facets.
pub(super) fn by_facets(dimension: usize, points: &[f64], elements: &[usize]) -> Vec<usize> {
    let mesh = Simplices::new(dimension, points, elements);
    let mut sets = DisjointSets::new(mesh.len());
    for shared in by_vertices(&sorted_facets(&mesh)) {
        for other in &shared[1..] {
            sets.join(shared[0].element, other.element);
        }
    }
    sets.numbers()
}

/// Disjoint-set forest (union–find).
struct DisjointSets {
    parents: Vec<usize>,
}

impl DisjointSets {
    fn new(n: usize) -> Self {
        Self { parents: (0..n).collect() }
    }

    fn root(&mut self, mut member: usize) -> usize {
        while self.parents[member] != member {
            self.parents[member] = self.parents[self.parents[member]];
            member = self.parents[member];
        }
        member
    }

    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        // The smaller index becomes the root, so that parts are in the order of their first elements.
        self.parents[a.max(b)] = a.min(b);
    }

    fn numbers(mut self) -> Vec<usize> {
        let mut numbers = vec![usize::MAX; self.parents.len()];
        let mut next = 0;
        for member in 0..numbers.len() {
            let root = self.root(member);
            if root == member {
                numbers[member] = next;
                next += 1;
            }
            numbers[member] = numbers[root];
        }
        numbers
    }
}
