//! Residual and Jacobian: one pass over the elements each, then sums of blocks.

use myovib_dae::{Problem, StepError, VariableKind};
use myovib_fem::{Fields, Tangents, Vectors};
use nalgebra_sparse::pattern::SparsityPattern;

use super::MuscleDae;
use crate::equation::{Context, PressureRateSource};
use crate::field::Field;
use crate::muscle::Muscle;
use crate::muscle::parameters::Parameters;
use crate::state::{Integrals, State};

impl MuscleDae {
    /// Fills the nodal arrays from the unknowns; constrained components follow their signals.
    pub(super) fn expand(&mut self, t: f64, y: &[f64], y_dot: Option<&[f64]>) {
        let dofs = self.muscle.solid.dofs();
        let range = |field| {
            self.layout
                .range(field)
                .expect("all formulations have q and v")
        };
        let work = &mut self.work;
        dofs.expand(&y[range(Field::Displacement)], &mut work.displacement);
        dofs.expand(&y[range(Field::Velocity)], &mut work.velocity);
        if let Some(y_dot) = y_dot {
            work.acceleration.fill(0.0);
            dofs.expand(&y_dot[range(Field::Velocity)], &mut work.acceleration);
        }
        for prescribed in &self.muscle.prescribed {
            let motion = prescribed.signal.at(t);
            work.displacement[prescribed.component] = motion.value;
            work.velocity[prescribed.component] = motion.d1;
            work.acceleration[prescribed.component] = motion.d2;
        }
    }

    /// Evaluates the state-dependent matrices; for a linear law only the first time.
    ///
    /// # Errors
    /// [`StepError::Recoverable`] for an element with det F ≤ 0.
    pub fn update_matrices(&mut self, t: f64, y: &[f64], y_dot: &[f64]) -> Result<(), StepError> {
        let Muscle {
            solid, pressures, ..
        } = &self.muscle;
        let constant = solid.is_linear() && self.factors.is_none() && self.has_matrices;
        if constant && pressures.is_empty() {
            return Ok(());
        }
        self.expand(t, y, None);
        let (pressures, u) = (&self.muscle.pressures, &self.work.displacement);
        self.matrices.update_pressures(pressures, t, 1.0, u);
        if constant {
            return Ok(());
        }
        let state = State::new(&self.layout, y, y_dot);
        let work = &self.work;
        let motion = [&work.displacement[..], &work.velocity];
        let parameters = &self.muscle.parameters;
        let factors = self.factors.as_deref();
        let fields = fields(parameters, &self.context, &state, motion, factors);
        let mut tangents: Tangents<'_> = self.matrices.wanted();
        self.counters.tangent_passes += 1;
        self.counters.rate_tangent_passes += u64::from(tangents.rate_stiffness.is_some());
        let pass = self.muscle.solid.tangents(&fields, &mut tangents);
        self.counters.passed(pass)?;
        self.has_matrices = true;
        Ok(())
    }

    /// a ∂F/∂y + b ∂F/∂ẏ from the matrices of the last update.
    fn sum_matrices(&mut self, [a, b]: [f64; 2], values: &mut [f64]) {
        self.counters.matrix_sums += 1;
        let (matrices, solid) = (&self.matrices, &self.muscle.solid);
        self.assembly.combine(
            |[of_value, of_rate]| a * of_value + b * of_rate,
            |matrix| matrices.values(solid, matrix),
            values,
        );
    }
}

/// At what the element integrals are evaluated.
fn fields<'s>(
    parameters: &Parameters,
    context: &Context,
    state: &State<'s>,
    [displacement, velocity]: [&'s [f64]; 2],
    factors: Option<&'s [f64]>,
) -> Fields<'s> {
    Fields {
        u: displacement,
        pressure: parameters.pressure(state.find(Field::Pressure)),
        v: Some(velocity),
        p_rate: match context.pressure_rate {
            PressureRateSource::None => None,
            PressureRateSource::Unknown => Some(state.value(Field::PressureRate)),
            PressureRateSource::Derivative => Some(state.rate(Field::Pressure)),
        },
        mu: state.find(Field::GglMultiplier),
        factors,
    }
}

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
        self.expand(t, y, Some(y_dot));
        let Self {
            work,
            needs,
            context,
            layout,
            muscle,
            counters,
            factors,
            ..
        } = self;
        let state = State::new(layout, y, y_dot);
        let motion = [&work.displacement[..], &work.velocity];
        let factors = factors.as_deref();
        let fields = fields(&muscle.parameters, context, &state, motion, factors);
        let mut vectors = Vectors {
            force: needs.force.then_some(&mut work.force),
            force_rate: needs.force_rate.then_some(&mut work.force_rate),
            defect: needs.defect.then_some(&mut work.defect),
            defect_rate: needs.defect_rate.then_some(&mut work.defect_rate),
            multiplier_force: needs.multiplier_force.then_some(&mut work.multiplier_force),
        };
        counters.residual_passes += 1;
        counters.force_rate_passes += u64::from(needs.force_rate);
        counters.passed(muscle.solid.evaluate(&fields, &mut vectors))?;
        work.load.fill(0.0);
        for load in &muscle.loads {
            load.add_at(t, &mut work.load);
        }
        for pressure in &muscle.pressures {
            pressure.add_at(t, 1.0, &work.displacement, &mut work.load);
        }
        let mut integrals = Integrals {
            solid: &muscle.solid,
            work,
        };
        for ((_, equation), (_, rows)) in self.formulation.rows().iter().zip(layout.blocks()) {
            equation.residual(context, &state, &mut integrals, &mut residual[rows.clone()]);
        }
        Ok(())
    }

    fn jacobian_pattern(&self) -> SparsityPattern {
        self.assembly.pattern().clone()
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
        self.update_matrices(t, y, y_dot)?;
        self.sum_matrices([a, b], values);
        Ok(())
    }

    /// One pass over the elements for both parts.
    fn jacobian_parts(
        &mut self,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
        [of_value, of_rate]: [&mut [f64]; 2],
    ) -> Result<(), StepError> {
        self.update_matrices(t, y, y_dot)?;
        self.sum_matrices([1.0, 0.0], of_value);
        self.sum_matrices([0.0, 1.0], of_rate);
        Ok(())
    }

    fn kinds(&self) -> Option<Vec<VariableKind>> {
        Some(
            self.layout
                .fill(|field| self.formulation.kind(field, &self.muscle.parameters)),
        )
    }

    fn indices(&self) -> Option<Vec<u8>> {
        Some(self.layout.fill(|field| {
            self.formulation
                .variable_index(field, &self.muscle.parameters)
        }))
    }

    fn component_name(&self, i: usize) -> String {
        let (field, k) = self.layout.locate(i);
        let solid = &self.muscle.solid;
        let space = solid.space();
        let dimension = space.dimension();
        let (node, axis) = if field.is_displacement_like() {
            let full = solid.dofs().free_to_full()[k];
            (full / dimension, ["_x", "_y", "_z"][full % dimension])
        } else {
            (space.pressure_vertices()[k], "")
        };
        let place: Vec<String> = space
            .node_point(node)
            .iter()
            .map(|x| format!("{x:.5}"))
            .collect();
        format!("{field}{axis} at ({})", place.join(", "))
    }
}
