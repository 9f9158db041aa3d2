//! Quantities derived from a body's state: values at points, averages over groups, energies.

pub(crate) mod displacement;
pub(crate) mod energy;
pub(crate) mod measure;
pub(crate) mod probe;
pub(crate) mod quantity;
pub(crate) mod snapshot;

use myovib_fem::{ElementPoint, Space};

use crate::error::ModelError;

/// Locates a point in the mesh.
///
/// # Errors
/// [`ModelError::Coordinates`], [`ModelError::OutsideMesh`].
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
    })
}
