//! Load vectors of boundary tractions and body forces.
//!
//! As in [space](crate::space), functions panic if the dimension of the space is not the parameter `D`.

use crate::boundary::facet::for_each_point;
use crate::element::quadrature::Rule;
use crate::error::FemError;
use crate::space::{ElementPoint, Space};

/// Returns the load ∫_group τ · φ ds of a constant traction τ. The traction is a dead load per undeformed length
/// or area. Paper, eq. (18).
///
/// # Shapes
/// The result has length `n_components`. It is linear in τ, so a time-dependent load can combine precomputed
/// vectors of unit tractions.
///
/// # Units
/// τ is in N/m²; the result is in N (N/m in 2D).
///
/// # Errors
/// Returns [`FemError::UnknownGroup`] if the group does not exist, or [`FemError::WrongGroup`] unless it has edges
/// (2D) or faces (3D).
pub fn traction<const D: usize>(
    space: &Space,
    group: &str,
    traction: [f64; D],
) -> Result<Vec<f64>, FemError> {
    facet_traction(space, group, |_, _, _| traction)
}

/// Returns the load ∫_group τ · φ ds of a traction given as a function of the facet vertices, the barycentric
/// coordinates on the facet, and the position. The quadrature is exact for cubic τ and therefore for nodal data.
///
/// # Errors
/// Returns the errors of [`traction`].
pub fn facet_traction<const D: usize>(
    space: &Space,
    group: &str,
    traction: impl Fn(&[usize], &[f64], [f64; D]) -> [f64; D],
) -> Result<Vec<f64>, FemError> {
    let mut load = vec![0.0; space.n_components()];
    for_each_point::<D>(space, group, |at| {
        let tau = traction(at.facet, &at.point.barycentric, at.position());
        for (&node, shape) in at.nodes.iter().zip(&at.point.values) {
            for component in 0..D {
                load[D * node + component] += at.weight * shape * tau[component];
            }
        }
    })?;
    Ok(load)
}

/// Returns the load ∫ ρ a · φ of a constant acceleration a, for example gravity.
///
/// # Shapes
/// `densities` has one entry per element, which is 0 for elements without load. The result has length
/// `n_components`.
///
/// # Panics
/// Panics if there are fewer densities than elements, or if `D` is not the dimension.
pub fn weight<const D: usize>(
    space: &Space,
    densities: &[f64],
    acceleration: [f64; D],
) -> Vec<f64> {
    element_body_force(space, |at, _| acceleration.map(|a| densities[at.element] * a))
}

/// Returns the load ∫ f · φ of a force per volume, given as a function of the point in an element and the
/// position. The quadrature is exact for polynomials f up to degree 4.
///
/// # Shapes
/// The result has length `n_components`.
pub fn element_body_force<const D: usize>(
    space: &Space,
    force: impl Fn(&ElementPoint, [f64; D]) -> [f64; D],
) -> Vec<f64> {
    let (mesh, shape) = (space.mesh(), space.mesh().shape());
    let points = mesh.points::<D>();
    let mut load = vec![0.0; space.n_components()];
    let rule = Rule::Degree6.points(shape);
    let values: Vec<Vec<f64>> =
        rule.iter().map(|q| shape.values(space.degree(), &q.barycentric)).collect();
    for element in 0..space.n_elements() {
        let corners: Vec<[f64; D]> = mesh.element(element).iter().map(|&v| points[v]).collect();
        for (q, values) in rule.iter().zip(&values) {
            let (_, measure) = space.map_at::<D>(element, &q.barycentric);
            let at = ElementPoint { element, barycentric: q.barycentric };
            let position = match space.is_curved(element) {
                true => space.position(&at),
                false => q.barycentric.point_in(&corners),
            };
            let f = force(&at, position);
            for (&node, shape) in space.element_nodes(element).iter().zip(values) {
                for component in 0..D {
                    load[D * node + component] += measure * q.weight * shape * f[component];
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
    fn weight_of_two_regions_is_mass_times_acceleration() {
        let mesh = generate::rectangle([0.0, 0.0], [2.0, 1.0], [2, 1]).unwrap();
        let space = Space::taylor_hood(&mesh);
        // Each cell has two triangles of area 1/2. The left cell has mass 3, and the right cell has mass 0.
        let weight = weight(&space, &[3.0, 3.0, 0.0, 0.0], [0.0, -2.0]);
        let total = |axis: usize| weight.iter().skip(axis).step_by(2).sum::<f64>();
        // The error is the rounding of a dozen terms of order one.
        assert!(total(0).abs() < 1e-14 && (total(1) + 6.0).abs() < 1e-14);
    }
}
