//! The drawing of a mesh.

use myovib_fem::Space;

use crate::plot::{Axis, MeshPlot};

/// The mesh alone, at rest.
pub fn outline(space: &Space) -> MeshPlot {
    let nodes = |element| -> [usize; 6] {
        let nodes = space.element_nodes(element);
        std::array::from_fn(|i| nodes[i])
    };
    MeshPlot {
        x: Axis::new("*x*", "m"),
        y: Axis::new("*y*", "m"),
        nodes: space.node_points().to_vec(),
        triangles: (0..space.n_elements()).map(nodes).collect(),
        ..MeshPlot::default()
    }
}
