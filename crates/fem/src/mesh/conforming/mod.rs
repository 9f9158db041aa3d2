//! Checks that elements form a conforming mesh: neighbors share whole facets and no region is covered twice.
//!
//! Shared facets are found by their vertices. Facets and elements without common vertices are compared by
//! position, but only at the boundary. This is sufficient, because the number of elements that cover a point
//! changes only across facets with one element. The cost is O(n log n).

use super::boxes::{BoxTree, Extent};
use super::defect::{DefectKind, ElementName, MeshDefect};
use super::facets::{Facet, by_vertices, sorted_facets};
use super::simplices::{Point, Simplices, cross, diameter, dot, minus, normal, outward_normal};

/// Largest distance of touching facets, relative to the size of the facets. Files with six digits reproduce
/// positions within this distance.
const TOUCHING: f64 = 1e-6;
/// Smallest penetration depth of overlapping elements, relative to the size of the elements. It is far above
/// rounding errors.
const OVERLAPPING: f64 = 1e-9;

/// Checks that elements of positive volume form a conforming mesh.
///
/// `points` has `dimension` coordinates per point, `elements` has `dimension + 1` vertices per element, and
/// `reoriented` holds the indices of elements whose vertex order was inverted.
///
/// # Errors
/// Returns the first [`MeshDefect`], in which the elements are named by their index.
pub(super) fn conforming(
    dimension: usize,
    points: &[f64],
    elements: &[usize],
    reoriented: &[usize],
) -> Result<(), MeshDefect> {
    let mesh = Simplices::new(dimension, points, elements);
    let facets = sorted_facets(&mesh);
    let mut boundary = Vec::new();
    for shared in by_vertices(&facets) {
        match shared {
            [one] => boundary.push(*one),
            [a, b] if a.side != b.side => {}
            facets => return Err(overfull_facet(&mesh, facets, reoriented)),
        }
    }
    let boundary = Boundary::new(mesh, &boundary);
    boundary.check_touching()?;
    boundary.check_overlap()
}

fn defect(kind: DefectKind, elements: &[usize], near: Vec<f64>) -> MeshDefect {
    let elements = elements.iter().map(|&e| ElementName::Index(e)).collect();
    MeshDefect { kind, elements, near }
}

/// Returns the kind of defect of a facet that has several elements on one side.
fn overfull_facet(mesh: &Simplices<'_>, facets: &[Facet], reoriented: &[usize]) -> MeshDefect {
    let mut elements: Vec<usize> = facets.iter().map(|facet| facet.element).collect();
    let sorted_vertices = |facet: &Facet| {
        let mut vertices = mesh.vertices(facet.element).to_vec();
        vertices.sort_unstable();
        vertices
    };
    let duplicate = facets.iter().enumerate().find_map(|(i, a)| {
        let same = |b: &&Facet| sorted_vertices(a) == sorted_vertices(b);
        Some([a.element, facets[..i].iter().find(same)?.element])
    });
    let near = |e: usize| mesh.middle(mesh.vertices(e));
    if let Some([second, first]) = duplicate {
        return defect(DefectKind::Duplicate, &[first, second], near(first));
    }
    let near = mesh.middle(facets[0].vertices());
    if elements.len() > 2 {
        return defect(DefectKind::NonManifold, &elements, near);
    }
    let is_reoriented = |e: &usize| reoriented.binary_search(e).is_ok();
    elements.sort_by_key(is_reoriented);
    let inverted = elements.iter().filter(|e| is_reoriented(e)).count() == 1;
    defect(DefectKind::SameSide { inverted }, &elements, near)
}

/// Boundary facet, which has an element on one side only.
struct BoundaryFacet {
    element: usize,
    vertices: Vec<usize>,
    corners: Vec<Point>,
    /// Unit normal that points away from the element.
    outward: Point,
    size: f64,
}

struct Boundary<'a> {
    mesh: Simplices<'a>,
    facets: Vec<BoundaryFacet>,
}

impl<'a> Boundary<'a> {
    fn new(mesh: Simplices<'a>, facets: &[Facet]) -> Self {
        let free = |facet: &Facet| {
            let vertices = facet.vertices().to_vec();
            let corners: Vec<Point> = vertices.iter().map(|&v| mesh.point(v)).collect();
            let inner = mesh.point(mesh.vertices(facet.element)[facet.opposite]);
            BoundaryFacet {
                element: facet.element,
                size: diameter(&corners),
                outward: outward_normal(&corners, inner),
                vertices,
                corners,
            }
        };
        Self { mesh, facets: facets.iter().map(free).collect() }
    }

    /// Returns an error if facets touch but do not share their vertices.
    fn check_touching(&self) -> Result<(), MeshDefect> {
        let extent = |f: &BoundaryFacet| Extent::around(&f.corners, TOUCHING * f.size);
        let tree = BoxTree::new(self.facets.iter().map(extent).collect());
        for (i, f) in self.facets.iter().enumerate() {
            let against = |j: usize| (j < i && touch(f, &self.facets[j])).then_some(j);
            if let Some(j) = tree.find(&extent(f), against) {
                let g = &self.facets[j];
                let kind = match same_corners(f, g) {
                    true => DefectKind::Crack,
                    false => DefectKind::HangingNode,
                };
                let smaller = if f.size < g.size { f } else { g };
                let near = self.mesh.middle(&smaller.vertices);
                return Err(defect(kind, &[g.element, f.element], near));
            }
        }
        Ok(())
    }

    /// Returns an error if elements overlap an element at the boundary.
    fn check_overlap(&self) -> Result<(), MeshDefect> {
        let mesh = &self.mesh;
        let extent = |e: usize| Extent::around(&mesh.corners(e), 0.0);
        let tree = BoxTree::new((0..mesh.len()).map(extent).collect());
        let mut elements: Vec<usize> = self.facets.iter().map(|f| f.element).collect();
        elements.sort_unstable();
        elements.dedup();
        for e in elements {
            let corners = mesh.corners(e);
            let over = |other: usize| {
                let overlap = other != e && overlap(mesh.dimension, &corners, &mesh.corners(other));
                overlap.then_some(other)
            };
            if let Some(other) = tree.find(&extent(e), over) {
                let pair = [e.min(other), e.max(other)];
                let near = smaller_middle(mesh, pair);
                return Err(defect(DefectKind::Overlap, &pair, near));
            }
        }
        Ok(())
    }
}

fn smaller_middle(mesh: &Simplices<'_>, pair: [usize; 2]) -> Vec<f64> {
    let sizes = pair.map(|e| diameter(&mesh.corners(e)));
    mesh.middle(mesh.vertices(pair[usize::from(sizes[1] < sizes[0])]))
}

/// Returns whether two facets touch back to back over a positive area (or length in 2D).
fn touch(f: &BoundaryFacet, g: &BoundaryFacet) -> bool {
    let size = f.size.min(g.size);
    if dot(f.outward, g.outward) > TOUCHING - 1.0 {
        return false;
    }
    let height = |p: Point| dot(minus(p, f.corners[0]), f.outward).abs();
    if g.corners.iter().any(|&p| height(p) > TOUCHING * size) {
        return false;
    }
    // The separating axes are in the common plane. They are the edge itself in 2D, and the edge normals of both
    // triangles in 3D.
    let mut axes = Vec::new();
    for corners in [&f.corners, &g.corners] {
        for (i, &a) in corners.iter().enumerate() {
            let edge = minus(corners[(i + 1) % corners.len()], a);
            axes.push(match corners.len() {
                2 => edge,
                _ => cross(edge, f.outward),
            });
        }
    }
    !axes.into_iter().any(|axis| separated(axis, &f.corners, &g.corners, TOUCHING * size))
}

/// Returns whether each corner of one facet coincides with a corner of the other.
fn same_corners(f: &BoundaryFacet, g: &BoundaryFacet) -> bool {
    let near = |a: &Point, b: &Point| diameter(&[*a, *b]) <= TOUCHING * f.size;
    f.corners.iter().all(|a| g.corners.iter().any(|b| near(a, b)))
}

/// Returns whether the interiors of two simplices intersect, according to the separating axis theorem. It is
/// sufficient to check the facet normals and, in 3D, the cross products of edges.
fn overlap(dimension: usize, a: &[Point], b: &[Point]) -> bool {
    let depth = OVERLAPPING * diameter(a).min(diameter(b));
    let separates = |axis: Point| separated(axis, a, b, depth);
    let separated_by_facets = |corners: &[Point]| {
        (0..corners.len()).any(|opposite| {
            let mut facet = corners.to_vec();
            facet.remove(opposite);
            separates(normal(&facet))
        })
    };
    if separated_by_facets(a) || separated_by_facets(b) {
        return false;
    }
    let edges = |corners: &[Point]| {
        let mut edges = Vec::new();
        for (i, &p) in corners.iter().enumerate() {
            edges.extend(corners[..i].iter().map(|&q| minus(p, q)));
        }
        edges
    };
    let has_separating_axis = dimension == 3
        && edges(a).into_iter().any(|e| edges(b).into_iter().any(|f| separates(cross(e, f))));
    !has_separating_axis
}

/// Returns whether the projections of two point sets onto an axis are disjoint or overlap by at most `depth`.
/// Returns `false` if the axis has zero length, as for parallel edges.
fn separated(axis: Point, a: &[Point], b: &[Point], depth: f64) -> bool {
    let length = dot(axis, axis).sqrt();
    let projection = |points: &[Point]| {
        // Coordinates are relative to a[0], because absolute coordinates may be large compared with the elements.
        let along = points.iter().map(|&p| dot(axis, minus(p, a[0])));
        along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
    };
    let ((low_a, high_a), (low_b, high_b)) = (projection(a), projection(b));
    length > 0.0 && high_a.min(high_b) - low_a.max(low_b) <= depth * length
}

#[cfg(test)]
mod tests;
