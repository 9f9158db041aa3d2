//! Data of one evaluation of the equations: the unknowns of each field and the element integrals.

use std::ops::Range;

use myovib_fem::Solid;

use crate::field::{Field, Layout};
use crate::muscle::Muscle;

/// The integrator's vectors y and ẏ, accessed by field.
#[derive(Debug, Clone, Copy)]
pub struct State<'a> {
    layout: &'a Layout,
    y: &'a [f64],
    y_dot: &'a [f64],
}

impl<'a> State<'a> {
    /// Creates a view of `y` and `y_dot` through `layout`.
    pub fn new(layout: &'a Layout, y: &'a [f64], y_dot: &'a [f64]) -> Self {
        Self { layout, y, y_dot }
    }

    /// Returns the unknowns of `field`, or `None` if the formulation lacks this field or the vector is too short to
    /// contain it.
    pub fn find(&self, field: Field) -> Option<&'a [f64]> {
        self.y.get(self.layout.range(field)?)
    }

    /// Returns the unknowns of `field`.
    ///
    /// # Panics
    /// Panics if the formulation does not contain the field.
    pub fn value(&self, field: Field) -> &'a [f64] {
        &self.y[self.range(field)]
    }

    /// Returns the time derivatives of the unknowns of `field`.
    ///
    /// # Panics
    /// Panics under the same condition as [`value`](State::value).
    pub fn rate(&self, field: Field) -> &'a [f64] {
        &self.y_dot[self.range(field)]
    }

    fn range(&self, field: Field) -> Range<usize> {
        let range = self.layout.range(field);
        range.expect("an equation only uses fields of its formulation")
    }
}

/// Arrays of one evaluation, allocated once. Displacement-like arrays cover all nodes, including
/// constrained ones.
#[derive(Debug, Clone)]
pub(crate) struct Workspace {
    pub(crate) displacement: Vec<f64>,
    pub(crate) velocity: Vec<f64>,
    /// v̇; overwritten by [`momentum_balance`](Integrals::momentum_balance).
    pub(crate) acceleration: Vec<f64>,
    pub(crate) inertia: Vec<f64>,
    /// A vector of free components expanded to all nodes.
    pub(crate) expanded: Vec<f64>,
    pub(crate) force: Vec<f64>,
    pub(crate) force_rate: Vec<f64>,
    pub(crate) multiplier_force: Vec<f64>,
    pub(crate) load: Vec<f64>,
    /// Force of added stresses, viscoelastic overstress, elastic foundations and friction; empty if the
    /// body has none of them.
    pub(crate) added_force: Vec<f64>,
    /// Tension T of each element; empty without added stresses.
    pub(crate) tensions: Vec<f64>,
    /// Ṫ of each activation model.
    pub(crate) tension_rates: Vec<f64>,
    /// Q̇ from the evolution equations of the Prony terms.
    pub(crate) internal_rates: Vec<f64>,
    pub(crate) volume_residual: Vec<f64>,
    pub(crate) volume_residual_rate: Vec<f64>,
    pub(crate) pressure_product: Vec<f64>,
}

impl Workspace {
    pub(crate) fn new(muscle: &Muscle) -> Self {
        let solid = &muscle.solid;
        let has_stress = !solid.added_stresses().is_empty() || solid.n_internal() > 0;
        let has_added = has_stress || !muscle.foundations.is_empty() || muscle.has_friction();
        let nodal = vec![0.0; solid.space().n_components()];
        let vertex = vec![0.0; solid.space().n_pressures()];
        Self {
            displacement: nodal.clone(),
            velocity: nodal.clone(),
            acceleration: nodal.clone(),
            inertia: nodal.clone(),
            expanded: nodal.clone(),
            force: nodal.clone(),
            force_rate: nodal.clone(),
            multiplier_force: nodal.clone(),
            added_force: if has_added { nodal.clone() } else { Vec::new() },
            load: nodal,
            tensions: vec![0.0; solid.n_tensions()],
            tension_rates: vec![0.0; muscle.models().count()],
            internal_rates: vec![0.0; solid.n_internal()],
            volume_residual: vertex.clone(),
            volume_residual_rate: vertex.clone(),
            pressure_product: vertex,
        }
    }

    /// Copies the integrals over elements and foundations from `other`.
    pub(crate) fn take_integrals(&mut self, other: &Self) {
        for (own, of_other) in [
            (&mut self.force, &other.force),
            (&mut self.force_rate, &other.force_rate),
            (&mut self.multiplier_force, &other.multiplier_force),
            (&mut self.added_force, &other.added_force),
            (&mut self.internal_rates, &other.internal_rates),
            (&mut self.volume_residual, &other.volume_residual),
            (&mut self.volume_residual_rate, &other.volume_residual_rate),
        ] {
            own.copy_from_slice(of_other);
        }
    }
}

/// Element integrals of one evaluation and products with constant matrices.
pub(crate) struct Integrals<'a> {
    pub(crate) solid: &'a Solid,
    pub(crate) work: &'a mut Workspace,
}

impl Integrals<'_> {
    /// Returns ∫ψ g(J).
    pub(crate) fn volume_residual(&self) -> &[f64] {
        &self.work.volume_residual
    }

    /// Returns ∫ψ g' cof F:∇v.
    pub(crate) fn volume_residual_rate(&self) -> &[f64] {
        &self.work.volume_residual_rate
    }

    /// Adds `factor M_p pressure` to `rows`.
    pub(crate) fn add_pressure_mass(&mut self, factor: f64, pressure: &[f64], rows: &mut [f64]) {
        let product = &mut self.work.pressure_product;
        self.solid.apply_compliance(pressure, product);
        for (row, m_p) in rows.iter_mut().zip(product.iter()) {
            *row += factor * m_p;
        }
    }

    /// Multiplies `rows`, which are the free components of a vector, by M.
    pub(crate) fn apply_free_mass(&mut self, rows: &mut [f64]) {
        let Workspace { expanded, inertia: product, .. } = &mut *self.work;
        self.solid.dofs().expand(rows, expanded);
        self.solid.apply_mass(expanded, product);
        self.solid.dofs().restrict(product, rows);
    }

    /// Adds B(q)ᵀ μ to `rows`.
    pub(crate) fn add_multiplier_force(&self, rows: &mut [f64]) {
        for (row, &full) in rows.iter_mut().zip(self.solid.dofs().free_to_full()) {
            *row += self.work.multiplier_force[full];
        }
    }

    /// Returns Ṫ of the activation models.
    pub(crate) fn tension_rates(&self) -> &[f64] {
        &self.work.tension_rates
    }

    /// Returns Q̇ of the Prony terms.
    pub(crate) fn internal_rates(&self) -> &[f64] {
        &self.work.internal_rates
    }

    /// Sets `rows` to M v̇ + α M v + force + β force rate + added force - load.
    pub(crate) fn momentum_balance(&mut self, alpha: f64, beta: f64, rows: &mut [f64]) {
        let Workspace {
            velocity, acceleration, inertia, force, force_rate, added_force, load, ..
        } = &mut *self.work;
        let graded = self.solid.has_element_scales();
        if alpha > 0.0 && !graded {
            for (a, v) in acceleration.iter_mut().zip(velocity.iter()) {
                *a += alpha * v;
            }
        }
        self.solid.apply_mass(acceleration, inertia);
        if alpha > 0.0 && graded {
            let damping = acceleration;
            self.solid.apply_damping_mass(velocity, damping);
            for (inertia, damping) in inertia.iter_mut().zip(damping) {
                *inertia += alpha * *damping;
            }
        }
        for (row, &i) in rows.iter_mut().zip(self.solid.dofs().free_to_full()) {
            *row = inertia[i] + force[i] - load[i];
        }
        if beta > 0.0 {
            for (row, &i) in rows.iter_mut().zip(self.solid.dofs().free_to_full()) {
                *row += beta * force_rate[i];
            }
        }
        if !added_force.is_empty() {
            for (row, &i) in rows.iter_mut().zip(self.solid.dofs().free_to_full()) {
                *row += added_force[i];
            }
        }
    }
}
