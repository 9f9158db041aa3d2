//! Bodies whose stiffness or tension varies in space and time.

use myovib_dae::StepError;
use myovib_fem::{AddedMotion, Fields, Pressure, Vectors};

use super::MuscleDae;
use crate::muscle::Muscle;

impl MuscleDae {
    /// Sets the factors of the law's energy at the corners of each element for all further evaluations.
    ///
    /// # Panics
    /// The next evaluation panics unless `factors` contains one factor per vertex of each element.
    pub fn set_factors(&mut self, factors: &[f64]) {
        let own = self.factors.get_or_insert_default();
        own.clear();
        own.extend_from_slice(factors);
    }

    /// Adds ∫ w (P + β Ṗ) : ∇φ to the rows of the momentum balance. P excludes the stress due to the pressure, and
    /// `weights` contains the values of w at the corners of each element. The integral is ∂F/∂g for factors 1 + g w.
    ///
    /// # Errors
    /// [`StepError::Recoverable`] if an element has det F ≤ 0.
    pub fn add_factor_response(
        &mut self,
        t: f64,
        y: &[f64],
        weights: &[f64],
        rows: &mut [f64],
    ) -> Result<(), StepError> {
        self.expand(t, y, None);
        let Self { work, muscle: Muscle { solid, .. }, context, layout, counters, .. } = self;
        let no_pressure = vec![0.0; solid.space().n_pressures()];
        let fields = Fields {
            v: Some(&work.velocity),
            factors: Some(weights),
            ..Fields::new(&work.displacement, Pressure::Nodal(&no_pressure))
        };
        let damped = context.beta > 0.0;
        let mut vectors = Vectors {
            force: Some(&mut work.force),
            force_rate: damped.then_some(&mut work.force_rate),
            ..Vectors::default()
        };
        counters.passed(solid.evaluate(&fields, &mut vectors))?;
        let rows = &mut rows[layout.momentum()];
        for (row, &i) in rows.iter_mut().zip(solid.dofs().free_to_full()) {
            *row += work.force[i];
            if damped {
                *row += context.beta * work.force_rate[i];
            }
        }
        Ok(())
    }

    /// Adds λᵀ ∂F/∂g_e to `products` for each element e, where λ is `adjoint` and 1 + g_e is a factor of the law's
    /// energy in the element. One pass over the mesh is sufficient for all elements.
    ///
    /// # Errors
    /// [`StepError::Recoverable`] if an element has det F ≤ 0.
    pub(crate) fn add_factor_products(
        &mut self,
        t: f64,
        y: &[f64],
        adjoint: &[f64],
        products: &mut [f64],
    ) -> Result<(), StepError> {
        self.expand(t, y, None);
        let Self { work, muscle: Muscle { solid, .. }, context, layout, counters, .. } = self;
        // λ at all nodes.
        let along = &mut work.force;
        along.fill(0.0);
        solid.dofs().expand(&adjoint[layout.momentum()], along);
        let fields = Fields {
            v: Some(&work.velocity),
            ..Fields::new(&work.displacement, Pressure::Penalty { kappa: 0.0 })
        };
        counters.passed(solid.add_powers(&fields, context.beta, along, products))?;
        Ok(())
    }

    /// Sets the tensions (Pa) that depend on the coherence of oscillators, one per element, for all further
    /// evaluations. Values for elements without such a tension are ignored.
    ///
    /// # Panics
    /// The next evaluation panics unless `tensions` contains one value per element.
    pub(crate) fn set_tensions(&mut self, tensions: &[f64]) {
        let own = self.coherent_tensions.get_or_insert_default();
        own.clear();
        own.extend_from_slice(tensions);
    }

    /// Adds the force of the active stresses for these element `tensions` to the rows of the momentum balance. The
    /// force is linear in the tensions, so it is also the derivative of F in the direction of `tensions`.
    pub(crate) fn add_tension_response(
        &mut self,
        t: f64,
        y: &[f64],
        tensions: &[f64],
        rows: &mut [f64],
    ) {
        self.expand(t, y, None);
        let Self { work, muscle: Muscle { solid, .. }, layout, counters, .. } = self;
        counters.added_passes += 1;
        let (u, v) = (&work.displacement, &work.velocity);
        solid.active_force(&AddedMotion { u, v, tensions }, &mut work.force);
        let rows = &mut rows[layout.momentum()];
        for (row, &i) in rows.iter_mut().zip(solid.dofs().free_to_full()) {
            *row += work.force[i];
        }
    }
}
