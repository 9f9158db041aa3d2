//! Measurements of a body at one point in time: values at points and averages.
//!
//! Values are computed only on request.

use myovib_fem::{ElementPoint, Space};

use super::locate_near;
use super::quantity::Quantity;
use super::snapshot::Snapshot;
use crate::error::ModelError;

/// Quantities at a point or averaged over several points.
#[derive(Debug, Clone)]
pub struct Measurement {
    /// Points with weights that sum to 1, or to 0 for values relative to a group.
    places: Vec<(ElementPoint, f64)>,
    quantities: Vec<Quantity>,
    dimension: usize,
}

impl Measurement {
    /// Creates a measurement of quantities at a point. If the point is slightly outside the mesh, a nearby point of the
    /// mesh is used instead, as in [`Probe::near`](crate::Probe::near).
    ///
    /// # Errors
    /// [`ModelError::Coordinates`] if the number of coordinates is wrong, [`ModelError::OutsideMesh`] if the point is
    /// too far outside the mesh.
    pub fn at(
        space: &Space,
        point: impl AsRef<[f64]>,
        quantities: &[Quantity],
    ) -> Result<Self, ModelError> {
        Ok(Self {
            places: vec![(locate_near(space, point.as_ref())?.0, 1.0)],
            quantities: quantities.to_vec(),
            dimension: space.dimension(),
        })
    }

    /// Creates a measurement of averages over a group of elements or boundary facets. The averages are weighted by
    /// undeformed length, area or volume.
    ///
    /// # Errors
    /// [`FemError::UnknownGroup`](myovib_fem::FemError::UnknownGroup) if the group does not exist,
    /// [`FemError::WrongGroup`](myovib_fem::FemError::WrongGroup) if it is a group of another kind.
    pub fn average(
        space: &Space,
        group: &str,
        quantities: &[Quantity],
    ) -> Result<Self, ModelError> {
        let mut places = space.quadrature(group)?;
        let total: f64 = places.iter().map(|(_, weight)| weight).sum();
        for (_, weight) in &mut places {
            *weight /= total;
        }
        Ok(Self { places, quantities: quantities.to_vec(), dimension: space.dimension() })
    }

    /// Subtracts the averages over a group from all values.
    ///
    /// # Errors
    /// As for [`average`](Self::average).
    pub fn relative_to(mut self, space: &Space, group: &str) -> Result<Self, ModelError> {
        let other = Self::average(space, group, &self.quantities)?.places;
        let negative = other.into_iter().map(|(place, weight)| (place, -weight));
        self.places.extend(negative);
        Ok(self)
    }

    /// Returns the names of the values, in the same order as the values.
    pub fn names(&self) -> Vec<String> {
        let quantities = self.quantities.iter();
        quantities.flat_map(|quantity| quantity.columns(self.dimension)).collect()
    }

    /// Returns whether any value is a stress.
    pub fn has_stress(&self) -> bool {
        self.quantities.iter().any(|own| own.is_of_stress())
    }

    /// Removes the quantities that do not satisfy `is_kept`.
    pub fn retain(&mut self, is_kept: impl Fn(Quantity) -> bool) {
        self.quantities.retain(|own| is_kept(*own));
    }

    /// Returns the quantities.
    pub fn quantities(&self) -> &[Quantity] {
        &self.quantities
    }

    /// Returns the number of evaluations of det F, strain or stress per reading.
    pub fn stress_evaluations(&self) -> usize {
        let states = self.quantities.iter().filter(|quantity| quantity.needs_state());
        states.count() * self.places.len()
    }

    /// Returns the value with the zero-based index `value` as a linear functional of a nodal quantity. The result
    /// contains the quantity and a list of (component, weight) pairs. Returns `None` if the value is not linear in
    /// displacements or velocities.
    pub fn functional(&self, space: &Space, value: usize) -> Option<(Quantity, Vec<(usize, f64)>)> {
        let mut columns = self.quantities.iter().flat_map(|&quantity| {
            let width = quantity.columns(self.dimension).len();
            (0..width).map(move |axis| (quantity, axis))
        });
        let (quantity, axis) = columns.nth(value)?;
        if !matches!(quantity, Quantity::Displacement | Quantity::Velocity) {
            return None;
        }
        let terms = self.places.iter().flat_map(|(place, share)| {
            let nodes = space.displacement_functional(place).into_iter();
            nodes.map(move |(node, weight)| (self.dimension * node + axis, share * weight))
        });
        Some((quantity, terms.collect()))
    }

    /// Appends the values to `out`.
    pub fn read(&self, snapshot: &Snapshot<'_>, out: &mut Vec<f64>) {
        for quantity in &self.quantities {
            let mut mean = Vec::new();
            for (place, weight) in &self.places {
                let values = snapshot.at(place, *quantity);
                mean.resize(values.len(), 0.0);
                for (mean, value) in mean.iter_mut().zip(values) {
                    *mean += weight * value;
                }
            }
            out.append(&mut mean);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use myovib_fem::output::StressContext;
    use myovib_fem::{DofMap, Law, Pressure, Solid, generate};

    use super::*;

    fn solid() -> Solid {
        let mesh = generate::rectangle([0.0, 0.0], [2.0, 1.0], [3, 2]).unwrap();
        let space = Arc::new(Space::taylor_hood(&mesh));
        let dofs = DofMap::clamped(&space, &space.nodes_of("left").unwrap()).unwrap();
        Solid::uniform(space, dofs, Law::MooneyRivlin { c10: 1e4, c01: 2e2 }, 1e3).unwrap()
    }

    fn snapshot<'a>(solid: &'a Solid, u: &'a [f64], p: &'a [f64]) -> Snapshot<'a> {
        Snapshot {
            solid,
            displacement: u,
            velocity: u,
            acceleration: u,
            pressure: Pressure::Nodal(p),
            factors: None,
            p_rate: None,
            stress_context: StressContext { tensions: &[], beta: 0.0, internal: &[] },
        }
    }

    #[test]
    fn averages_of_quadratic_fields_are_exact() {
        let solid = solid();
        let space = solid.space();
        // u_x = x²: its mean is 4 on the right edge and 4/3 over the body.
        let u: Vec<f64> =
            space.node_points::<2>().iter().flat_map(|p| [p[0] * p[0], 0.0]).collect();
        let p = vec![0.0; space.n_pressures()];
        let snapshot = snapshot(&solid, &u, &p);
        for (group, mean) in [("right", 4.0), ("body", 4.0 / 3.0)] {
            let quantities = [Quantity::Displacement, Quantity::Pressure];
            let measurement = Measurement::average(space, group, &quantities).unwrap();
            let mut values = Vec::new();
            measurement.read(&snapshot, &mut values);
            assert_eq!(measurement.names(), ["u_x", "u_y", "p"]);
            // Tolerance for rounding errors in sums of about fifty terms.
            assert!((values[0] - mean).abs() < 1e-13, "{group}: {values:?}");
            assert_eq!(values[1..], [0.0, 0.0]);
        }
    }

    #[test]
    fn linear_quantities_are_sums_over_nodal_components() {
        let solid = solid();
        let space = solid.space();
        let u: Vec<f64> = (0..solid.dofs().n_full()).map(|i| (i as f64).sin()).collect();
        let p = vec![0.0; space.n_pressures()];
        let quantities = [Quantity::Velocity, Quantity::Pressure, Quantity::Displacement];
        let snapshot = snapshot(&solid, &u, &p);
        for measurement in [
            Measurement::at(space, [0.3, 0.7], &quantities).unwrap(),
            Measurement::average(space, "right", &quantities).unwrap(),
        ] {
            let mut values = Vec::new();
            measurement.read(&snapshot, &mut values);
            let of = |value| measurement.functional(space, value);
            assert!(of(2).is_none() && of(5).is_none());
            for (value, quantity) in [
                (0, Quantity::Velocity),
                (1, Quantity::Velocity),
                (3, Quantity::Displacement),
                (4, Quantity::Displacement),
            ] {
                let (found, terms) = of(value).unwrap();
                let sum: f64 = terms.iter().map(|(i, weight)| weight * u[*i]).sum();
                assert_eq!(found, quantity);
                // Tolerance for rounding errors in sums of about twenty terms below 1.
                assert!((sum - values[value]).abs() < 1e-14, "{value}: {sum}");
            }
        }
    }

    /// In simple shear, the principal values reproduce tr E, tr E² and det E and are in descending order.
    #[test]
    fn principal_strains_have_the_invariants_of_the_strain() {
        let solid = solid();
        let space = solid.space();
        let points = space.node_points::<2>().iter();
        let u: Vec<f64> = points.flat_map(|p| [0.5 * p[1], 0.0]).collect();
        let p = vec![0.0; space.n_pressures()];
        let quantities = [Quantity::Strain, Quantity::PrincipalStrain];
        let point = Measurement::at(space, [0.7, 0.4], &quantities).unwrap();
        let mut values = Vec::new();
        point.read(&snapshot(&solid, &u, &p), &mut values);
        let [xx, yy, xy, zz, a, b, c] = values[..] else { panic!("{:?}", point.names()) };
        // γ = 1/2: E_xy = γ/2, E_yy = γ²/2, up to rounding errors of values below 1.
        assert!((xy - 0.25).abs() < 1e-15 && (yy - 0.125).abs() < 1e-15);
        assert!(a > b && b > c, "{values:?}");
        for (found, expected) in [
            (a + b + c, xx + yy + zz),
            (a * a + b * b + c * c, xx * xx + yy * yy + zz * zz + 2.0 * xy * xy),
            (a * b * c, zz * (xx * yy - xy * xy)),
        ] {
            assert!((found - expected).abs() < 1e-15, "{values:?}");
        }
    }

    #[test]
    fn uniform_extension_has_the_volume_ratio_and_stress_of_the_law() {
        let solid = solid();
        let space = solid.space();
        let u: Vec<f64> = space.node_points::<2>().iter().flat_map(|p| [0.1 * p[0], 0.0]).collect();
        let p = vec![-50.0; space.n_pressures()];
        let snapshot = snapshot(&solid, &u, &p);
        let quantities =
            [Quantity::VolumeRatio, Quantity::Stress, Quantity::Strain, Quantity::Principal];
        let mut values = Vec::new();
        let point = Measurement::at(space, [0.7, 0.4], &quantities).unwrap();
        point.read(&snapshot, &mut values);
        assert!((values[0] - 1.1).abs() < 1e-14);
        let piola = solid.laws()[0].stress([[0.1, 0.0], [0.0, 0.0]], -50.0);
        // F = diag(1.1, 1): σ_xx = P_xx, σ_yy = P_yy / 1.1, up to rounding errors of stresses of
        // 1e3 Pa.
        assert!((values[1] - piola[0][0]).abs() < 1e-10);
        assert!((values[2] - piola[1][1] / 1.1).abs() < 1e-10);
        // E_xx = (1.1² - 1)/2; the stress is diagonal, so its principal values are its components.
        assert!((values[5] - 0.105).abs() < 1e-15 && values[6..9].iter().all(|e| e.abs() < 1e-15));
        let mut stresses = [values[1], values[2], values[4]];
        stresses.sort_by(|a, b| b.total_cmp(a));
        for (found, expected) in values[9..].iter().zip(stresses) {
            assert!((found - expected).abs() < 1e-9, "{values:?}");
        }
    }
}
