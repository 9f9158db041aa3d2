//! Output quantities: kinetic energy, volume ratios, and deformation and stress at a point. They are computed on
//! demand.

use crate::element::Barycentric;
use crate::material::Law;
use crate::material::three::{Tensor3, add_scaled3, contract3, scaled3};
use crate::operators::added::AtPoint;
use crate::solid::{Fields, Pressure, Solid};
use crate::space::{Degree, ElementPoint};

/// Range of J over sampled points of a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VolumeRatios {
    /// Minimum of J. A negative value means that the body is inverted at this point.
    pub smallest: f64,
    /// Point at which J has its minimum.
    pub at: ElementPoint,
    /// Maximum of J.
    pub largest: f64,
}

/// Data for the computation of stresses other than displacement, pressure and their rates.
#[derive(Debug, Clone, Copy)]
pub struct StressContext<'a> {
    /// Tension (Pa) of each element. Not used without added stresses.
    pub tensions: &'a [f64],
    /// Coefficient β (s) of stiffness-proportional damping.
    pub beta: f64,
    /// Internal stresses, in Pa. Not used without Prony series.
    pub internal: &'a [f64],
}

/// Deformation and stress at a point. In plane strain, the out-of-plane components are included.
///
/// # Units
/// Stresses and pressure are in Pa.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointState {
    /// Displacement gradient ∇u.
    pub gradient: Tensor3,
    /// Volume ratio J = det F (1 + div u for small strains).
    pub jacobian: f64,
    /// Pressure p. Without a pressure field, this is −κ g(J) with the [function](crate::material::VolumeFunction)
    /// g. For a law whose energy includes the volumetric part, it is −tr σ/3.
    pub pressure: f64,
    /// First Piola–Kirchhoff stress P.
    pub piola: Tensor3,
    /// Cauchy stress P Fᵀ / J.
    pub cauchy: Tensor3,
}

impl PointState {
    /// Returns the state with its stress replaced by P. If `is_linear` is true (small strains), P and σ are equal.
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

    /// Returns the von Mises equivalent stress of the Cauchy stress.
    pub fn von_mises(&self) -> f64 {
        let [[xx, xy, xz], [_, yy, yz], [_, _, zz]] = self.cauchy;
        let squares = (xx - yy).powi(2) + (yy - zz).powi(2) + (zz - xx).powi(2);
        let shears = xy * xy + xz * xz + yz * yz;
        (0.5 * squares + 3.0 * shears).sqrt()
    }
}

impl Solid {
    /// Returns the deformation and the elastic stress at a point.
    ///
    /// The values are meaningless in an inverted element.
    ///
    /// # Panics
    /// Panics if the length of a field is wrong.
    pub fn state_at(&self, fields: &Fields<'_>, at: &ElementPoint) -> PointState {
        let law = self.law_at(fields, at);
        let gradient = self.spatial_gradient_at(fields.u, at);
        let volume_change = law.volume_change3(gradient);
        let jacobian = 1.0 + volume_change;
        let function = self.volume_function(at.element);
        let pressure = match fields.pressure {
            Pressure::Nodal(p) => self.space().pressure_at(p, at),
            Pressure::Penalty { kappa } => {
                let kappa = law.penalty(kappa * self.element_scale(at.element).kappa);
                -kappa * function.value(volume_change)
            }
        };
        let piola =
            law.stress3(gradient, function.slope(volume_change) * pressure, self.axes_at(at));
        let state = PointState { gradient, jacobian, pressure, piola, cauchy: piola };
        let mut state = state.with_stress(piola, law.is_linear());
        if law.description().complete {
            state.pressure = -(0..3).map(|i| state.cauchy[i][i]).sum::<f64>() / 3.0;
        }
        state
    }

    /// Returns the deformation and the total stress in the momentum balance. The total stress is the sum of the
    /// elastic, added, viscoelastic and stiffness-proportional damping stresses.
    ///
    /// # Panics
    /// Panics if a length is wrong or the velocity is missing.
    pub fn dynamic_state_at(
        &self,
        fields: &Fields<'_>,
        context: &StressContext<'_>,
        at: &ElementPoint,
    ) -> PointState {
        let state = self.state_at(fields, at);
        let velocity = || {
            let v = fields.v.expect("the velocity of a body in motion");
            self.spatial_gradient_at(v, at)
        };
        let added = self.added_number(at.element).map(|number| {
            let stress = &self.added_stresses()[number];
            let tension = Some(context.tensions[at.element]).filter(|tension| *tension != 0.0);
            let motion = [state.gradient, velocity()];
            AtPoint::new(stress, tension, self.axes_at(at).fiber, motion).stress(0.0)
        });
        let beta = context.beta * self.element_scale(at.element).beta;
        let damping = (beta > 0.0).then(|| {
            let rate = self.stress_rate_at(fields, &state, velocity(), at);
            scaled3(beta, &rate)
        });
        let viscoelastic = self.overstress_at(fields.u, context.internal, at);
        let mut total = state.piola;
        for part in [added, damping, viscoelastic].iter().flatten() {
            add_scaled3(&mut total, 1.0, part);
        }
        state.with_stress(total, self.laws()[at.element].is_linear())
    }

    /// Returns Ṗ for the velocity gradient `v`, including the rate of the pressure.
    fn stress_rate_at(
        &self,
        fields: &Fields<'_>,
        state: &PointState,
        v: Tensor3,
        at: &ElementPoint,
    ) -> Tensor3 {
        let (law, h) = (self.law_at(fields, at), state.gradient);
        let dilation_rate = contract3(&law.volume_gradient3(h), &v);
        let (function, d) = (self.volume_function(at.element), law.volume_change3(h));
        let slope = function.slope(d);
        // For a law that includes the volumetric part, the penalty is zero, but the pressure of the state is not.
        let (pressure, rate) = match fields.pressure {
            Pressure::Nodal(p) => {
                let value = |p: &[f64]| self.space().pressure_at(p, at);
                (value(p), fields.p_rate.map_or(0.0, value))
            }
            Pressure::Penalty { kappa } => {
                let kappa = law.penalty(kappa * self.element_scale(at.element).kappa);
                (-kappa * function.value(d), -kappa * slope * dilation_rate)
            }
        };
        let slope_rate = function.curvature(d) * dilation_rate;
        let pressures = [slope * pressure, slope * rate + slope_rate * pressure];
        law.stress_rate3(h, v, pressures, self.axes_at(at))
    }

    /// Returns the law at a point, scaled by its factor.
    fn law_at(&self, fields: &Fields<'_>, at: &ElementPoint) -> Law {
        let law = self.laws()[at.element];
        let mut product = Vec::new();
        let fields = self.with_own_factors(fields, &mut product);
        fields.factors.map_or(law, |factors| {
            let factors = &factors[at.barycentric.len() * at.element..];
            let vertices = factors.iter().zip(at.barycentric.iter());
            law.scaled(vertices.map(|(factor, psi)| factor * psi).sum())
        })
    }

    /// Returns the range of J = det F (1 + div u for small strains) over the quadrature points.
    ///
    /// # Panics
    /// Panics if the length of `u` is wrong.
    pub fn volume_ratios(&self, u: &[f64]) -> VolumeRatios {
        let rule = self.rule().points(self.space().mesh().shape()).into_iter();
        let points: Vec<Barycentric> = rule.map(|point| point.barycentric).collect();
        self.volume_ratios_at(u, &points)
    }

    /// Returns the range of J over the vertices of all elements. Forces are evaluated at quadrature
    /// points and do not depend on these values.
    ///
    /// # Panics
    /// Panics if the length of `u` is wrong.
    pub fn vertex_volume_ratios(&self, u: &[f64]) -> VolumeRatios {
        let vertices = self.space().mesh().shape().nodes(Degree::One);
        self.volume_ratios_at(u, &vertices)
    }

    /// Returns the range of J over the given points of all elements.
    fn volume_ratios_at(&self, u: &[f64], points: &[Barycentric]) -> VolumeRatios {
        in_dimension!(self.space().dimension(), |D| self.volume_ratios_in::<D>(u, points))
    }

    /// This function is called often during runs. Therefore shape functions are evaluated once for all elements,
    /// and the map of a straight element is evaluated once.
    fn volume_ratios_in<const D: usize>(&self, u: &[f64], points: &[Barycentric]) -> VolumeRatios {
        let space = self.space();
        let shape = space.mesh().shape();
        let slopes = |at: &Barycentric| shape.gradients::<D>(space.degree(), at);
        let slopes: Vec<_> = points.iter().map(slopes).collect();
        let mut found = VolumeRatios {
            smallest: f64::INFINITY,
            largest: f64::NEG_INFINITY,
            at: ElementPoint { element: 0, barycentric: points[0] },
        };
        for element in 0..space.n_elements() {
            let (nodes, law) = (space.element_nodes(element), self.laws()[element]);
            let mut inverse = space.map_at::<D>(element, &points[0]).0;
            for (number, (&barycentric, slopes)) in points.iter().zip(&slopes).enumerate() {
                if number > 0 && space.is_curved(element) {
                    inverse = space.map_at::<D>(element, &barycentric).0;
                }
                // The gradient in reference coordinates.
                let mut reference = [[0.0; D]; D];
                for (&node, slope) in nodes.iter().zip(slopes) {
                    for (row, u) in reference.iter_mut().zip(&u[D * node..]) {
                        for (entry, slope) in row.iter_mut().zip(slope) {
                            *entry += u * slope;
                        }
                    }
                }
                let mut gradient = [[0.0; 3]; 3];
                for (row, reference) in gradient.iter_mut().zip(&reference) {
                    for (m, slope) in reference.iter().enumerate() {
                        for (entry, inverse) in row.iter_mut().zip(&inverse[m]) {
                            *entry += slope * inverse;
                        }
                    }
                }
                let ratio = 1.0 + law.volume_change3(gradient);
                found.largest = found.largest.max(ratio);
                if ratio < found.smallest {
                    found.smallest = ratio;
                    found.at = ElementPoint { element, barycentric };
                }
            }
        }
        found
    }

    /// Returns ∇u at a point as a 3D tensor. In 2D, the third row and the third column are zero.
    pub fn spatial_gradient_at(&self, u: &[f64], at: &ElementPoint) -> Tensor3 {
        if self.space().dimension() == 3 {
            return self.gradient_at(u, at);
        }
        let [[xx, xy], [yx, yy]] = self.gradient_at(u, at);
        [[xx, xy, 0.0], [yx, yy, 0.0], [0.0; 3]]
    }

    /// Returns ∇u at a point.
    pub fn gradient_at<const D: usize>(&self, u: &[f64], at: &ElementPoint) -> [[f64; D]; D] {
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

    /// Returns the kinetic energy ½ vᵀ M v.
    ///
    /// # Units
    /// The energy is in J, or in J/m in plane strain.
    pub fn kinetic_energy(&self, v: &[f64]) -> f64 {
        let mut momentum = vec![0.0; v.len()];
        self.apply_mass(v, &mut momentum);
        0.5 * momentum.iter().zip(v).map(|(m, v)| m * v).sum::<f64>()
    }
}
