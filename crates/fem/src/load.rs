//! Load vectors: traction on a group of edges, force per volume.

use crate::element::p2_values;
use crate::error::FemError;
use crate::quadrature::{TriangleRule, edge_degree5};
use crate::space::{Degree, Space};

/// ∫_group τ · φ ds for a constant traction τ: a dead load per undeformed length. Paper: eq. (18).
///
/// # Shapes
/// `2 n_nodes`. The vector is linear in τ, so a load that varies in time takes the vectors of
/// (1, 0) and (0, 1) once.
///
/// # Units
/// τ in N/m² (per unit thickness), the result in N/m.
///
/// # Errors
/// [`FemError::UnknownGroup`], or [`FemError::WrongGroup`] if the group does not hold edges.
pub fn traction(space: &Space, group: &str, traction: [f64; 2]) -> Result<Vec<f64>, FemError> {
    traction_field(space, group, |_| traction)
}

/// ∫_group τ(x) · φ ds for a traction that varies along the group; exact for cubic τ.
///
/// # Errors
/// As for [`traction`].
pub fn traction_field(
    space: &Space,
    group: &str,
    traction: impl Fn([f64; 2]) -> [f64; 2],
) -> Result<Vec<f64>, FemError> {
    let mut load = vec![0.0; 2 * space.n_nodes()];
    for &edge in space.mesh().edges(group)? {
        let nodes = space.edge_nodes(edge);
        let [a, b] = edge.map(|v| space.node_points()[v]);
        let length = (b[0] - a[0]).hypot(b[1] - a[1]);
        for (s, weight) in edge_degree5() {
            let at = [(1.0 - s) * a[0] + s * b[0], (1.0 - s) * a[1] + s * b[1]];
            let tau = traction(at);
            for (&node, shape) in nodes.iter().zip(edge_values(space.degree(), s)) {
                for component in 0..2 {
                    load[2 * node + component] += length * weight * shape * tau[component];
                }
            }
        }
    }
    Ok(load)
}

/// Shape functions of an edge's ends and its midpoint at the fraction `s` of its length.
fn edge_values(degree: Degree, s: f64) -> [f64; 3] {
    match degree {
        Degree::One => [1.0 - s, s, 0.0],
        Degree::Two => {
            let [start, end, _, middle, ..] = p2_values([1.0 - s, s, 0.0]);
            [start, end, middle]
        }
    }
}

/// ∫ f(x) · φ for a force per volume; exact for polynomials f up to degree 4.
///
/// # Shapes
/// `2 n_nodes`.
pub fn body_force(space: &Space, force: impl Fn([f64; 2]) -> [f64; 2]) -> Vec<f64> {
    integrate(space, |_, at| force(at))
}

/// ∫ ρ a · φ for a constant acceleration a: weight, for one.
///
/// # Shapes
/// `densities`: one per triangle, 0 where nothing acts. The result: `2 n_nodes`.
///
/// # Panics
/// If there are fewer densities than triangles.
pub fn weight(space: &Space, densities: &[f64], acceleration: [f64; 2]) -> Vec<f64> {
    integrate(space, |element, _| {
        acceleration.map(|a| densities[element] * a)
    })
}

/// ∫ f · φ for a force per volume by triangle and place.
fn integrate(space: &Space, force: impl Fn(usize, [f64; 2]) -> [f64; 2]) -> Vec<f64> {
    let mut load = vec![0.0; 2 * space.n_nodes()];
    let rule = TriangleRule::Degree6.points();
    for element in 0..space.n_elements() {
        let corners = space.mesh().corners(element);
        let area = crate::mesh::signed_area(corners);
        for q in &rule {
            let at = [0, 1].map(|j| (0..3).map(|i| q.barycentric[i] * corners[i][j]).sum());
            let f = force(element, at);
            let place = crate::space::Located {
                element,
                barycentric: q.barycentric,
            };
            for (node, shape) in space.displacement_functional(&place) {
                for component in 0..2 {
                    load[2 * node + component] += area * q.weight * shape * f[component];
                }
            }
        }
    }
    load
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::generate;

    #[test]
    fn the_weight_of_two_regions_is_mass_times_acceleration() {
        let mesh = generate::rectangle([0.0, 0.0], [2.0, 1.0], [2, 1]).unwrap();
        let space = Space::taylor_hood(&mesh);
        // Two triangles of area 1/2 in each cell: the left cell weighs 3, the right one nothing.
        let weight = weight(&space, &[3.0, 3.0, 0.0, 0.0], [0.0, -2.0]);
        let total = |axis: usize| weight.iter().skip(axis).step_by(2).sum::<f64>();
        // Rounding of a dozen terms of size one.
        assert!(total(0).abs() < 1e-14 && (total(1) + 6.0).abs() < 1e-14);
    }
}
