//! Viscoelastic stress relaxation: force, tangents, and rates of internal stresses.

use crate::error::FemError;
use crate::material::Prony;
use crate::material::three::{Tensor3, add_scaled3, cofactor3, product3};
use crate::operators::pass::ElementPass;
use crate::operators::relaxation::{
    InternalStresses, Overstress, Relax, RelaxationRegion, Requested,
};

use crate::space::ElementPoint;

use super::evaluation::check_length;
use super::partition::assert_infallible;
use super::{Elements, Solid, VectorPasses, with_elements};

impl Solid {
    /// Returns the solid with Prony series in disjoint regions of elements. Regions with an empty series are
    /// ignored.
    ///
    /// # Errors
    /// Returns [`FemError::OutOfRange`] if an element does not exist, [`FemError::DuplicateAddedStress`] if an
    /// element is in two regions, or [`FemError::AddedToSmallStrain`] if an element has a small-strain law.
    pub fn with_relaxation(mut self, regions: &[(Vec<usize>, Prony)]) -> Result<Self, FemError> {
        let given = regions.iter().filter(|(_, prony)| !prony.is_empty());
        let region_of_element =
            self.region_of_element(given.clone().map(|(members, _)| members))?;
        for (material, prony) in self.materials.iter_mut().zip(region_of_element) {
            material.prony = prony;
        }
        self.prony = given.map(|(_, prony)| prony.clone()).collect();
        Ok(self.with_rebuilt_batches())
    }

    /// Returns the solid without Prony series, which has the long-term elastic response.
    #[must_use]
    pub fn relaxed(mut self) -> Self {
        for material in &mut self.materials {
            material.prony = None;
        }
        self.prony.clear();
        self.with_rebuilt_batches()
    }

    /// Returns the viscoelastic regions, one per Prony series.
    pub fn relaxation_regions(&self) -> &[RelaxationRegion] {
        &self.internal.parts
    }

    /// Returns the number of internal stresses.
    pub fn n_internal(&self) -> usize {
        self.relaxation_regions().last().map_or(0, |part| part.states.end)
    }

    /// Returns the overstress F (Σ g S − Σ Q) at a point, or `None` for an element without Prony series. The
    /// second Piola–Kirchhoff overstress in parentheses is known only at the quadrature points. Therefore its
    /// linear least-squares fit in the element is evaluated. The fit is exact for linear functions and zero at
    /// equilibrium.
    pub fn overstress_at(&self, u: &[f64], internal: &[f64], at: &ElementPoint) -> Option<Tensor3> {
        let mesh = self.space.mesh();
        let element = (mesh.dimension(), at.element);
        let (prony, sum_at) = self.internal.sums(element, internal)?;
        let stiffening = prony.instantaneous() - 1.0;
        let law = self.laws()[at.element];
        let n = at.barycentric.len() as f64;
        let mut fit = [[0.0; 3]; 3];
        for (number, point) in self.rule.points(mesh.shape()).iter().enumerate() {
            // For n vertices and unit measure, ∫λa λb = (1 + δab)/(n (n + 1)). Therefore the projection is Σ w_q n
            // ((n + 1) λ·λ_q − 1) s_q. The rule is exact for products of linear functions.
            let coordinates = at.barycentric.iter().zip(point.barycentric.iter());
            let product: f64 = coordinates.map(|(a, b)| a * b).sum();
            let weight = point.weight * n * ((n + 1.0) * product - 1.0);
            let quadrature_point =
                ElementPoint { element: at.element, barycentric: point.barycentric };
            let gradient = self.spatial_gradient_at(u, &quadrature_point);
            let piola = law.stress3(gradient, 0.0, self.axes_at(&quadrature_point));
            add_scaled3(&mut fit, weight * stiffening, &second(&gradient, &piola));
            add_scaled3(&mut fit, -weight, &sum_at(number));
        }
        Some(product3(&deformation(&self.spatial_gradient_at(u, at)), &fit))
    }

    /// Returns the number of slots, which are stress components at quadrature points.
    pub fn n_slots(&self) -> usize {
        self.relaxation_regions().last().map_or(0, |part| part.slots.end)
    }

    /// Writes the rates (g S − Q)/τ to `rates` and adds ∫ F (Σ g S − Σ Q) : ∇φ to `force`.
    ///
    /// # Shapes
    /// `u` and `force` have length `n_components`; `internal` (Q) and `rates` have length
    /// [`n_internal`](Self::n_internal).
    pub fn relaxation_force(
        &self,
        u: &[f64],
        internal: &[f64],
        force: Option<&mut [f64]>,
        rates: &mut [f64],
    ) {
        check_length(self.n_internal(), Some(internal), "internal stresses");
        check_length(self.n_internal(), Some(rates), "rates");
        check_length(self.space.n_components(), force.as_deref(), "force");
        self.relax(u, Requested::Vectors { internal, force, rates });
    }

    /// Returns the internal stresses g S at equilibrium with the displacement `u`.
    pub fn equilibrium_overstress(&self, u: &[f64]) -> Vec<f64> {
        let mut internal = vec![0.0; self.n_internal()];
        let zero = internal.clone();
        self.relaxation_force(u, &zero, None, &mut internal);
        for part in self.relaxation_regions() {
            let terms = internal[part.states.clone()].chunks_mut(part.slots.len());
            for (states, term) in terms.zip(part.prony.terms()) {
                states.iter_mut().for_each(|rate| *rate *= term.time);
            }
        }
        internal
    }

    /// Writes the second Piola–Kirchhoff stress S to `out`. This stress drives the internal stresses.
    ///
    /// # Shapes
    /// `out` has length [`n_slots`](Self::n_slots).
    pub fn driving_stresses(&self, u: &[f64], out: &mut [f64]) {
        check_length(self.n_slots(), Some(out), "stresses");
        self.relax(u, Requested::Stresses { out });
    }

    /// Adds ∫ F T : ∇φ for each symmetric tensor T of `tensors` to the corresponding entry of `forces`. All forces
    /// are computed in one pass.
    ///
    /// # Shapes
    /// Each entry of `tensors` has length [`n_slots`](Self::n_slots).
    pub fn tensor_forces(&self, u: &[f64], tensors: &[Vec<f64>], forces: &mut [Vec<f64>]) {
        assert_eq!(tensors.len(), forces.len(), "a force for each");
        for (tensors, force) in tensors.iter().zip(&*forces) {
            check_length(self.n_slots(), Some(tensors), "tensors");
            check_length(self.space.n_components(), Some(force), "force");
        }
        self.relax(u, Requested::ForceOf { tensors, forces });
    }

    /// Writes the stress rate Ṡ along each velocity of `v` to the corresponding entry of `out`. All rates are
    /// computed in one pass.
    ///
    /// # Shapes
    /// Each entry of `out` has length [`n_slots`](Self::n_slots).
    pub fn driving_stress_rates(&self, u: &[f64], v: &[Vec<f64>], out: &mut [Vec<f64>]) {
        assert_eq!(v.len(), out.len(), "rates for each");
        for (v, out) in v.iter().zip(&*out) {
            check_length(self.n_slots(), Some(out), "stress rates");
            check_length(self.space.n_components(), Some(v), "v");
        }
        self.relax(u, Requested::StressRates { v, out });
    }

    /// Writes ∂/∂u ∫ F H : ∇φ at constant H to `geometric`. For each viscoelastic region, writes ∂/∂u ∫ F S : ∇φ
    /// at constant F to `material`.
    ///
    /// # Shapes
    /// Values are in the order of the displacement pattern. `material` has one entry per viscoelastic region.
    pub fn relaxation_tangents(
        &self,
        u: &[f64],
        over: Overstress<'_>,
        geometric: &mut [f64],
        material: &mut [Vec<f64>],
    ) {
        match over {
            Overstress::Internal(values) => {
                check_length(self.n_internal(), Some(values), "internal")
            }
            Overstress::Given(values) => check_length(self.n_slots(), Some(values), "overstress"),
        }
        let n = self.displacement_pattern.nnz();
        check_length(n, Some(geometric), "geometric");
        geometric.fill(0.0);
        for values in material.iter_mut() {
            check_length(n, Some(values), "material");
            values.fill(0.0);
        }
        self.relax(u, Requested::Tangents { over, geometric, material });
    }

    fn relax(&self, u: &[f64], requested: Requested<'_>) {
        check_length(self.space.n_components(), Some(u), "u");
        let layout: &InternalStresses = &self.internal;
        let done = with_elements!(&self.elements, mapped => mapped.run(self.arch, ElementPass {
            elements: mapped.batches.all(),
            kernel: Relax { maps: &mapped.maps, layout, u, requested },
        }));
        assert_infallible(done);
    }
}

/// Returns F = I + ∇u.
fn deformation(gradient: &Tensor3) -> Tensor3 {
    let mut f = *gradient;
    (0..3).for_each(|i| f[i][i] += 1.0);
    f
}

/// Returns S = F⁻¹ P.
fn second(gradient: &Tensor3, piola: &Tensor3) -> Tensor3 {
    let f = deformation(gradient);
    let cofactor = cofactor3(&f);
    let jacobian: f64 = f[0].iter().zip(&cofactor[0]).map(|(f, c)| f * c).sum();
    let entry = |i: usize, j: usize| (0..3).map(|k| cofactor[k][i] * piola[k][j]).sum::<f64>();
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| entry(i, j) / jacobian))
}
