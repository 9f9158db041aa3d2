//! Loads on a body: tractions, body forces, point forces and loads on the deformed boundary.

use std::sync::Arc;

use myovib_fem::{Solid, Space, load};
use myovib_model::{Load, Probe, Signal, SurfaceLoad};
use num_complex::Complex64;

use super::builder::Builder;
use crate::InputError;
use crate::scene_file::response::Amplitudes;
use crate::scene_file::solid::{BodyForce, Traction};

/// Loads, each with the key of its component in the scene.
type Keyed<L> = Vec<(String, L)>;
/// Function that returns the load of unit size along an axis.
type UnitLoad<'a> = dyn Fn(usize) -> Result<Vec<f64>, InputError> + 'a;

/// A load of unit size and the amplitude of its harmonic part.
type Harmonic = (SurfaceLoad, Complex64);

impl Builder<'_> {
    /// Returns the dead loads and the sum of their harmonic parts. There is one load per component: first for the
    /// tractions, then for the body forces and point forces. `densities` contains one value per element.
    pub(super) fn loads(
        &self,
        space: &Space,
        densities: &[f64],
    ) -> Result<(Keyed<Load>, Vec<Complex64>), InputError> {
        let dimension = space.dimension();
        let mut loads = Vec::new();
        let mut harmonic = vec![Complex64::ZERO; space.n_components()];
        let mut add = |given, response: &Option<Amplitudes>, path: &str, unit: &UnitLoad<'_>| {
            for component in self.components(given, response.as_ref(), dimension, path)? {
                let unit = unit(component.axis)?;
                if let Some(function) = component.function {
                    let load = Load::new(&unit, self.signal(function, &component.path)?);
                    loads.push((component.path, load));
                }
                if component.amplitude != Complex64::ZERO {
                    for (total, unit) in harmonic.iter_mut().zip(unit) {
                        *total += component.amplitude * unit;
                    }
                }
            }
            Ok(())
        };
        for (i, traction) in self.file.traction.iter().enumerate() {
            let path = format!("traction[{i}]");
            let given = [&traction.x, &traction.y, &traction.z];
            add(given, &traction.response, &path, &|axis| match dimension {
                2 => self.unit_traction::<2>(traction, space, axis, &path),
                _ => self.unit_traction::<3>(traction, space, axis, &path),
            })?;
        }
        for (i, force) in self.file.body_force.iter().enumerate() {
            let path = format!("body_force[{i}]");
            let members = self.elements(force.group.as_deref(), space.mesh(), &path)?;
            let mut own = vec![0.0; densities.len()];
            for element in members {
                own[element] = densities[element];
            }
            let given = [&force.x, &force.y, &force.z];
            add(given, &force.response, &path, &|axis| match dimension {
                2 => self.unit_weight::<2>(force, space, &own, axis, &path),
                _ => self.unit_weight::<3>(force, space, &own, axis, &path),
            })?;
        }
        for (i, force) in self.file.point_force.iter().enumerate() {
            let path = format!("point_force[{i}]");
            let point = self.point(space, &force.at, &path)?;
            let given = [&force.x, &force.y, &force.z];
            add(given, &force.response, &path, &|axis| {
                let mut unit = vec![0.0; space.n_components()];
                for (node, weight) in point.node_weights() {
                    unit[dimension * node + axis] = *weight;
                }
                Ok(unit)
            })?;
        }
        Ok((loads, harmonic))
    }

    /// Returns the point `at` of the table at `path`. Adds a note if the point is outside the mesh.
    pub(super) fn point(&self, space: &Space, at: &[f64], path: &str) -> Result<Probe, InputError> {
        let (point, distance) = self.at(&format!("{path}.at"), Probe::near(space, at))?;
        if distance > 0.0 {
            self.notes.borrow_mut().push(format!(
                "{path}.at is {distance:.3e} m outside the mesh: the nearest point of the mesh is used"
            ));
        }
        Ok(point)
    }

    /// Returns the load of a traction of 1 Pa along an axis, multiplied by the distribution of the traction.
    fn unit_traction<const D: usize>(
        &self,
        traction: &Traction,
        space: &Space,
        axis: usize,
        path: &str,
    ) -> Result<Vec<f64>, InputError> {
        let distribution = traction.spatial_factor.as_ref();
        let factor = self.factor(distribution, space.mesh(), axis, path)?;
        let load =
            load::facet_traction(space, &traction.group, |facet, weights, place: [f64; D]| {
                along(axis, factor.at(facet, weights, &place))
            });
        self.finite(factor)?;
        self.at(&format!("{path}.group"), load)
    }

    /// Returns the load of an acceleration of 1 m/s² along an axis, multiplied by the distribution of the body force.
    fn unit_weight<const D: usize>(
        &self,
        force: &BodyForce,
        space: &Space,
        densities: &[f64],
        axis: usize,
        path: &str,
    ) -> Result<Vec<f64>, InputError> {
        let mesh = space.mesh();
        let factor = self.factor(force.spatial_factor.as_ref(), mesh, axis, path)?;
        let load = load::element_body_force(space, |at, place: [f64; D]| {
            let density = densities[at.element];
            if density == 0.0 {
                return [0.0; D]; // outside the group
            }
            let vertices = mesh.element(at.element);
            along(axis, density * factor.at(vertices, &at.barycentric, &place))
        });
        self.finite(factor)?;
        Ok(load)
    }

    /// Returns the loads on the deformed boundary with their keys. For a response, also returns unit loads with the
    /// amplitudes of their harmonic parts.
    pub(super) fn surface_loads(
        &self,
        solid: &Solid,
    ) -> Result<(Keyed<SurfaceLoad>, Vec<Harmonic>), InputError> {
        let (mut loads, mut harmonic) = (Vec::new(), Vec::new());
        for (path, load) in self.file.surface_loads.all() {
            let key = format!("{path}.value");
            let signal = self.signal(load.value, &key)?;
            let operator = self.at(&format!("{path}.group"), load.kind.operator(solid))?;
            if let Some(amplitude) = load.response {
                let unit = SurfaceLoad::new(Arc::clone(&operator), Signal::constant(1.0));
                harmonic.push((unit, amplitude.complex()));
            }
            loads.push((key, SurfaceLoad::new(operator, signal)));
        }
        Ok((loads, harmonic))
    }
}

/// Returns the vector of length `size` along an axis.
fn along<const D: usize>(axis: usize, size: f64) -> [f64; D] {
    std::array::from_fn(|i| if i == axis { size } else { 0.0 })
}
