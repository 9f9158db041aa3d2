//! Facets of a mesh, which are edges of triangles or faces of tetrahedra.

use super::simplices::Simplices;

/// Facet as seen from an adjacent element.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Facet {
    /// Vertices in ascending order. In 2D, the last entry is `usize::MAX`.
    key: [usize; 3],
    pub(super) element: usize,
    /// Local index of the element vertex opposite to the facet.
    pub(super) opposite: usize,
    /// Side of the facet on which the element is, for the facet with its vertices in ascending order.
    pub(super) side: bool,
}

impl Facet {
    fn new(mesh: &Simplices<'_>, element: usize, opposite: usize) -> Self {
        let mut key = [usize::MAX; 3];
        let others = (0..=mesh.dimension).filter(|&k| k != opposite);
        for (entry, k) in key.iter_mut().zip(others) {
            *entry = mesh.vertices(element)[k];
        }
        // The sign for removing a vertex from an oriented simplex, times the sign for sorting the other vertices.
        let mut side = opposite.is_multiple_of(2);
        for (i, j) in [(0, 1), (1, 2), (0, 1)] {
            if key[i] > key[j] {
                key.swap(i, j);
                side = !side;
            }
        }
        Self { key, element, opposite, side }
    }

    /// Returns the vertices in ascending order.
    pub(super) fn vertices(&self) -> &[usize] {
        let n = self.key.iter().filter(|v| **v != usize::MAX).count();
        &self.key[..n]
    }
}

/// Returns all facets of all elements. Facets with equal vertices are adjacent in the list.
pub(super) fn sorted_facets(mesh: &Simplices<'_>) -> Vec<Facet> {
    let mut facets: Vec<Facet> = (0..mesh.len())
        .flat_map(|e| (0..=mesh.dimension).map(move |k| (e, k)))
        .map(|(e, k)| Facet::new(mesh, e, k))
        .collect();
    facets.sort_unstable();
    facets
}

/// Groups the facets by their vertices.
pub(super) fn by_vertices(facets: &[Facet]) -> impl Iterator<Item = &[Facet]> {
    facets.chunk_by(|a, b| a.key == b.key)
}
