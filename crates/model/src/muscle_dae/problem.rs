//! Interface of the muscle to the integrators: residual and Jacobian, and the kinds, indices and names of the unknowns.

use std::time::Instant;

use myovib_dae::{Problem, StepError, VariableKind};
use nalgebra_sparse::pattern::SparsityPattern;

use super::MuscleDae;
use crate::field::Field;

impl Problem for MuscleDae {
    fn n_unknowns(&self) -> usize {
        self.layout.n_unknowns()
    }

    fn residual(
        &mut self,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
        residual: &mut [f64],
    ) -> Result<(), StepError> {
        let started = Instant::now();
        let integrated = self.integrate_at(t, y, y_dot);
        if integrated.is_ok() {
            self.sum_rows(t, y, y_dot, residual);
        }
        self.counters.times.residuals += started.elapsed();
        integrated
    }

    fn jacobian_pattern(&self) -> SparsityPattern {
        self.assembly().pattern().clone()
    }

    fn jacobian(
        &mut self,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
        a: f64,
        b: f64,
        values: &mut [f64],
    ) -> Result<(), StepError> {
        self.expect_whole()?;
        self.update_matrices(t, y, y_dot)?;
        self.sum_matrices([a, b], values);
        Ok(())
    }

    /// Computes ∂F/∂y and ∂F/∂ẏ in one element pass.
    fn jacobian_parts(
        &mut self,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
        [df_dy, df_dyp]: [&mut [f64]; 2],
    ) -> Result<(), StepError> {
        self.expect_whole()?;
        self.update_matrices(t, y, y_dot)?;
        self.sum_matrices([1.0, 0.0], df_dy);
        self.sum_matrices([0.0, 1.0], df_dyp);
        Ok(())
    }

    fn kinds(&self) -> Option<Vec<VariableKind>> {
        let has_inertia = self.muscle.solid.has_inertia();
        Some(self.layout.fill(|field| match field {
            // The derivative of the displacement is used only to define the velocity.
            Field::Displacement | Field::Velocity if !has_inertia => VariableKind::Algebraic,
            _ => self.formulation.kind(field, &self.muscle.parameters),
        }))
    }

    fn indices(&self) -> Option<Vec<u8>> {
        let (muscle, formulation) = (&self.muscle, self.formulation);
        Some(self.layout.fill(|field| muscle.variable_index(formulation, field)))
    }

    fn component_name(&self, i: usize) -> String {
        let (field, k) = self.layout.locate(i);
        if field == Field::InternalStress {
            return format!("internal stress {k}");
        }
        if field == Field::Tension {
            return match self.muscle.models().count() {
                1 => "the tension".to_owned(),
                n => format!("tension {} of {n}", k + 1),
            };
        }
        let solid = &self.muscle.solid;
        let space = solid.space();
        let dimension = space.dimension();
        let (node, axis) = if field.is_displacement_like() {
            let full = solid.dofs().free_to_full()[k];
            (full / dimension, ["_x", "_y", "_z"][full % dimension])
        } else {
            (space.pressure_vertices()[k], "")
        };
        let place: Vec<String> = space.node_point(node).iter().map(|x| format!("{x:.5}")).collect();
        format!("{field}{axis} at ({})", place.join(", "))
    }
}
