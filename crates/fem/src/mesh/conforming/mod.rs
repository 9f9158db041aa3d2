//! Whether elements make up a body: neighbours share whole facets, and no place is covered twice.
//!
//! Shared facets are compared by their vertices. What shares no vertices is compared by its place,
//! and that only at the boundary: the number of elements over a place changes only across facets
//! that have one element, so whatever is covered twice reaches such a facet, and so does whatever
//! touches without sharing. The work is O(n log n).

use super::boxes::{BoxTree, Extent};
use super::defect::{DefectKind, ElementName, MeshDefect};
use super::facets::{Facet, by_vertices, sorted_facets};
use super::simplices::{Point, Simplices, cross, diameter, dot, minus};

/// Facets this near, as a fraction of their size, touch: what files of six digits make of one place.
const TOUCHING: f64 = 1e-6;
/// Elements this deep in each other, as a fraction of their size, overlap: far beyond rounding.
const OVERLAPPING: f64 = 1e-9;

/// Checks that elements of positive volume make up a body.
///
/// `points` has `dimension` coordinates a point, `elements` `dimension + 1` vertices an element;
/// `turned` holds the elements whose vertices ran the other way round.
///
/// # Errors
/// The first [`MeshDefect`], with the elements by index.
pub(super) fn conforming(
    dimension: usize,
    points: &[f64],
    elements: &[usize],
    turned: &[usize],
) -> Result<(), MeshDefect> {
    let mesh = Simplices::new(dimension, points, elements);
    let facets = sorted_facets(&mesh);
    let mut boundary = Vec::new();
    for shared in by_vertices(&facets) {
        match shared {
            [one] => boundary.push(*one),
            [a, b] if a.side != b.side => {}
            crowd => return Err(crowded(&mesh, crowd, turned)),
        }
    }
    let boundary = Boundary::new(mesh, &boundary);
    boundary.touching()?;
    boundary.overlapping()
}

fn defect(kind: DefectKind, elements: &[usize], near: Vec<f64>) -> MeshDefect {
    let elements = elements.iter().map(|&e| ElementName::Index(e)).collect();
    MeshDefect {
        kind,
        elements,
        near,
    }
}

/// What is wrong where more than one element lies on a side of a facet.
fn crowded(mesh: &Simplices<'_>, crowd: &[Facet], turned: &[usize]) -> MeshDefect {
    let mut elements: Vec<usize> = crowd.iter().map(|facet| facet.element).collect();
    let sorted_vertices = |facet: &Facet| {
        let mut vertices = mesh.vertices(facet.element).to_vec();
        vertices.sort_unstable();
        vertices
    };
    let twice = crowd.iter().enumerate().find_map(|(i, a)| {
        let same = |b: &&Facet| sorted_vertices(a) == sorted_vertices(b);
        Some([a.element, crowd[..i].iter().find(same)?.element])
    });
    let near = |e: usize| mesh.middle(mesh.vertices(e));
    if let Some([second, first]) = twice {
        return defect(DefectKind::Twice, &[first, second], near(first));
    }
    let near = mesh.middle(crowd[0].vertices());
    if elements.len() > 2 {
        return defect(DefectKind::Crowded, &elements, near);
    }
    let is_turned = |e: &usize| turned.binary_search(e).is_ok();
    elements.sort_by_key(is_turned);
    let inverted = elements.iter().filter(|e| is_turned(e)).count() == 1;
    defect(DefectKind::SameSide { inverted }, &elements, near)
}

/// A facet with an element on one side only.
struct Free {
    element: usize,
    vertices: Vec<usize>,
    corners: Vec<Point>,
    /// Normal of unit length, away from the element.
    outward: Point,
    size: f64,
}

struct Boundary<'a> {
    mesh: Simplices<'a>,
    facets: Vec<Free>,
}

impl<'a> Boundary<'a> {
    fn new(mesh: Simplices<'a>, facets: &[Facet]) -> Self {
        let free = |facet: &Facet| {
            let vertices = facet.vertices().to_vec();
            let corners: Vec<Point> = vertices.iter().map(|&v| mesh.point(v)).collect();
            let inside = minus(
                mesh.point(mesh.vertices(facet.element)[facet.opposite]),
                corners[0],
            );
            let normal = normal(&corners);
            let length = dot(normal, normal).sqrt().copysign(-dot(normal, inside));
            Free {
                element: facet.element,
                size: diameter(&corners),
                outward: normal.map(|n| n / length),
                vertices,
                corners,
            }
        };
        Self {
            mesh,
            facets: facets.iter().map(free).collect(),
        }
    }

    /// Finds facets that lie against each other without being one.
    fn touching(&self) -> Result<(), MeshDefect> {
        let extent = |f: &Free| Extent::around(&f.corners, TOUCHING * f.size);
        let tree = BoxTree::new(self.facets.iter().map(extent).collect());
        for (i, f) in self.facets.iter().enumerate() {
            let against = |j: usize| (j < i && touch(f, &self.facets[j])).then_some(j);
            if let Some(j) = tree.find(&extent(f), against) {
                let g = &self.facets[j];
                let kind = match same_corners(f, g) {
                    true => DefectKind::Crack,
                    false => DefectKind::Hanging,
                };
                let smaller = if f.size < g.size { f } else { g };
                let near = self.mesh.middle(&smaller.vertices);
                return Err(defect(kind, &[g.element, f.element], near));
            }
        }
        Ok(())
    }

    /// Finds elements that lie over one of the boundary's.
    fn overlapping(&self) -> Result<(), MeshDefect> {
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

/// A normal of an edge in the plane or of a triangle in space.
fn normal(corners: &[Point]) -> Point {
    match *corners {
        [a, b] => cross(minus(b, a), [0.0, 0.0, 1.0]),
        [a, b, c] => cross(minus(b, a), minus(c, a)),
        _ => unreachable!("a facet of a triangle or of a tetrahedron"),
    }
}

/// Whether two facets lie against each other, back to back, over more than a rim.
fn touch(f: &Free, g: &Free) -> bool {
    let size = f.size.min(g.size);
    if dot(f.outward, g.outward) > TOUCHING - 1.0 {
        return false;
    }
    let height = |p: Point| dot(minus(p, f.corners[0]), f.outward).abs();
    if g.corners.iter().any(|&p| height(p) > TOUCHING * size) {
        return false;
    }
    // In their common plane: along the edge, or across each edge of both triangles.
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
    !axes
        .into_iter()
        .any(|axis| apart(axis, &f.corners, &g.corners, TOUCHING * size))
}

/// Whether each corner of one lies at a corner of the other.
fn same_corners(f: &Free, g: &Free) -> bool {
    let near = |a: &Point, b: &Point| diameter(&[*a, *b]) <= TOUCHING * f.size;
    f.corners
        .iter()
        .all(|a| g.corners.iter().any(|b| near(a, b)))
}

/// Whether the interiors of two simplices meet: no axis separates them. Faces' normals and, in
/// space, the products of their edges are all the axes that two convex bodies need.
fn overlap(dimension: usize, a: &[Point], b: &[Point]) -> bool {
    let depth = OVERLAPPING * diameter(a).min(diameter(b));
    let separates = |axis: Point| apart(axis, a, b, depth);
    let of_facets = |corners: &[Point]| {
        (0..corners.len()).any(|left_out| {
            let mut facet = corners.to_vec();
            facet.remove(left_out);
            separates(normal(&facet))
        })
    };
    if of_facets(a) || of_facets(b) {
        return false;
    }
    let edges = |corners: &[Point]| {
        let mut edges = Vec::new();
        for (i, &p) in corners.iter().enumerate() {
            edges.extend(corners[..i].iter().map(|&q| minus(p, q)));
        }
        edges
    };
    let separated = dimension == 3
        && edges(a)
            .into_iter()
            .any(|e| edges(b).into_iter().any(|f| separates(cross(e, f))));
    !separated
}

/// Whether the shadows of two sets of points on an axis are apart, or share at most `depth`. An axis
/// without direction, as of parallel edges, tells nothing.
fn apart(axis: Point, a: &[Point], b: &[Point], depth: f64) -> bool {
    let length = dot(axis, axis).sqrt();
    let shadow = |points: &[Point]| {
        // From one origin: coordinates may be large beside the elements.
        let along = points.iter().map(|&p| dot(axis, minus(p, a[0])));
        along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
            (low.min(x), high.max(x))
        })
    };
    let ((low_a, high_a), (low_b, high_b)) = (shadow(a), shadow(b));
    length > 0.0 && high_a.min(high_b) - low_a.max(low_b) <= depth * length
}

#[cfg(test)]
mod tests;
