//! Load vectors: traction on a group of the boundary, force per volume.
//!
//! `D` is the dimension of the space.

use crate::boundary::facet::{facet_measure, facet_points, is_curved};
use crate::element::quadrature::Rule;
use crate::error::FemError;
use crate::space::{Located, Space};

/// ∫_group τ · φ ds for a constant traction τ: a dead load per undeformed length or area. Paper:
/// eq. (18).
///
/// # Shapes
/// `n_components`. The vector is linear in τ, so a load that varies in time takes the vectors of
/// the unit tractions once.
///
/// # Units
/// τ in N/m²; the result in N, in the plane in N/m.
///
/// # Errors
/// [`FemError::UnknownGroup`], or [`FemError::WrongGroup`] if the group does not hold edges (of
/// triangles) or faces (of tetrahedra).
///
/// # Panics
/// Unless `D` is the dimension.
pub fn traction<const D: usize>(
    space: &Space,
    group: &str,
    traction: [f64; D],
) -> Result<Vec<f64>, FemError> {
    traction_field(space, group, |_| traction)
}

/// ∫_group τ(x) · φ ds for a traction that varies along the group; exact for cubic τ.
///
/// # Errors
/// As for [`traction`].
///
/// # Panics
/// As [`traction`].
pub fn traction_field<const D: usize>(
    space: &Space,
    group: &str,
    traction: impl Fn([f64; D]) -> [f64; D],
) -> Result<Vec<f64>, FemError> {
    located_traction(space, group, |_, _, place| traction(place))
}

/// ∫_group τ · φ ds for a traction by the vertices of the edge or face, barycentric coordinates
/// between them, and place; exact for cubic τ, as nodal data of a mesh are.
///
/// # Errors
/// As for [`traction`].
///
/// # Panics
/// As [`traction`].
pub fn located_traction<const D: usize>(
    space: &Space,
    group: &str,
    traction: impl Fn(&[usize], &[f64], [f64; D]) -> [f64; D],
) -> Result<Vec<f64>, FemError> {
    let mut load = vec![0.0; space.n_components()];
    let points = space.node_points::<D>();
    let rule = facet_points(space.mesh().shape(), space.degree());
    for facet in space.mesh().facets(group)? {
        let nodes = space.facet_nodes(facet);
        let places: Vec<[f64; D]> = nodes.iter().map(|&node| points[node]).collect();
        let curved = is_curved(&places);
        let straight = facet_measure(&places[..D]);
        for q in &rule {
            let measure = if curved { q.measure(&places) } else { straight };
            let at = std::array::from_fn(|j| match curved {
                true => q.values.iter().zip(&places).map(|(n, x)| n * x[j]).sum(),
                false => q
                    .barycentric
                    .iter()
                    .zip(&places)
                    .map(|(l, x)| l * x[j])
                    .sum(),
            });
            let tau = traction(facet, &q.barycentric, at);
            for (&node, shape) in nodes.iter().zip(&q.values) {
                for component in 0..D {
                    load[D * node + component] += measure * q.weight * shape * tau[component];
                }
            }
        }
    }
    Ok(load)
}

/// ∫ f(x) · φ for a force per volume; exact for polynomials f up to degree 4.
///
/// # Shapes
/// `n_components`.
///
/// # Panics
/// Unless `D` is the dimension.
pub fn body_force<const D: usize>(space: &Space, force: impl Fn([f64; D]) -> [f64; D]) -> Vec<f64> {
    located_body_force(space, |_, place| force(place))
}

/// ∫ ρ a · φ for a constant acceleration a: weight, for one.
///
/// # Shapes
/// `densities`: one per element, 0 where nothing acts. The result: `n_components`.
///
/// # Panics
/// If there are fewer densities than elements, or `D` is not the dimension.
pub fn weight<const D: usize>(
    space: &Space,
    densities: &[f64],
    acceleration: [f64; D],
) -> Vec<f64> {
    located_body_force(space, |at, _| {
        acceleration.map(|a| densities[at.element] * a)
    })
}

/// ∫ f · φ for a force per volume by element, barycentric coordinates and place; exact as
/// [`body_force`] is.
///
/// # Panics
/// Unless `D` is the dimension.
pub fn located_body_force<const D: usize>(
    space: &Space,
    force: impl Fn(&Located, [f64; D]) -> [f64; D],
) -> Vec<f64> {
    let (mesh, shape) = (space.mesh(), space.mesh().shape());
    let points = mesh.points::<D>();
    let mut load = vec![0.0; space.n_components()];
    let rule = Rule::Degree6.points(shape);
    let values: Vec<Vec<f64>> = rule
        .iter()
        .map(|q| shape.values(space.degree(), &q.barycentric))
        .collect();
    for element in 0..space.n_elements() {
        let corners: Vec<[f64; D]> = mesh.element(element).iter().map(|&v| points[v]).collect();
        for (q, values) in rule.iter().zip(&values) {
            let (_, measure) = space.map_at::<D>(element, &q.barycentric);
            let at = Located {
                element,
                barycentric: q.barycentric,
            };
            let place = match space.is_curved(element) {
                true => space.place(&at),
                false => q.barycentric.place(&corners),
            };
            let f = force(&at, place);
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
