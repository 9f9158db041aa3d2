//! The loads on a body: tractions, body forces, pressures.

use myovib_fem::{Solid, Space, load};
use myovib_model::{Load, PressureLoad};

use super::builder::Builder;
use crate::InputError;
use crate::scene_file::SceneFile;

impl Builder<'_> {
    /// The dead loads: tractions and body forces. `densities`: one per element.
    pub(super) fn loads(
        &self,
        file: &SceneFile,
        space: &Space,
        densities: &[f64],
    ) -> Result<Vec<Load>, InputError> {
        let dimension = space.dimension();
        let mut loads = Vec::new();
        for (i, traction) in file.traction.iter().enumerate() {
            let path = format!("traction[{i}]");
            let given = [&traction.x, &traction.y, &traction.z];
            for (axis, path_of_component, function) in self.components(given, dimension, &path)? {
                let unit = match dimension {
                    2 => self.unit_traction::<2>(traction, space, axis, &path),
                    _ => self.unit_traction::<3>(traction, space, axis, &path),
                }?;
                loads.push(Load::new(&unit, self.signal(function, &path_of_component)?));
            }
        }
        for (i, force) in file.body_force.iter().enumerate() {
            let path = format!("body_force[{i}]");
            let members = self.elements(force.group.as_deref(), space.mesh(), &path)?;
            let mut own = vec![0.0; densities.len()];
            for element in members {
                own[element] = densities[element];
            }
            let given = [&force.x, &force.y, &force.z];
            for (axis, path, function) in self.components(given, dimension, &path)? {
                let unit = unit_weight(space, &own, axis);
                loads.push(Load::new(&unit, self.signal(function, &path)?));
            }
        }
        Ok(loads)
    }

    /// The pressures on the deformed boundary.
    pub(super) fn pressures(
        &self,
        file: &SceneFile,
        solid: &Solid,
    ) -> Result<Vec<PressureLoad>, InputError> {
        let given = file.pressure.iter().enumerate();
        given
            .map(|(i, pressure)| {
                let path = format!("pressure[{i}]");
                let signal = self.signal(&pressure.value, &format!("{path}.value"))?;
                let load = PressureLoad::new(solid, &pressure.group, signal);
                self.at(&format!("{path}.group"), load)
            })
            .collect()
    }
}

/// The load of an acceleration of 1 m/s² along an axis.
fn unit_weight(space: &Space, densities: &[f64], axis: usize) -> Vec<f64> {
    match space.dimension() {
        2 => load::weight(space, densities, unit::<2>(axis)),
        _ => load::weight(space, densities, unit::<3>(axis)),
    }
}

/// The unit vector along an axis.
pub(super) fn unit<const D: usize>(axis: usize) -> [f64; D] {
    std::array::from_fn(|i| f64::from(u8::from(i == axis)))
}
