//! Points and cells of field files, and values at the points.

use myovib_fem::{Barycentric, ElementPoint, Solid, Space};
use myovib_model::{Quantity, Snapshot};

use crate::Body;

/// Mesh for visualization. A node on the boundary between regions becomes one point per region, so that discontinuous
/// quantities have a value on each side.
#[derive(Debug, Clone)]
pub struct Grid {
    /// Node index of each point.
    pub(super) nodes: Vec<usize>,
    /// Point indices of all cells.
    pub(super) cells: Vec<usize>,
    pub(super) regions: Vec<usize>,
    /// Fiber direction at the center of each cell; empty for a body without fibers.
    pub(super) fibers: Vec<[f64; 3]>,
}

impl Grid {
    /// Creates the grid of the body of a scene. The regions are the materials of the scene.
    pub fn of_body(body: &Body) -> Self {
        let solid = &body.muscle.solid;
        let fibers = match body.has_fibers {
            true => fibers(solid),
            false => Vec::new(),
        };
        Self { fibers, ..Self::new(solid.space(), &body.regions) }
    }

    /// Creates the grid of a space. `regions` contains the region of each element.
    pub fn new(space: &Space, regions: &[usize]) -> Self {
        let corners = |e: usize| space.element_nodes(e).iter().map(move |&node| (node, e));
        let all = (0..space.n_elements()).flat_map(corners);
        let keys: Vec<(usize, usize)> = all.map(|(node, e)| (node, regions[e])).collect();
        let mut points = keys.clone();
        points.sort_unstable();
        points.dedup();
        let point = |key| points.partition_point(|other| other < key);
        Self {
            cells: keys.iter().map(point).collect(),
            nodes: points.iter().map(|(node, _)| *node).collect(),
            regions: regions.to_vec(),
            fibers: Vec::new(),
        }
    }

    pub fn nodes(&self) -> &[usize] {
        &self.nodes
    }

    /// Returns the point indices of all cells, in the order of the elements and their nodes.
    pub fn cells(&self) -> &[usize] {
        &self.cells
    }

    pub fn regions(&self) -> &[usize] {
        &self.regions
    }

    pub fn n_points(&self) -> usize {
        self.nodes.len()
    }

    /// Returns the number of points at which a discontinuous quantity is evaluated.
    pub fn n_evaluations(&self) -> usize {
        self.cells.len()
    }

    /// Returns the vectors of a nodal field at all points. Each vector has three components.
    pub(super) fn vectors(&self, field: &[f64], dimension: usize) -> Vec<Vec<f64>> {
        let vector = |node: &usize| {
            let mut vector = field[dimension * node..][..dimension].to_vec();
            vector.resize(3, 0.0);
            vector
        };
        self.nodes.iter().map(vector).collect()
    }

    /// Returns the values of a quantity at all points. Displacement, velocity and pressure are exact. Quantities that
    /// are discontinuous between elements are averaged over the adjacent elements of the same region.
    pub fn values(&self, snapshot: &Snapshot<'_>, quantity: Quantity) -> Vec<Vec<f64>> {
        let space = snapshot.solid.space();
        let dimension = space.dimension();
        let of_nodes = |field: &[f64]| self.vectors(field, dimension);
        match quantity {
            Quantity::Displacement => return of_nodes(snapshot.displacement),
            Quantity::Velocity => return of_nodes(snapshot.velocity),
            Quantity::Acceleration => return of_nodes(snapshot.acceleration),
            _ => {}
        }
        let width = quantity.columns(dimension).len();
        let mut sums = vec![vec![0.0; width]; self.n_points()];
        let mut counts = vec![0.0_f64; self.n_points()];
        let places = space.mesh().shape().nodes(space.degree());
        let elements = self.cells.chunks(places.len()).enumerate();
        for (element, points) in elements {
            for (&point, &barycentric) in points.iter().zip(&places) {
                if snapshot.is_continuous(quantity) && counts[point] > 0.0 {
                    continue;
                }
                let at = ElementPoint { element, barycentric };
                for (sum, value) in sums[point].iter_mut().zip(snapshot.at(&at, quantity)) {
                    *sum += value;
                }
                counts[point] += 1.0;
            }
        }
        for (sum, count) in sums.iter_mut().zip(counts) {
            sum.iter_mut().for_each(|value| *value /= count);
        }
        sums
    }
}

/// Returns the fiber directions at the centers of the elements.
fn fibers(solid: &Solid) -> Vec<[f64; 3]> {
    let n = solid.space().mesh().shape().n_vertices();
    let barycentric = Barycentric::new(&vec![1.0 / n as f64; n]);
    let axes = |element| solid.axes_at(&ElementPoint { element, barycentric });
    (0..solid.space().n_elements()).map(|element| axes(element).fiber).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_between_regions_are_points_of_both() {
        let mesh = myovib_fem::generate::rectangle([0.0; 2], [2.0, 1.0], [2, 1]).unwrap();
        let space = Space::taylor_hood(&mesh);
        let whole = Grid::new(&space, &[0; 4]);
        assert_eq!(whole.nodes, (0..space.n_nodes()).collect::<Vec<_>>());
        // The line between the two regions contains three nodes.
        let parted = Grid::new(&space, &[0, 0, 1, 1]);
        assert_eq!(parted.n_points(), space.n_nodes() + 3);
        for (cell, points) in parted.cells.chunks(6).enumerate() {
            let nodes: Vec<usize> = points.iter().map(|&point| parted.nodes[point]).collect();
            assert_eq!(nodes, space.element_nodes(cell));
        }
    }
}
