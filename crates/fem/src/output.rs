//! Quantities for output: energies, and the state at a point. Computed only when called.

use crate::element::Barycentric;
use crate::material::Law;
use crate::material::three::{Tensor3, add_scaled3, contract3, scaled3};
use crate::operators::added::AtPoint;
use crate::solid::{Fields, Pressure, Solid};
use crate::space::{Degree, Located};

/// The range of J over some places of a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VolumeRatios {
    /// The smallest; below 0 the body is turned inside out there.
    pub smallest: f64,
    /// Where it is.
    pub at: Located,
    /// The largest.
    pub largest: f64,
}

/// What the stress depends on beside the displacement, the pressure and their rates.
#[derive(Debug, Clone, Copy)]
pub struct Beside<'a> {
    /// The tension of each element, Pa; none needed without added stresses.
    pub tensions: &'a [f64],
    /// β of stiffness-proportional damping, s.
    pub beta: f64,
    /// The internal stresses, Pa; none needed where no stress relaxes.
    pub internal: &'a [f64],
}

/// Deformation and stress at a point; in plane strain with the components normal to the plane.
///
/// # Units
/// Stresses and pressure in Pa.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointState {
    /// ∇u.
    pub gradient: Tensor3,
    /// J = det F (1 + div u for small strains).
    pub jacobian: f64,
    /// p, or −κ (J − 1) where there is no pressure field; −tr σ/3 of a law whose energy holds the
    /// volume's part.
    pub pressure: f64,
    /// First Piola–Kirchhoff stress P.
    pub piola: Tensor3,
    /// Cauchy stress P Fᵀ / J.
    pub cauchy: Tensor3,
}

impl PointState {
    /// The state with P instead of its own; `is_linear`: of small strains, all stresses are one.
    fn with_stress(mut self, piola: Tensor3, is_linear: bool) -> Self {
        (self.piola, self.cauchy) = (piola, piola);
        if !is_linear {
            let f = |j: usize, k: usize| f64::from(j == k) + self.gradient[j][k];
            let entry = |i: usize, j: usize| {
                let products = (0..3).map(|k| piola[i][k] * f(j, k));
                products.sum::<f64>() / self.jacobian
            };
            self.cauchy = [0, 1, 2].map(|i| [0, 1, 2].map(|j| entry(i, j)));
        }
        self
    }

    /// Von Mises' equivalent of the Cauchy stress.
    pub fn von_mises(&self) -> f64 {
        let [[xx, xy, xz], [_, yy, yz], [_, _, zz]] = self.cauchy;
        let squares = (xx - yy).powi(2) + (yy - zz).powi(2) + (zz - xx).powi(2);
        let shears = xy * xy + xz * xz + yz * yz;
        (0.5 * squares + 3.0 * shears).sqrt()
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
        let gradient = self.spatial_gradient_at(fields.u, at);
        let volume_change = law.volume_change3(gradient);
        let pressure = match fields.pressure {
            Pressure::Nodal(p) => self.space().pressure_at(p, at),
            Pressure::Penalty { kappa } => {
                -law.penalty(kappa * self.ratios(at.element).kappa) * volume_change
            }
        };
        let jacobian = 1.0 + volume_change;
        let piola = law.stress3(gradient, pressure, self.axes_at(at));
        let state = PointState {
            gradient,
            jacobian,
            pressure,
            piola,
            cauchy: piola,
        };
        let mut state = state.with_stress(piola, law.is_linear());
        if law.description().complete {
            state.pressure = -(0..3).map(|i| state.cauchy[i][i]).sum::<f64>() / 3.0;
        }
        state
    }

    /// The same with all stress that the balance of momentum has: what is added to the law's, what
    /// relaxes, and what damps in proportion to the stiffness.
    ///
    /// # Panics
    /// If a length is wrong, or there is no velocity.
    pub fn state_in_motion_at(
        &self,
        fields: &Fields<'_>,
        beside: &Beside<'_>,
        at: &Located,
    ) -> PointState {
        let state = self.state_at(fields, at);
        let velocity = || {
            let v = fields.v.expect("the velocity of a body in motion");
            self.spatial_gradient_at(v, at)
        };
        let added = self.added_number(at.element).map(|number| {
            let stress = &self.added_stresses()[number];
            let tension = Some(beside.tensions[at.element]).filter(|tension| *tension != 0.0);
            let motion = [state.gradient, velocity()];
            AtPoint::new(stress, tension, self.axes_at(at).fibre, motion).stress(0.0)
        });
        let beta = beside.beta * self.ratios(at.element).beta;
        let damping = (beta > 0.0).then(|| {
            let rate = self.stress_rate_at(fields, &state, velocity(), at);
            scaled3(beta, &rate)
        });
        let relaxing = self.overstress_at(fields.u, beside.internal, at);
        let mut total = state.piola;
        for part in [added, damping, relaxing].iter().flatten() {
            add_scaled3(&mut total, 1.0, part);
        }
        state.with_stress(total, self.laws()[at.element].is_linear())
    }

    /// Ṗ of the law and the pressure along ∇v.
    fn stress_rate_at(
        &self,
        fields: &Fields<'_>,
        state: &PointState,
        v: Tensor3,
        at: &Located,
    ) -> Tensor3 {
        let (law, h) = (self.law_at(fields, at), state.gradient);
        let pressures = match fields.pressure {
            Pressure::Nodal(_) => {
                let rate = fields.p_rate;
                let rate = rate.map_or(0.0, |p| self.space().pressure_at(p, at));
                [state.pressure, rate]
            }
            Pressure::Penalty { kappa } => {
                let kappa = law.penalty(kappa * self.ratios(at.element).kappa);
                let rate = contract3(&law.volume_gradient3(h), &v);
                [law.volume_change3(h), rate].map(|volume| -kappa * volume)
            }
        };
        law.stress_rate3(h, v, pressures, self.axes_at(at))
    }

    /// The law at a place in the mesh, its factor included.
    fn law_at(&self, fields: &Fields<'_>, at: &Located) -> Law {
        let law = self.laws()[at.element];
        fields.factors.map_or(law, |factors| {
            let own = &factors[at.barycentric.len() * at.element..];
            let vertices = own.iter().zip(at.barycentric.iter());
            law.scaled(vertices.map(|(factor, psi)| factor * psi).sum())
        })
    }

    /// The range of J = det F (1 + div u for small strains) in the quadrature points.
    ///
    /// # Panics
    /// If the length of `u` is wrong.
    pub fn volume_ratios(&self, u: &[f64]) -> VolumeRatios {
        let rule = self.rule().points(self.space().mesh().shape()).into_iter();
        let points: Vec<Barycentric> = rule.map(|point| point.barycentric).collect();
        self.volume_ratios_at(u, &points)
    }

    /// The range of J at the vertices of all elements: forces are summed in quadrature points, and do not
    /// see it.
    ///
    /// # Panics
    /// If the length of `u` is wrong.
    pub fn vertex_volume_ratios(&self, u: &[f64]) -> VolumeRatios {
        let vertices = self.space().mesh().shape().nodes(Degree::One);
        self.volume_ratios_at(u, &vertices)
    }

    /// The range of J at these places of the elements.
    fn volume_ratios_at(&self, u: &[f64], points: &[Barycentric]) -> VolumeRatios {
        match self.space().dimension() {
            2 => self.ratios_in_elements::<2>(u, points),
            _ => self.ratios_in_elements::<3>(u, points),
        }
    }

    /// The same. Runs look at it a hundred times: shape functions are evaluated once for all elements, the map of a
    /// straight one once.
    fn ratios_in_elements<const D: usize>(
        &self,
        u: &[f64],
        points: &[Barycentric],
    ) -> VolumeRatios {
        let space = self.space();
        let shape = space.mesh().shape();
        let slopes = |at: &Barycentric| shape.gradients::<D>(space.degree(), at);
        let slopes: Vec<_> = points.iter().map(slopes).collect();
        let mut found = VolumeRatios {
            smallest: f64::INFINITY,
            largest: f64::NEG_INFINITY,
            at: Located {
                element: 0,
                barycentric: points[0],
            },
        };
        for element in 0..space.n_elements() {
            let (nodes, law) = (space.element_nodes(element), self.laws()[element]);
            let mut inverse = space.map_at::<D>(element, &points[0]).0;
            for (number, (&barycentric, slopes)) in points.iter().zip(&slopes).enumerate() {
                if number > 0 && space.is_curved(element) {
                    inverse = space.map_at::<D>(element, &barycentric).0;
                }
                // By the coordinates of the reference element.
                let mut own = [[0.0; D]; D];
                for (&node, slope) in nodes.iter().zip(slopes) {
                    for (row, u) in own.iter_mut().zip(&u[D * node..]) {
                        for (entry, slope) in row.iter_mut().zip(slope) {
                            *entry += u * slope;
                        }
                    }
                }
                let mut gradient = [[0.0; 3]; 3];
                for (row, own) in gradient.iter_mut().zip(&own) {
                    for (m, by_reference) in own.iter().enumerate() {
                        for (entry, inverse) in row.iter_mut().zip(&inverse[m]) {
                            *entry += by_reference * inverse;
                        }
                    }
                }
                let ratio = 1.0 + law.volume_change3(gradient);
                found.largest = found.largest.max(ratio);
                if ratio < found.smallest {
                    found.smallest = ratio;
                    found.at = Located {
                        element,
                        barycentric,
                    };
                }
            }
        }
        found
    }

    /// ∇u at a place in the mesh; in the plane with a third row and column of zeros.
    pub fn spatial_gradient_at(&self, u: &[f64], at: &Located) -> Tensor3 {
        if self.space().dimension() == 3 {
            return self.gradient_at(u, at);
        }
        let [[xx, xy], [yx, yy]] = self.gradient_at(u, at);
        [[xx, xy, 0.0], [yx, yy, 0.0], [0.0; 3]]
    }

    /// ∇u at a place in the mesh.
    ///
    /// # Panics
    /// Unless `D` is the dimension.
    pub fn gradient_at<const D: usize>(&self, u: &[f64], at: &Located) -> [[f64; D]; D] {
        let space = self.space();
        let (inverse, _) = space.map_at::<D>(at.element, &at.barycentric);
        let shape = space.mesh().shape();
        let gradients = shape.gradients::<D>(space.degree(), &at.barycentric);
        let mut h = [[0.0; D]; D];
        for (&node, gradient) in space.element_nodes(at.element).iter().zip(gradients) {
            for (i, row) in h.iter_mut().enumerate() {
                for (j, entry) in row.iter_mut().enumerate() {
                    let slope: f64 = (0..D).map(|m| gradient[m] * inverse[m][j]).sum();
                    *entry += u[D * node + i] * slope;
                }
            }
        }
        h
    }

    /// ½ vᵀ M v.
    ///
    /// # Units
    /// J, in plane strain J/m.
    pub fn kinetic_energy(&self, v: &[f64]) -> f64 {
        let mut momentum = vec![0.0; v.len()];
        self.apply_mass(v, &mut momentum);
        0.5 * momentum.iter().zip(v).map(|(m, v)| m * v).sum::<f64>()
    }
}
