//! Quantities for output: energies, and the state at a point. Computed only when called.

use crate::element::{inverse_map, p1_gradients, p2_gradients};
use crate::material::{Law, Tensor};
use crate::solid::{Fields, Pressure, Solid};
use crate::space::{Degree, Located};

/// Deformation and stress at a point, in plane strain.
///
/// # Units
/// Stresses and pressure in Pa.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointState {
    /// ∇u.
    pub gradient: Tensor,
    /// J = det F (1 + div u for small strains).
    pub jacobian: f64,
    /// p, or −κ (J − 1) where there is no pressure field.
    pub pressure: f64,
    /// First Piola–Kirchhoff stress P, in the plane.
    pub piola: Tensor,
    /// Cauchy stress P Fᵀ / J, in the plane.
    pub cauchy: Tensor,
    /// Cauchy stress normal to the plane.
    pub cauchy_33: f64,
}

impl PointState {
    /// Von Mises' equivalent of the Cauchy stress, its normal component included.
    pub fn von_mises(&self) -> f64 {
        let [[xx, xy], [_, yy]] = self.cauchy;
        let zz = self.cauchy_33;
        let squares = (xx - yy).powi(2) + (yy - zz).powi(2) + (zz - xx).powi(2);
        (0.5 * squares + 3.0 * xy * xy).sqrt()
    }
}

impl Solid {
    /// Deformation and stress at a place in the mesh.
    ///
    /// Meaningless numbers where the element is inverted.
    ///
    /// # Panics
    /// If a field's length is wrong.
    pub fn state_at(&self, fields: &Fields<'_>, at: &Located) -> PointState {
        let law = self.law_at(fields, at);
        let h = self.gradient_at(fields.u, at);
        let pressure = match fields.pressure {
            Pressure::Nodal(p) => self.space().pressure_at(p, at),
            Pressure::Penalty { kappa } => -kappa * law.volume_change(h),
        };
        let jacobian = 1.0 + law.volume_change(h);
        let piola = law.stress(h, pressure);
        let (cauchy, cauchy_33) = match law {
            Law::SmallStrain { .. } => (piola, law.stress_33(h, pressure)),
            Law::MooneyRivlin { .. } | Law::StVenantKirchhoff { .. } => {
                let f = [[1.0 + h[0][0], h[0][1]], [h[1][0], 1.0 + h[1][1]]];
                let entry =
                    |i: usize, j: usize| (piola[i][0] * f[j][0] + piola[i][1] * f[j][1]) / jacobian;
                let cauchy = [[entry(0, 0), entry(0, 1)], [entry(1, 0), entry(1, 1)]];
                (cauchy, law.stress_33(h, pressure) / jacobian)
            }
        };
        PointState {
            gradient: h,
            jacobian,
            pressure,
            piola,
            cauchy,
            cauchy_33,
        }
    }

    /// The law at a place in the mesh, its factor included.
    fn law_at(&self, fields: &Fields<'_>, at: &Located) -> Law {
        let law = self.laws()[at.element];
        fields.factors.map_or(law, |factors| {
            let corners = factors[at.element].iter().zip(at.barycentric);
            law.scaled(corners.map(|(factor, psi)| factor * psi).sum())
        })
    }

    /// The smallest J = det F (1 + div u for small strains) in the quadrature points, and where.
    ///
    /// # Panics
    /// If the length of `u` is wrong.
    pub fn least_volume_ratio(&self, u: &[f64]) -> (f64, Located) {
        let rule = self.rule().points();
        let places = (0..self.space().n_elements()).flat_map(|element| {
            let barycentric = rule.iter().map(|point| point.barycentric);
            barycentric.map(move |barycentric| Located {
                element,
                barycentric,
            })
        });
        let ratio = |at: Located| {
            let law = self.laws()[at.element];
            (1.0 + law.volume_change(self.gradient_at(u, &at)), at)
        };
        places
            .map(ratio)
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .expect("a mesh has triangles")
    }

    /// ∇u at a place in the mesh.
    pub fn gradient_at(&self, u: &[f64], at: &Located) -> Tensor {
        let (inverse, _) = inverse_map(self.space().mesh().corners(at.element));
        let gradients = match self.space().degree() {
            Degree::One => p1_gradients().to_vec(),
            Degree::Two => p2_gradients(at.barycentric).to_vec(),
        };
        let mut h = [[0.0; 2]; 2];
        for (&node, gradient) in self.space().element_nodes(at.element).iter().zip(gradients) {
            for (i, row) in h.iter_mut().enumerate() {
                for (j, entry) in row.iter_mut().enumerate() {
                    let slope = gradient[0] * inverse[0][j] + gradient[1] * inverse[1][j];
                    *entry += u[2 * node + i] * slope;
                }
            }
        }
        h
    }

    /// The energy whose derivative by u is the force: ∫ W(F) − p (J − 1), or ∫ W(F) + κ/2 (J − 1)².
    ///
    /// With a pressure that satisfies the constraint the stored energy is this less
    /// pᵀ M_p p / (2κ). Paper: eqs. (16), (20).
    ///
    /// # Units
    /// J/m.
    pub fn strain_energy(&self, fields: &Fields<'_>) -> f64 {
        let rule = self.rule().points();
        let density = |at: &Located| {
            let law = self.law_at(fields, at);
            let h = self.gradient_at(fields.u, at);
            let d = law.volume_change(h);
            let volumetric = match fields.pressure {
                Pressure::Nodal(p) => -self.space().pressure_at(p, at) * d,
                Pressure::Penalty { kappa } => 0.5 * kappa * d * d,
            };
            law.energy(h) + volumetric
        };
        (0..self.space().n_elements())
            .map(|element| {
                let (_, det) = inverse_map(self.space().mesh().corners(element));
                let sum: f64 = rule
                    .iter()
                    .map(|q| {
                        q.weight
                            * density(&Located {
                                element,
                                barycentric: q.barycentric,
                            })
                    })
                    .sum();
                0.5 * det * sum
            })
            .sum()
    }

    /// ½ vᵀ M v.
    ///
    /// # Units
    /// J/m.
    pub fn kinetic_energy(&self, v: &[f64]) -> f64 {
        let mut momentum = vec![0.0; v.len()];
        self.apply_mass(v, &mut momentum);
        0.5 * momentum.iter().zip(v).map(|(m, v)| m * v).sum::<f64>()
    }
}
