//! Index of a body's equations in a formulation.

use crate::equation::Added;
use crate::field::Field;
use crate::formulation::Formulation;
use crate::muscle::Muscle;

impl Muscle {
    /// Returns the differentiation index of the body in a formulation.
    pub fn index(&self, formulation: Formulation) -> u8 {
        let fields = formulation.rows().iter().map(|(field, _)| *field);
        let indices = fields.map(|field| self.variable_index(formulation, field));
        indices.max().unwrap_or(0)
    }

    /// Returns the perturbation index of one block of unknowns.
    ///
    /// Without inertia, the displacement and the pressure are determined by the equilibrium of forces and have
    /// index 1. The velocity is a derivative of the displacement and has index 2. With viscous forces or friction, the
    /// pressure of an incompressible body has index 2.
    pub fn variable_index(&self, formulation: Formulation, field: Field) -> u8 {
        let parameters = &self.parameters;
        let is_damped = || Added::of(self).is_damped() || self.has_friction();
        let is_viscous = || is_damped() && parameters.is_incompressible();
        match field {
            _ if self.solid.has_inertia() => formulation.variable_index(field, parameters),
            Field::Displacement => 1,
            Field::Velocity => 2,
            Field::Pressure if is_viscous() => 2,
            Field::Pressure => 1,
            _ => formulation.variable_index(field, parameters),
        }
    }
}
