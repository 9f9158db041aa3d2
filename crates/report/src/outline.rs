//! Drawings of a body in 2D.

use myovib_fem::Space;

use crate::plot::{Axis, Field, MeshPlot};
use crate::vector::length;

/// Returns the mesh at rest.
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

/// Returns the deformed body over its outline at rest, colored by the magnitude of its displacement.
pub fn displacement_plot(space: &Space, displacement: &[[f64; 3]]) -> MeshPlot {
    MeshPlot {
        displacement: displacement.iter().map(|&[x, y, _]| [x, y]).collect(),
        scale: 1.0,
        field: Some(Field {
            axis: Axis::new("|*u*|", "m"),
            values: displacement.iter().map(|&u| length(u)).collect(),
        }),
        ..outline(space)
    }
}
