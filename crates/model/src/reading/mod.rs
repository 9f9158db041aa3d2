//! Quantities derived from the state of a body: values at points, averages over groups, energies.

pub(crate) mod displacement;
pub(crate) mod energy;
pub(crate) mod measure;
pub(crate) mod probe;
pub(crate) mod quantity;
pub(crate) mod snapshot;

use myovib_fem::{ElementPoint, Near, Space};

use crate::error::ModelError;

/// Distance of a point from the mesh, relative to the size of the nearest element, up to which the nearest point of the
/// mesh is used instead. The distance between a curved surface and its chord may be this large.
const NEAR: f64 = 0.05;

/// Locates a point in a mesh of any dimension.
///
/// # Errors
/// [`ModelError::Coordinates`] if the number of coordinates is wrong, [`ModelError::OutsideMesh`] if no element
/// contains the point.
fn locate(space: &Space, point: &[f64]) -> Result<ElementPoint, ModelError> {
    let place = match (space.dimension(), point) {
        (2, &[x, y]) => space.locate([x, y]),
        (3, &[x, y, z]) => space.locate([x, y, z]),
        (needed, _) => {
            let found = point.len();
            return Err(ModelError::Coordinates { found, needed });
        }
    };
    place.ok_or_else(|| ModelError::OutsideMesh {
        point: point.to_vec(),
        nearest: near(space, point).map(|near| (place_of(space, &near.at), near.distance)),
    })
}

/// Returns the location of a point in the mesh or, if the point is outside, of the nearest point of the mesh. Also
/// returns the distance between the two points (m).
///
/// # Errors
/// [`ModelError::Coordinates`] if the number of coordinates is wrong, [`ModelError::OutsideMesh`] if the distance
/// exceeds a twentieth of the element size.
fn locate_near(space: &Space, point: &[f64]) -> Result<(ElementPoint, f64), ModelError> {
    let error = match locate(space, point) {
        Ok(located) => return Ok((located, 0.0)),
        Err(error) => error,
    };
    match near(space, point) {
        Some(near) if near.relative <= NEAR => Ok((near.at, near.distance)),
        _ => Err(error),
    }
}

fn near(space: &Space, point: &[f64]) -> Option<Near> {
    match *point {
        [x, y] if space.dimension() == 2 => space.near([x, y]),
        [x, y, z] if space.dimension() == 3 => space.near([x, y, z]),
        _ => None,
    }
}

fn place_of(space: &Space, at: &ElementPoint) -> Vec<f64> {
    match space.dimension() {
        2 => space.position::<2>(at).to_vec(),
        _ => space.position::<3>(at).to_vec(),
    }
}
