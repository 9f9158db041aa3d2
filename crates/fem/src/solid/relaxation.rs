//! Stress that relaxes: its force, its tangents, and the rates of its internal stresses.

use crate::error::FemError;
use crate::material::Prony;
use crate::material::three::{Tensor3, add_scaled3, cofactor3, product3};
use crate::operators::relaxation::{InternalStresses, Overstress, Relax, RelaxingPart, Wanted};

use crate::space::Located;

use super::evaluation::check_length;
use super::{Elements, Solid, narrow, with_elements};

impl Solid {
    /// The solid with the stress of its laws relaxing by Prony terms, in elements of their own for
    /// each series; what has no term is left as it is.
    ///
    /// # Errors
    /// [`FemError::OutOfRange`] for an element that does not exist; [`FemError::TwoAdded`] for one
    /// that is given two series; [`FemError::AddedToSmallStrain`] for one whose law is of small
    /// strains.
    pub fn with_relaxation(mut self, regions: &[(Vec<usize>, Prony)]) -> Result<Self, FemError> {
        let given = regions
            .iter()
            .filter(|(_, prony)| !prony.terms().is_empty());
        let of_element = self.numbered(given.clone().map(|(members, _)| members))?;
        for (kind, relaxing) in self.kinds.iter_mut().zip(of_element) {
            kind.relaxing = relaxing;
        }
        self.prony = given.map(|(_, prony)| prony.clone()).collect();
        Ok(self.regrouped())
    }

    /// The solid as it is when all stress has relaxed.
    #[must_use]
    pub fn relaxed(mut self) -> Self {
        for kind in &mut self.kinds {
            kind.relaxing = None;
        }
        self.prony.clear();
        self.regrouped()
    }

    /// The elements whose stress relaxes, by their Prony terms.
    pub fn relaxing_parts(&self) -> &[RelaxingPart] {
        &self.internal.parts
    }

    /// Number of internal stresses.
    pub fn n_internal(&self) -> usize {
        self.relaxing_parts()
            .last()
            .map_or(0, |part| part.states.end)
    }

    /// F (Σ g S − Σ Q) at a place in the mesh. What is in brackets is, of its values at the quadrature points of the
    /// element, the only places where Q is known, the linear function that fits best by least squares, exact for one
    /// that is linear. So it is zero where all stress has relaxed. Nothing where no stress relaxes.
    ///
    /// # Panics
    /// If a length is wrong.
    pub fn overstress_at(&self, u: &[f64], internal: &[f64], at: &Located) -> Option<Tensor3> {
        let mesh = self.space.mesh();
        let of = (mesh.dimension(), at.element);
        let (prony, sum_at) = self.internal.sums(of, internal)?;
        let of_law = prony.instantaneous() - 1.0;
        let law = self.laws()[at.element];
        let n = at.barycentric.len() as f64;
        let mut fit = [[0.0; 3]; 3];
        for (number, point) in self.rule.points(mesh.shape()).iter().enumerate() {
            // With ∫λa λb = (1 + δab)/(n (n + 1)) of the n vertices, per measure, the projection is
            // Σ w_q n ((n + 1) λ·λ_q − 1) s_q: the rule is exact for products of linear functions.
            let coordinates = at.barycentric.iter().zip(point.barycentric.iter());
            let product: f64 = coordinates.map(|(a, b)| a * b).sum();
            let weight = point.weight * n * ((n + 1.0) * product - 1.0);
            let there = Located {
                element: at.element,
                barycentric: point.barycentric,
            };
            let gradient = self.spatial_gradient_at(u, &there);
            let piola = law.stress3(gradient, 0.0, self.axes_at(&there));
            add_scaled3(&mut fit, weight * of_law, &second(&gradient, &piola));
            add_scaled3(&mut fit, -weight, &sum_at(number));
        }
        Some(product3(
            &deformation(&self.spatial_gradient_at(u, at)),
            &fit,
        ))
    }

    /// Number of slots: components at quadrature points.
    pub fn n_slots(&self) -> usize {
        self.relaxing_parts()
            .last()
            .map_or(0, |part| part.slots.end)
    }

    /// `rates` ← (g S − Q)/τ, and `force` += ∫ F (Σ g S − Σ Q) : ∇φ.
    ///
    /// # Shapes
    /// `u`, `force`: `n_components`; `internal` (Q), `rates`: [`n_internal`](Self::n_internal).
    ///
    /// # Panics
    /// If a length is wrong.
    pub fn relaxing_force(
        &self,
        u: &[f64],
        internal: &[f64],
        force: Option<&mut [f64]>,
        rates: &mut [f64],
    ) {
        check_length(self.n_internal(), Some(internal), "internal stresses");
        check_length(self.n_internal(), Some(rates), "rates");
        check_length(self.space.n_components(), force.as_deref(), "force");
        self.relax(
            u,
            Wanted::Vectors {
                internal,
                force,
                rates,
            },
        );
    }

    /// The internal stresses g S of a body whose stress has relaxed at the displacement `u`.
    pub fn settled_stresses(&self, u: &[f64]) -> Vec<f64> {
        let mut settled = vec![0.0; self.n_internal()];
        let zero = settled.clone();
        self.relaxing_force(u, &zero, None, &mut settled);
        for part in self.relaxing_parts() {
            let own = settled[part.states.clone()].chunks_mut(part.slots.len());
            for (states, term) in own.zip(part.prony.terms()) {
                states.iter_mut().for_each(|rate| *rate *= term.time);
            }
        }
        settled
    }

    /// `out` ← S, what drives the internal stresses.
    ///
    /// # Shapes
    /// `out`: [`n_slots`](Self::n_slots).
    ///
    /// # Panics
    /// If a length is wrong.
    pub fn relaxing_stresses(&self, u: &[f64], out: &mut [f64]) {
        check_length(self.n_slots(), Some(out), "stresses");
        self.relax(u, Wanted::Stresses { out });
    }

    /// Each of `forces` += ∫ F T : ∇φ of its symmetric tensors T, in one pass.
    ///
    /// # Shapes
    /// Each of `tensors`: [`n_slots`](Self::n_slots).
    ///
    /// # Panics
    /// If a length is wrong.
    pub fn forces_of_tensors(&self, u: &[f64], tensors: &[Vec<f64>], forces: &mut [Vec<f64>]) {
        assert_eq!(tensors.len(), forces.len(), "a force for each");
        for (tensors, force) in tensors.iter().zip(&*forces) {
            check_length(self.n_slots(), Some(tensors), "tensors");
            check_length(self.space.n_components(), Some(force), "force");
        }
        self.relax(u, Wanted::ForceOf { tensors, forces });
    }

    /// Each of `out` ← Ṡ along its velocity of `v`, in one pass.
    ///
    /// # Shapes
    /// Each of `out`: [`n_slots`](Self::n_slots).
    ///
    /// # Panics
    /// If a length is wrong.
    pub fn relaxing_stress_rates(&self, u: &[f64], v: &[Vec<f64>], out: &mut [Vec<f64>]) {
        assert_eq!(v.len(), out.len(), "rates for each");
        for (v, out) in v.iter().zip(&*out) {
            check_length(self.n_slots(), Some(out), "stress rates");
            check_length(self.space.n_components(), Some(v), "v");
        }
        self.relax(u, Wanted::StressRates { v, out });
    }

    /// `geometric` ← ∂/∂u ∫ F H : ∇φ under constant H; for each relaxing part `material` ←
    /// ∂/∂u ∫ F S : ∇φ under constant F.
    ///
    /// # Shapes
    /// In the order of the displacement pattern; one `material` for each of
    /// [`relaxing_parts`](Self::relaxing_parts).
    ///
    /// # Panics
    /// If a length is wrong.
    pub fn relaxing_tangents(
        &self,
        u: &[f64],
        over: Overstress<'_>,
        geometric: &mut [f64],
        material: &mut [Vec<f64>],
    ) {
        match over {
            Overstress::Internal(own) => check_length(self.n_internal(), Some(own), "internal"),
            Overstress::Given(own) => check_length(self.n_slots(), Some(own), "overstress"),
        }
        let n = self.displacement_pattern.nnz();
        check_length(n, Some(geometric), "geometric");
        geometric.fill(0.0);
        for values in material.iter_mut() {
            check_length(n, Some(values), "material");
            values.fill(0.0);
        }
        self.relax(
            u,
            Wanted::Tangents {
                over,
                geometric,
                material,
            },
        );
    }

    fn relax(&self, u: &[f64], wanted: Wanted<'_>) {
        check_length(self.space.n_components(), Some(u), "u");
        let layout: &InternalStresses = &self.internal;
        with_elements!(&self.elements, mapped => narrow(self.arch, Relax {
            elements: &mapped.batches,
            maps: &mapped.maps,
            layout,
            u,
            wanted,
        }));
    }
}

/// F = I + ∇u.
fn deformation(gradient: &Tensor3) -> Tensor3 {
    let mut f = *gradient;
    (0..3).for_each(|i| f[i][i] += 1.0);
    f
}

/// S = F⁻¹ P.
fn second(gradient: &Tensor3, piola: &Tensor3) -> Tensor3 {
    let f = deformation(gradient);
    let cofactor = cofactor3(&f);
    let jacobian: f64 = f[0].iter().zip(&cofactor[0]).map(|(f, c)| f * c).sum();
    let entry = |i: usize, j: usize| (0..3).map(|k| cofactor[k][i] * piola[k][j]).sum::<f64>();
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| entry(i, j) / jacobian))
}
