//! Element passes that evaluate vectors, tangents, products, strain energy and power for given fields.

use crate::operators::energy::StrainEnergy;
use crate::operators::fields::{
    Change, Fields, Inverted, Pressure, TangentProduct, Tangents, Vectors,
};
use crate::operators::pass::ElementPass;
use crate::operators::power::Powers;
use crate::operators::product::Multiply;
use crate::operators::residual::Evaluate;
use crate::operators::tangent::Linearize;
use crate::solid::assembler::Pass;

use super::{Elements, Solid, VectorPasses, threads, with_elements};

impl Solid {
    /// Evaluates the requested vectors in one pass over the elements.
    ///
    /// # Errors
    /// Returns [`Inverted`] if det F ≤ 0 or NaN at a quadrature point. In this case, the vectors are invalid.
    ///
    /// # Panics
    /// Panics if a length is wrong, or if a rate is requested without `v`.
    pub fn evaluate(&self, fields: &Fields<'_>, out: &mut Vectors<'_>) -> Result<(), Inverted> {
        self.check_fields(fields);
        let (n, m) = (self.space.n_components(), self.space.n_pressures());
        check_length(n, out.force.as_deref(), "force");
        check_length(n, out.force_rate.as_deref(), "force_rate");
        check_length(n, out.multiplier_force.as_deref(), "multiplier_force");
        check_length(m, out.volume_residual.as_deref(), "volume_residual");
        check_length(m, out.volume_residual_rate.as_deref(), "volume_residual_rate");
        let rates = out.force_rate.is_some() || out.volume_residual_rate.is_some();
        assert!(fields.v.is_some() || !rates, "rates need a velocity");
        self.begin(&Pass::Vectors(*fields, out.requested()));
        let mut product = Vec::new();
        let fields = &self.with_own_factors(fields, &mut product);
        let local = with_elements!(self.local_elements(), mapped => mapped.pass(
            self.threads.as_ref(),
            threads::VECTORS,
            out.slots(),
            |elements, _, slots| mapped.evaluate(self.arch, ElementPass {
                elements,
                kernel: Evaluate { fields, out: Vectors::from(slots) },
            }),
        ));
        self.end(out.all_mut(), local)
    }

    /// Evaluates the requested tangents in one pass over the elements.
    ///
    /// # Errors
    /// Returns [`Inverted`] if det F ≤ 0 or NaN at a quadrature point. In this case, the values are invalid.
    ///
    /// # Panics
    /// Panics if a length is wrong, or if a rate is requested without `v`.
    pub fn tangents(&self, fields: &Fields<'_>, out: &mut Tangents<'_>) -> Result<(), Inverted> {
        self.check_fields(fields);
        let (n, m) = (self.displacement_pattern.nnz(), self.divergence_pattern.nnz());
        check_length(n, out.stiffness.as_deref(), "stiffness");
        check_length(n, out.rate_stiffness.as_deref(), "rate_stiffness");
        check_length(n, out.multiplier_stiffness.as_deref(), "multiplier_stiffness");
        check_length(m, out.divergence.as_deref(), "divergence");
        check_length(m, out.divergence_rate.as_deref(), "divergence_rate");
        let rates = out.rate_stiffness.is_some() || out.divergence_rate.is_some();
        assert!(fields.v.is_some() || !rates, "rates need a velocity");
        self.begin(&Pass::Tangents(*fields, out.requested()));
        let mut product = Vec::new();
        let fields = &self.with_own_factors(fields, &mut product);
        let local = with_elements!(self.local_elements(), mapped => mapped.pass(
            self.threads.as_ref(),
            threads::TANGENTS,
            out.slots(),
            |elements, maps, slots| mapped.run(self.arch, ElementPass {
                elements,
                kernel: Linearize { maps, fields, out: Tangents::from(slots) },
            }),
        ));
        self.end(out.all_mut(), local)
    }

    /// Computes products of the tangents with several directions in one pass over the elements, without forming
    /// matrices.
    ///
    /// # Errors
    /// Returns [`Inverted`] if det F ≤ 0 or NaN at a quadrature point. In this case, the products are invalid.
    ///
    /// # Panics
    /// Panics if a length is wrong, or if a rate is requested without `v`.
    pub fn multiply(
        &self,
        fields: &Fields<'_>,
        at: TangentProduct,
        changes: &mut [Change<'_>],
    ) -> Result<(), Inverted> {
        self.check_fields(fields);
        let (n, m) = (self.space.n_components(), self.space.n_pressures());
        for change in changes.iter() {
            check_length(n, Some(change.u), "u of a direction");
            check_length(n, change.v, "v of a direction");
            check_length(m, change.p, "p of a direction");
            check_length(m, change.p_rate, "p_rate of a direction");
            check_length(n, Some(&*change.force), "change of force");
            check_length(m, change.volume_residual.as_deref(), "change of volume_residual");
        }
        assert!(fields.v.is_some() || !at.has_rates(), "rates need a velocity");
        let mut product = Vec::new();
        let fields = &self.with_own_factors(fields, &mut product);
        with_elements!(&self.elements, mapped => mapped.run(self.arch, ElementPass {
            elements: mapped.batches.all(),
            kernel: Multiply { fields, at, changes },
        }))
    }

    /// Returns the potential of the force, which is ∫ W(F) − p g(J) with a pressure field, and ∫ W(F) + κ/2 g(J)²
    /// otherwise.
    ///
    /// If the pressure satisfies the constraint, the stored energy is this value minus pᵀ M_p p / (2κ). Paper,
    /// eqs. (16) and (20).
    ///
    /// # Units
    /// The result is in J, or in J/m in plane strain.
    pub fn strain_energy(&self, fields: &Fields<'_>) -> f64 {
        self.check_fields(fields);
        let mut product = Vec::new();
        let fields = &self.with_own_factors(fields, &mut product);
        with_elements!(&self.elements, mapped => mapped.run(self.arch, StrainEnergy {
            elements: &mapped.batches,
            fields,
        }))
    }

    /// Adds the power ∫ (P + β Ṗ) : ∇w of the stresses of each element along the field w (`direction`) to `out`.
    /// The power excludes the terms of the pressure or the penalty.
    ///
    /// # Shapes
    /// `direction` has the length of the displacement, and `out` has one entry per element.
    ///
    /// # Errors
    /// Returns [`Inverted`] if det F ≤ 0 or NaN at a quadrature point. In this case, `out` is invalid.
    ///
    /// # Panics
    /// Panics if a length is wrong, or if `beta` > 0 without `v`.
    pub fn add_powers(
        &self,
        fields: &Fields<'_>,
        beta: f64,
        direction: &[f64],
        out: &mut [f64],
    ) -> Result<(), Inverted> {
        self.check_fields(fields);
        check_length(self.space.n_components(), Some(direction), "direction");
        check_length(self.space.n_elements(), Some(&*out), "powers");
        assert!(fields.v.is_some() || beta == 0.0, "rates need a velocity");
        let mut product = Vec::new();
        let fields = &self.with_own_factors(fields, &mut product);
        with_elements!(&self.elements, mapped => mapped.run(self.arch, Powers {
            elements: &mapped.batches,
            fields,
            beta,
            direction,
            out,
        }))
    }

    /// Returns the fields with the factors of the solid included. If both the fields and the solid have factors,
    /// the product of these factors is stored in `product`.
    pub(crate) fn with_own_factors<'f>(
        &'f self,
        fields: &Fields<'f>,
        product: &'f mut Vec<f64>,
    ) -> Fields<'f> {
        let factors = match (fields.factors, &self.factors) {
            (given, None) => given,
            (None, Some(own)) => Some(&own[..]),
            (Some(given), Some(own)) => {
                product.extend(given.iter().zip(own).map(|(given, own)| given * own));
                Some(&product[..])
            }
        };
        Fields { factors, ..*fields }
    }

    fn check_fields(&self, fields: &Fields<'_>) {
        let (n, m) = (self.space.n_components(), self.space.n_pressures());
        check_length(n, Some(fields.u), "u");
        check_length(n, fields.v, "v");
        check_length(m, fields.p_rate, "p_rate");
        check_length(m, fields.mu, "mu");
        if let Some(factors) = fields.factors {
            let n_vertices = self.space.mesh().shape().n_vertices();
            check_length(n_vertices * self.space.n_elements(), Some(factors), "factors");
        }
        if let Pressure::Nodal(p) = fields.pressure {
            check_length(m, Some(p), "p");
        }
    }
}

pub(super) fn check_length(n: usize, slice: Option<&[f64]>, name: &str) {
    if let Some(slice) = slice {
        assert_eq!(slice.len(), n, "length of {name}");
    }
}
