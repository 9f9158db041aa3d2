//! Visible triangles of a body: all triangles in 2D, the surface in 3D.

use std::collections::{BTreeMap, BTreeSet};

use myovib_fem::Space;
use myovib_scene::vtu::Grid;

use crate::outline::outline;
use crate::plot::mesh_plot::QUARTERS;
use crate::spatial::boundary_with_elements;
use crate::vector::{length, normal};

/// Maximum number of triangles in a view. A browser without a graphics processor draws this number in 70 ms of CPU
/// time.
const MOST_TRIANGLES: usize = 20_000;

/// The two halves of each edge of a face.
const HALVES: [[usize; 2]; 6] = [[0, 3], [3, 1], [1, 4], [4, 2], [2, 5], [5, 0]];

/// Triangles whose vertices are points of a [`Grid`].
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Surface {
    /// Grid point of each vertex.
    pub(super) points: Vec<usize>,
    pub(super) triangles: Vec<[usize; 3]>,
    /// End vertices of the edges of the elements, or, on a thinned surface, of the edges of its triangles.
    pub(super) edges: Vec<[usize; 2]>,
    /// Number of triangles before thinning; `None` if the surface was not thinned.
    pub(super) thinned_from: Option<usize>,
}

impl Surface {
    /// Returns the visible triangles. If there are too many, neighboring points are merged.
    pub(super) fn of(space: &Space, grid: &Grid) -> Self {
        let faces = faces(space, grid);
        let position = |point: usize| -> [f64; 3] {
            let place = space.node_point(grid.nodes()[point]);
            [0, 1, 2].map(|axis| place.get(axis).copied().unwrap_or_default())
        };
        Self::of_faces(&faces, position, MOST_TRIANGLES)
    }

    fn of_faces(
        faces: &[[usize; 6]],
        position: impl Fn(usize) -> [f64; 3],
        most_triangles: usize,
    ) -> Self {
        if 4 * faces.len() <= most_triangles {
            let triangles = faces.iter();
            let triangles = triangles.flat_map(|face| QUARTERS.map(|part| part.map(|i| face[i])));
            let edges = faces.iter().flat_map(|face| HALVES.map(|half| half.map(|i| face[i])));
            return Self::numbered(triangles.collect(), edges.collect(), None);
        }
        let whole: Vec<[usize; 3]> = faces.iter().map(|&[a, b, c, ..]| [a, b, c]).collect();
        let thinned_from = (whole.len() > most_triangles).then_some(whole.len());
        let triangles = match thinned_from {
            Some(_) => merged(&whole, position, most_triangles),
            None => whole,
        };
        let edges = triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
        let edges = edges.collect();
        Self::numbered(triangles, edges, thinned_from)
    }

    /// Renumbers the points that occur in the triangles.
    fn numbered(
        triangles: Vec<[usize; 3]>,
        edges: Vec<[usize; 2]>,
        thinned_from: Option<usize>,
    ) -> Self {
        let points: BTreeSet<usize> = triangles.iter().flatten().copied().collect();
        let points: Vec<usize> = points.into_iter().collect();
        let vertex = |point: usize| points.partition_point(|&other| other < point);
        let edges = edges.into_iter().map(|[a, b]| [a.min(b), a.max(b)]);
        let edges: BTreeSet<[usize; 2]> = edges.collect();
        Self {
            triangles: triangles.into_iter().map(|triangle| triangle.map(vertex)).collect(),
            edges: edges.into_iter().map(|edge| edge.map(vertex)).collect(),
            points,
            thinned_from,
        }
    }
}

/// Returns the six points of each face.
fn faces(space: &Space, grid: &Grid) -> Vec<[usize; 6]> {
    let n_nodes = grid.cells().len() / space.n_elements().max(1);
    // A node on the boundary between regions has one point per region.
    let point = |element: usize, node: usize| {
        let own = space.element_nodes(element).iter().position(|&other| other == node);
        own.map(|i| grid.cells()[n_nodes * element + i])
    };
    let with_points = |(element, nodes): (usize, [usize; 6])| {
        let points: Option<Vec<usize>> = nodes.iter().map(|&node| point(element, node)).collect();
        points?.try_into().ok()
    };
    match space.dimension() {
        2 => outline(space).triangles.into_iter().enumerate().filter_map(with_points).collect(),
        _ => boundary_with_elements(space).into_iter().filter_map(with_points).collect(),
    }
}

/// Merges the points in each cube of a grid, so that at most `most_triangles` triangles remain.
fn merged(
    triangles: &[[usize; 3]],
    position: impl Fn(usize) -> [f64; 3],
    most_triangles: usize,
) -> Vec<[usize; 3]> {
    let corners = |triangle: &[usize; 3]| triangle.map(&position);
    let area: f64 = triangles.iter().map(|triangle| area(&corners(triangle))).sum();
    // The initial size assumes two triangles per square of the surface. The cubes are enlarged until the limit is
    // satisfied.
    let mut size = (2.0 * area / most_triangles as f64).sqrt();
    loop {
        let mut first: BTreeMap<[i64; 3], usize> = BTreeMap::new();
        let mut merge = |point: usize| {
            let cube = position(point).map(|x| (x / size).floor() as i64);
            *first.entry(cube).or_insert(point)
        };
        let mut seen = BTreeSet::new();
        let mut kept = Vec::new();
        for triangle in triangles {
            let triangle = triangle.map(&mut merge);
            let mut key = triangle;
            key.sort_unstable();
            let [a, b, c] = key;
            if a < b && b < c && seen.insert(key) {
                kept.push(triangle);
            }
        }
        if kept.len() <= most_triangles {
            return kept;
        }
        size *= 1.2;
    }
}

fn area(corners: &[[f64; 3]; 3]) -> f64 {
    0.5 * length(normal(*corners))
}

#[cfg(test)]
mod tests {
    use super::*;
    use myovib_fem::generate;

    fn block(cells: [usize; 3]) -> (Space, Grid) {
        let mesh = generate::block([0.0; 3], [3.0, 1.0, 2.0], cells).unwrap();
        let space = Space::taylor_hood(&mesh);
        let grid = Grid::new(&space, &vec![0; space.n_elements()]);
        (space, grid)
    }

    fn total_area(surface: &Surface, space: &Space, grid: &Grid) -> f64 {
        let position = |vertex: usize| {
            let point: &[f64] = space.node_point(grid.nodes()[surface.points[vertex]]);
            [point[0], point[1], point[2]]
        };
        let triangles = surface.triangles.iter();
        triangles.map(|triangle| area(&triangle.map(position))).sum()
    }

    #[test]
    fn the_surface_of_a_block_is_closed() {
        let (space, grid) = block([3, 2, 2]);
        let surface = Surface::of(&space, &grid);
        // The surface has 2 (6 + 4 + 6) squares, each with two faces of four triangles.
        assert_eq!(surface.triangles.len(), 256);
        // Every edge of an element on the surface has two halves: 3/2 edges per face.
        assert_eq!(surface.edges.len(), 2 * 64 * 3 / 2);
        // The sum of 256 terms has a rounding error.
        assert!((total_area(&surface, &space, &grid) - 22.0).abs() < 1e-12);
        assert_eq!(surface.thinned_from, None);
    }

    #[test]
    fn large_surfaces_are_thinned() {
        let (space, grid) = block([6, 4, 4]);
        let faces = faces(&space, &grid);
        let position = |point: usize| {
            let point: &[f64] = space.node_point(grid.nodes()[point]);
            [point[0], point[1], point[2]]
        };
        let thinned = Surface::of_faces(&faces, position, 100);
        assert_eq!(thinned.thinned_from, Some(256));
        assert!(thinned.triangles.len() <= 100);
        // A point moves at most by the size of a cube, which is a third of the thickness.
        let area = total_area(&thinned, &space, &grid);
        assert!((11.0..=22.0).contains(&area), "{area}");
    }

    #[test]
    fn points_between_regions_keep_their_region() {
        let mesh = generate::rectangle([0.0; 2], [2.0, 1.0], [2, 1]).unwrap();
        let space = Space::taylor_hood(&mesh);
        let grid = Grid::new(&space, &[0, 0, 1, 1]);
        let surface = Surface::of(&space, &grid);
        assert_eq!(surface.points.len(), space.n_nodes() + 3);
        assert_eq!(surface.triangles.len(), 16);
    }
}
