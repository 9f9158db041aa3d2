//! The facets of a mesh: edges of triangles, faces of tetrahedra.

use super::simplices::Simplices;

/// A facet as one of the elements beside it has it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Facet {
    /// Its vertices in ascending order; in the plane the last entry is `usize::MAX`.
    key: [usize; 3],
    /// The element.
    pub(super) element: usize,
    /// The place among the element's vertices of the one that is not on the facet.
    pub(super) opposite: usize,
    /// On which side of the facet, with its vertices in ascending order, the element lies.
    pub(super) side: bool,
}

impl Facet {
    fn new(mesh: &Simplices<'_>, element: usize, opposite: usize) -> Self {
        let mut key = [usize::MAX; 3];
        let others = (0..=mesh.dimension).filter(|&k| k != opposite);
        for (entry, k) in key.iter_mut().zip(others) {
            *entry = mesh.vertices(element)[k];
        }
        // The sign of leaving out a vertex of an oriented simplex, times that of sorting the rest.
        let mut side = opposite.is_multiple_of(2);
        for (i, j) in [(0, 1), (1, 2), (0, 1)] {
            if key[i] > key[j] {
                key.swap(i, j);
                side = !side;
            }
        }
        Self {
            key,
            element,
            opposite,
            side,
        }
    }

    /// Its vertices.
    pub(super) fn vertices(&self) -> &[usize] {
        let n = self.key.iter().filter(|v| **v != usize::MAX).count();
        &self.key[..n]
    }
}

/// All facets of all elements, those with the same vertices next to each other.
pub(super) fn sorted_facets(mesh: &Simplices<'_>) -> Vec<Facet> {
    let mut facets: Vec<Facet> = (0..mesh.len())
        .flat_map(|e| (0..=mesh.dimension).map(move |k| (e, k)))
        .map(|(e, k)| Facet::new(mesh, e, k))
        .collect();
    facets.sort_unstable();
    facets
}

/// The facets grouped by their vertices.
pub(super) fn by_vertices(facets: &[Facet]) -> impl Iterator<Item = &[Facet]> {
    facets.chunk_by(|a, b| a.key == b.key)
}
