//! Pictures of a 3D body: its surface, and a section through its middle.

use std::collections::{BTreeMap, BTreeSet};

use myovib_fem::{Barycentric, ElementPoint, Group, Space, bounds};

use crate::plot::mesh_plot::QUARTERS;
use crate::plot::surface_plot::{Face, Paint, faces_the_eye};
use crate::plot::{Axis, Color, Field, MeshPlot, SurfacePlot};
use crate::vector::{Place, length};

/// A surface with at least this number of faces is drawn with one triangle per face, a smaller surface with four.
const FINE: usize = 3000;
/// Relative tolerance within which extents are considered equal in the choice of a section. Among equal extents, the
/// first axis is preferred.
const ALIKE: f64 = 0.05;

/// Returns the boundary faces. Each face has six nodes: the corners, counterclockwise as seen from outside, then the
/// edge midpoints.
pub fn boundary(space: &Space) -> Vec<[usize; 6]> {
    let faces = boundary_with_elements(space).into_iter();
    faces.map(|(_, nodes)| nodes).collect()
}

/// Returns the boundary faces as in [`boundary`], each with the index of its element.
pub(crate) fn boundary_with_elements(space: &Space) -> Vec<(usize, [usize; 6])> {
    let mesh = space.mesh();
    let sides = mesh.elements().enumerate().flat_map(|(number, element)| {
        let faces = mesh.shape().sides.iter().map(move |side| [0, 1, 2].map(|i| element[side[i]]));
        faces.map(move |face| (face, (number, face)))
    });
    let nodes = |(element, face): (usize, [usize; 3])| {
        let nodes = space.facet_nodes(&face).try_into().ok()?;
        Some((element, nodes))
    };
    alone(sides).filter_map(nodes).collect()
}

/// Returns the values of the faces that occur exactly once. The order of the three corners of a face is arbitrary.
pub(crate) fn alone<T>(faces: impl Iterator<Item = ([usize; 3], T)>) -> impl Iterator<Item = T> {
    let mut alone = BTreeMap::new();
    for (corners, value) in faces {
        alone.entry(sorted(corners)).and_modify(|other| *other = None).or_insert(Some(value));
    }
    alone.into_values().flatten()
}

/// Draws the undeformed body with colored groups on the boundary. The legend marks the groups that are on the hidden
/// side.
pub(crate) fn groups_plot(space: &Space, groups: &[(&str, Color)]) -> SurfacePlot {
    let points = space.node_points::<3>();
    let boundary = boundary(space).into_iter();
    let faces: Vec<[usize; 3]> = boundary.map(|[a, b, c, ..]| [a, b, c]).collect();
    let places = |nodes: [usize; 3]| nodes.map(|node| points[node]);
    let in_sight = faces.iter().filter(|nodes| faces_the_eye(&places(**nodes)));
    let in_sight: BTreeSet<[usize; 3]> = in_sight.copied().map(sorted).collect();
    let mut colors: BTreeMap<[usize; 3], Color> = BTreeMap::new();
    let mut named = Vec::new();
    for (name, color) in groups {
        if let Ok(Group::Faces(faces)) = space.mesh().group_of_dimension(name, 2) {
            let keys = || faces.iter().copied().map(sorted);
            colors.extend(keys().map(|key| (key, *color)));
            let name = match keys().any(|key| in_sight.contains(&key)) {
                true => (*name).to_owned(),
                false => format!("{name} (hidden)"),
            };
            named.push((name, *color));
        }
    }
    let face = |nodes: [usize; 3]| Face {
        corners: places(nodes),
        paint: Paint::Plain(*colors.get(&sorted(nodes)).unwrap_or(&Color::PALE)),
    };
    SurfacePlot {
        faces: faces.into_iter().map(face).collect(),
        groups: named,
        edges: true,
        ..SurfacePlot::default()
    }
}

/// Returns the corners of a face as a sorted key.
fn sorted(mut corners: [usize; 3]) -> [usize; 3] {
    corners.sort_unstable();
    corners
}

/// Draws the deformed body, colored by the magnitude of its displacement.
pub fn displacement_plot(space: &Space, displacement: &[Place]) -> SurfacePlot {
    let both = space.node_points::<3>().iter().zip(displacement);
    let moved: Vec<Place> = both.map(|(x, u)| [0, 1, 2].map(|i| x[i] + u[i])).collect();
    let sizes: Vec<f64> = displacement.iter().map(|u| length(*u)).collect();
    let field = Field { axis: Axis::new("|*u*|", "m"), values: sizes };
    field_plot(space, &moved, &field)
}

/// Draws the body with its nodes at the given points, colored by a field.
pub(crate) fn field_plot(space: &Space, points: &[Place], field: &Field) -> SurfacePlot {
    let faces = boundary(space);
    let parts: &[[usize; 3]] = match faces.len() {
        0..FINE => &QUARTERS,
        _ => &[[0, 1, 2]],
    };
    let triangles = faces.iter().flat_map(|nodes| {
        parts.iter().map(|part| {
            let nodes = part.map(|i| nodes[i]);
            let values = nodes.map(|node| field.values[node]);
            Face {
                corners: nodes.map(|node| points[node]),
                paint: Paint::Value(values.iter().sum::<f64>() / 3.0),
            }
        })
    });
    SurfacePlot {
        faces: triangles.collect(),
        field: Some(field.axis.clone()),
        ..SurfacePlot::default()
    }
}

/// Returns the corners of a box that contains the body in all of these states, and the maximum displacement. The frames
/// of a movie share these values.
pub fn surroundings<'a>(
    space: &Space,
    states: impl Iterator<Item = &'a [Place]>,
) -> (Vec<Place>, f64) {
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    let mut largest = 0.0_f64;
    for displacement in states {
        for (x, u) in space.node_points::<3>().iter().zip(displacement) {
            largest = largest.max(length(*u));
            for axis in 0..3 {
                let place = x[axis] + u[axis];
                (low[axis], high[axis]) = (low[axis].min(place), high[axis].max(place));
            }
        }
    }
    let side = |bits: usize, axis: usize| [low, high][bits >> axis & 1][axis];
    let corners = (0..8).map(|bits| [0, 1, 2].map(|axis| side(bits, axis)));
    (corners.collect(), largest)
}

/// Draws a section of the undeformed body, colored by the magnitude of the displacement. The section is in the middle
/// of the shortest extent.
pub(crate) fn section_plot(space: &Space, displacement: &[Place]) -> MeshPlot {
    let (normal, level) = plane(space);
    let across: Vec<usize> = (0..3).filter(|axis| *axis != normal).collect();
    let nodal = displacement.as_flattened();
    let mut plot = MeshPlot {
        x: Axis::new(NAMES[across[0]], "m"),
        y: Axis::new(NAMES[across[1]], "m"),
        ..MeshPlot::default()
    };
    let mut values = Vec::new();
    for element in 0..space.n_elements() {
        let corners: [Place; 4] = space.mesh().corners(element);
        for triangle in cut(&corners.map(|corner| corner[normal] - level)) {
            let [a, b, c] = triangle;
            let six = [a, b, c, mean(a, b), mean(b, c), mean(c, a)];
            let first = plot.nodes.len();
            for lambda in six {
                let at = ElementPoint { element, barycentric: Barycentric::new(&lambda) };
                let place: Place = space.position(&at);
                plot.nodes.push([place[across[0]], place[across[1]]]);
                values.push(length(space.displacement_at(nodal, &at)));
            }
            plot.triangles.push(std::array::from_fn(|i| first + i));
        }
    }
    plot.title = format!("section at {} = {level:.3e} m", NAMES[normal]);
    plot.field = Some(Field { axis: Axis::new("|*u*|", "m"), values });
    plot
}

const NAMES: [&str; 3] = ["*x*", "*y*", "*z*"];

/// Returns the plane halfway along the shortest extent and normal to it, as the index of its normal axis and its
/// coordinate.
fn plane(space: &Space) -> (usize, f64) {
    let [low, high] = bounds(space.coordinates(), 3);
    let extents = [0, 1, 2].map(|axis| high[axis] - low[axis]);
    let shortest = extents.iter().copied().fold(f64::INFINITY, f64::min);
    let axis = extents.iter().position(|extent| *extent <= (1.0 + ALIKE) * shortest).unwrap_or(0);
    (axis, 0.5 * (low[axis] + high[axis]))
}

/// Returns the section of a tetrahedron with the plane on which a linear function is zero. The section consists of
/// triangles in barycentric coordinates. `heights` are the values of the function at the vertices.
fn cut(heights: &[f64; 4]) -> Vec<[[f64; 4]; 3]> {
    let (above, below): (Vec<usize>, Vec<usize>) = (0..4).partition(|&i| heights[i] >= 0.0);
    let point = |i: usize, j: usize| {
        let weight = heights[i] / (heights[i] - heights[j]);
        let mut lambda = [0.0; 4];
        (lambda[i], lambda[j]) = (1.0 - weight, weight);
        lambda
    };
    match (&above[..], &below[..]) {
        (&[one], &[a, b, c]) | (&[a, b, c], &[one]) => {
            vec![[point(one, a), point(one, b), point(one, c)]]
        }
        (&[a, b], &[c, d]) => {
            let [ac, ad, bc, bd] = [point(a, c), point(a, d), point(b, c), point(b, d)];
            vec![[ac, ad, bd], [ac, bd, bc]]
        }
        _ => Vec::new(),
    }
}

fn mean(a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
    std::array::from_fn(|i| 0.5 * (a[i] + b[i]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vector::{dot, normal};
    use myovib_fem::generate;

    fn block() -> Space {
        let mesh = generate::block([0.0; 3], [3.0, 1.0, 2.0], [3, 2, 2]).unwrap();
        Space::taylor_hood(&mesh)
    }

    #[test]
    fn the_boundary_of_a_block_has_six_sides() {
        let space = block();
        let points = space.node_points::<3>();
        let (mut area, mut volume) = (0.0, 0.0);
        for nodes in boundary(&space) {
            let [a, b, c] = [0, 1, 2].map(|i| points[nodes[i]]);
            let normal = normal([a, b, c]);
            area += 0.5 * length(normal);
            // By the divergence theorem, outward normals give the volume.
            volume += dot(a, normal) / 6.0;
        }
        // Sums of about fifty terms of magnitude one have rounding errors.
        assert!((area - 22.0).abs() < 1e-13, "{area}");
        assert!((volume - 6.0).abs() < 1e-13, "{volume}");
    }

    /// Checks that x = 0 is hidden and x = 3 is visible, because the view is from the front, the right and above.
    #[test]
    fn the_legend_marks_hidden_groups() {
        let groups = [("left", Color::BLACK), ("right", Color::GRAY)];
        let plot = groups_plot(&block(), &groups);
        let names: Vec<&str> = plot.groups.iter().map(|(name, _)| &**name).collect();
        assert_eq!(names, ["left (hidden)", "right"]);
    }

    /// Checks the section through the middle of y. It is a rectangle of 3 by 2 with the interpolated displacement.
    #[test]
    fn the_section_matches_the_body() {
        let space = block();
        let points = space.node_points::<3>();
        let displacement: Vec<Place> = points.iter().map(|[x, _, _]| [x * x, 0.0, 0.0]).collect();
        let plot = section_plot(&space, &displacement);
        let values = &plot.field.as_ref().unwrap().values;
        let mut area = 0.0;
        for nodes in &plot.triangles {
            let [a, b, c] = [0, 1, 2].map(|i| plot.nodes[nodes[i]]);
            let twice = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]);
            area += 0.5 * twice.abs();
            for &node in nodes {
                let [x, _] = plot.nodes[node];
                // The function x² is quadratic, so there are only rounding errors.
                assert!((values[node] - x * x).abs() < 1e-13);
            }
        }
        assert!((area - 6.0).abs() < 1e-13, "{area}");
    }
}
