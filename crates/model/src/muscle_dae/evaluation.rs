//! Residual and Jacobian. Each requires one pass over the elements, followed by a sum of blocks.

use std::slice::{from_mut, from_ref};
use std::time::Instant;

use myovib_dae::{Problem, StepError};
use myovib_fem::{
    AddedMotion, AddedTangents, Change, Fields, Overstress, TangentProduct, Tangents, Vectors,
};

use super::MuscleDae;
use crate::counters::WorkCounters;
use crate::driven;
use crate::equation::{Context, PressureRateSource};
use crate::field::Field;
use crate::matrix::Matrix;
use crate::muscle::Muscle;
use crate::muscle::activation::Activation;
use crate::muscle::parameters::Parameters;
use crate::state::{Integrals, State, Workspace};

impl MuscleDae {
    /// Fills the nodal arrays from the unknowns. Constrained components are evaluated from their signals.
    pub(super) fn expand(&mut self, t: f64, y: &[f64], y_dot: Option<&[f64]>) {
        let dofs = self.muscle.solid.dofs();
        let range = |field| self.layout.range(field).expect("all formulations have q and v");
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
        let unknown = &y[self.layout.range(Field::Tension).unwrap_or_default()];
        let models = self.muscle.models().zip(unknown);
        for (rate, ((_, model), &tension)) in work.tension_rates.iter_mut().zip(models) {
            *rate = model.rate(t, tension);
        }
        let coherent = self.coherent_tensions.as_deref();
        self.muscle.fill_tensions(t, unknown, coherent, &mut work.tensions);
    }

    /// Rejects negative tensions, because a muscle can only pull.
    fn expect_tensions(&self, t: f64) -> Result<(), StepError> {
        for (_, activation) in &self.muscle.activations {
            let tension = activation.at(t, 0.0);
            if matches!(activation, Activation::Given(_)) && tension < 0.0 {
                let message = format!(
                    "a tension is {tension} Pa at t = {t} s: \
                     use a nonnegative function of time"
                );
                return Err(StepError::Fatal(message.into()));
            }
        }
        Ok(())
    }

    /// Rejects negative forces on obstacles, because an obstacle can only press. Also rejects motions in which a force
    /// moves an obstacle past the body, because no displacement then balances the force.
    fn expect_contact(&self, t: f64) -> Result<(), StepError> {
        for contact in self.muscle.contacts.iter().filter(|own| own.is_driven()) {
            let (force, group) = (contact.signals()[0].at(t).value, contact.group());
            if force < 0.0 {
                let message = format!(
                    "the force on the obstacle at group `{group}` is {force} N at t = {t} s: an obstacle can only \
                     press, not pull"
                );
                return Err(StepError::Fatal(message.into()));
            }
            let distance = contact.driven_distance(t, 1.0, &self.work.displacement);
            if distance.is_some_and(f64::is_nan) {
                let message =
                    format!("the force on the obstacle at group `{group}` moves it past the body");
                return Err(StepError::Recoverable(message));
            }
        }
        Ok(())
    }

    /// Rejects systems whose internal stresses are eliminated at the quadrature points, because their full matrix is
    /// not available.
    pub(super) fn expect_whole(&self) -> Result<(), StepError> {
        match self.context.added.relaxing {
            0 => Ok(()),
            _ => Err(StepError::Fatal(
                "the full Newton matrix of a body with Prony terms is not available: use the condensed linear solver; \
                 sensitivities with an activation model are not supported"
                    .into(),
            )),
        }
    }

    /// Evaluates the matrices that depend on the state. For a linear law without factors, the element tangents are
    /// evaluated only once.
    ///
    /// # Errors
    /// [`StepError::Recoverable`] if an element has det F ≤ 0.
    pub fn update_matrices(&mut self, t: f64, y: &[f64], y_dot: &[f64]) -> Result<(), StepError> {
        let constant = self.muscle.solid.is_linear() && self.factors.is_none() && self.has_matrices;
        if constant && !self.muscle.has_boundary_forces() {
            // Linear laws have no added stress.
            return Ok(());
        }
        let started = Instant::now();
        let updated = self.update_tangents(t, y, y_dot, constant);
        self.counters.times.tangents += started.elapsed();
        updated
    }

    /// Evaluates the tangents at a state, except for those that are `constant`.
    fn update_tangents(
        &mut self,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
        constant: bool,
    ) -> Result<(), StepError> {
        self.expand(t, y, None);
        let (muscle, u) = (&self.muscle, &self.work.displacement);
        self.matrices.update_boundary_forces(muscle.boundary_forces(), (t, 1.0), u);
        let slopes = driven::slopes(muscle.solid.dofs(), &muscle.contacts, (t, 1.0), u);
        self.driven_slopes = slopes.map(|(slope, _)| slope).collect();
        if constant {
            self.update_added(t);
            return Ok(());
        }
        let state = State::new(&self.layout, y, y_dot);
        let work = &self.work;
        let motion = [&work.displacement[..], &work.velocity];
        let parameters = &self.muscle.parameters;
        let factors = self.factors.as_deref();
        let fields = fields(parameters, &self.context, &state, motion, factors);
        let mut tangents: Tangents<'_> = self.matrices.requested();
        self.counters.tangent_passes += 1;
        self.counters.rate_tangent_passes += u64::from(tangents.rate_stiffness.is_some());
        let pass = self.muscle.solid.tangents(&fields, &mut tangents);
        self.counters.passed(pass)?;
        self.matrices.derive(&self.muscle.solid);
        self.update_added(t);
        let state = State::new(&self.layout, y, y_dot);
        let internal = state.find(Field::InternalStress).map(Overstress::Internal);
        let given = self.overstress.as_deref().map(Overstress::Given);
        if let Some(over) = internal.or(given) {
            self.counters.relaxing_tangent_passes += 1;
            let u = &self.work.displacement;
            self.matrices.update_relaxing(&self.muscle.solid, u, over);
        }
        self.has_matrices = true;
        Ok(())
    }

    /// Evaluates the tangents of added stresses and friction, if any, for the motion in `work`.
    fn update_added(&mut self, t: f64) {
        let (muscle, work, added) = (&self.muscle, &self.work, self.context.added);
        let (u, v) = (&work.displacement[..], &work.velocity[..]);
        if added.stress[0] {
            self.counters.added_tangent_passes += 1;
            let tensions = &work.tensions;
            muscle
                .solid
                .added_tangents(&AddedMotion { u, v, tensions }, self.matrices.requested_added());
        }
        if added.friction
            && let AddedTangents { by_displacement: Some(by_u), by_velocity: Some(by_v) } =
                self.matrices.requested_added()
        {
            if !added.stress[0] {
                by_u.fill(0.0);
            }
            if !added.stress[1] {
                by_v.fill(0.0);
            }
            for contact in &muscle.contacts {
                contact.add_friction_slopes(t, [u, v], [&mut *by_u, &mut *by_v]);
            }
        }
        if added.stress[0] {
            self.matrices.symmetrize(Matrix::AddedSymmetricStiffness);
            self.matrices.update_tensions(muscle, t, u, v);
        }
    }

    /// Computes the residual of a muscle that differs from `other` only in terms outside the element integrals. Reuses
    /// the integrals of the last residual of `other`, which must have been evaluated at the same state.
    ///
    /// # Errors
    /// Errors of the residual if `other` lacks an integral; all integrals are then evaluated.
    pub(crate) fn residual_with_integrals_of(
        &mut self,
        other: &Self,
        (t, y, y_dot): (f64, &[f64], &[f64]),
        residual: &mut [f64],
    ) -> Result<(), StepError> {
        if other.needs != other.needs.or(self.needs) {
            return self.residual(t, y, y_dot, residual);
        }
        self.expand(t, y, Some(y_dot));
        self.work.take_integrals(&other.work);
        self.sum_rows(t, y, y_dot, residual);
        Ok(())
    }

    /// Adds `factor` times the load at (t, y) to the momentum rows of `rows`.
    pub(crate) fn add_load(&mut self, t: f64, y: &[f64], factor: f64, rows: &mut [f64]) {
        if self.muscle.has_boundary_forces() {
            self.expand(t, y, None);
        }
        self.sum_loads(t);
        let balance = self.layout.range(Field::Velocity);
        let rows = &mut rows[balance.unwrap_or_default()];
        for (row, &i) in rows.iter_mut().zip(self.muscle.solid.dofs().free_to_full()) {
            *row += factor * self.work.load[i];
        }
    }

    /// Computes the element integrals at a state.
    pub(crate) fn integrate_at(
        &mut self,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
    ) -> Result<(), StepError> {
        self.expand(t, y, Some(y_dot));
        self.expect_tensions(t)?;
        self.expect_contact(t)?;
        self.integrate(t, y, y_dot)
    }

    /// Computes the changes of the element integrals at a state that result from changes of motion and pressure.
    ///
    /// # Errors
    /// [`StepError::Recoverable`] if an element has det F ≤ 0.
    pub(crate) fn change_integrals(
        &mut self,
        (t, y, y_dot): (f64, &[f64], &[f64]),
        at: TangentProduct,
        changes: &mut [Change<'_>],
    ) -> Result<(), StepError> {
        self.expand(t, y, None);
        let state = State::new(&self.layout, y, y_dot);
        let motion = [&self.work.displacement[..], &self.work.velocity];
        let (parameters, factors) = (&self.muscle.parameters, self.factors.as_deref());
        let fields = fields(parameters, &self.context, &state, motion, factors);
        let pass = self.muscle.solid.multiply(&fields, at, changes);
        self.counters.passed(pass)
    }

    /// Adds `factor` times the most recently integrated element forces to the momentum rows of `rows`.
    pub(crate) fn add_forces(&self, factor: f64, rows: &mut [f64]) {
        let balance = self.layout.range(Field::Velocity);
        let rows = &mut rows[balance.unwrap_or_default()];
        let (force, force_rate) = (&self.work.force, &self.work.force_rate);
        let df_dyp = factor * self.context.beta;
        for (row, &i) in rows.iter_mut().zip(self.muscle.solid.dofs().free_to_full()) {
            *row += factor * force[i];
            if df_dyp != 0.0 {
                *row += df_dyp * force_rate[i];
            }
        }
    }

    /// Adds up all loads for the motion in `work`.
    fn sum_loads(&mut self, t: f64) {
        let (muscle, work) = (&self.muscle, &mut self.work);
        work.load.fill(0.0);
        for load in &muscle.loads {
            load.add_at(t, &mut work.load);
        }
        for load in muscle.boundary_forces() {
            load.add_force(t, 1.0, 1.0, &work.displacement, &mut work.load);
        }
    }

    /// Computes the element integrals for the motion in `work`.
    fn integrate(&mut self, t: f64, y: &[f64], y_dot: &[f64]) -> Result<(), StepError> {
        let Self {
            work,
            needs,
            has_fibers,
            context,
            layout,
            muscle,
            counters,
            factors,
            overstress,
            ..
        } = self;
        let state = State::new(layout, y, y_dot);
        let motion = [&work.displacement[..], &work.velocity];
        let factors = factors.as_deref();
        let fields = fields(&muscle.parameters, context, &state, motion, factors);
        let mut vectors = Vectors {
            force: needs.force.then_some(&mut work.force),
            force_rate: needs.force_rate.then_some(&mut work.force_rate),
            volume_residual: needs.volume_residual.then_some(&mut work.volume_residual),
            volume_residual_rate: needs
                .volume_residual_rate
                .then_some(&mut work.volume_residual_rate),
            multiplier_force: needs.multiplier_force.then_some(&mut work.multiplier_force),
        };
        counters.residual_passes += 1;
        counters.force_rate_passes += u64::from(needs.force_rate);
        counters.fiber_passes += u64::from(*has_fibers);
        counters.passed(muscle.solid.evaluate(&fields, &mut vectors))?;
        if !work.added_force.is_empty() {
            evaluate_added(t, muscle, context, work, counters);
        }
        if let Some(internal) = state.find(Field::InternalStress) {
            counters.relaxing_passes += 1;
            let Workspace { displacement: u, added_force, internal_rates: rates, .. } = work;
            let solid = &muscle.solid;
            solid.relaxation_force(u, internal, Some(added_force), rates);
        } else if let Some(over) = overstress {
            counters.relaxing_passes += 1;
            let (over, force) = (from_ref(over), from_mut(&mut work.added_force));
            muscle.solid.tensor_forces(&work.displacement, over, force);
        }
        Ok(())
    }

    /// Computes the residuals of all equations from the motion and the integrals in `work`.
    pub(crate) fn sum_rows(&mut self, t: f64, y: &[f64], y_dot: &[f64], residual: &mut [f64]) {
        self.sum_loads(t);
        let (muscle, work, layout) = (&self.muscle, &mut self.work, &self.layout);
        let state = State::new(layout, y, y_dot);
        let mut integrals = Integrals { solid: &muscle.solid, work };
        for ((_, equation), (_, rows)) in self.rows.iter().zip(layout.blocks()) {
            // Internal stresses, the last block, are absent if the overstress is prescribed.
            let Some(rows) = residual.get_mut(rows.clone()) else {
                break;
            };
            equation.residual(&self.context, &state, &mut integrals, rows);
        }
    }

    /// Computes a ∂F/∂y + b ∂F/∂ẏ from the most recent matrices.
    pub(super) fn sum_matrices(&mut self, [a, b]: [f64; 2], values: &mut [f64]) {
        self.counters.matrix_sums += 1;
        let (matrices, solid) = (&self.matrices, &self.muscle.solid);
        self.assembly().combine(
            |_, [df_dy, df_dyp]| a * df_dy + b * df_dyp,
            |matrix| matrices.values(solid, matrix),
            values,
        );
    }
}

/// Computes the force of added stresses, foundations and friction at time `t` for the motion and tensions in `work`.
fn evaluate_added(
    t: f64,
    muscle: &Muscle,
    context: &Context,
    work: &mut Workspace,
    counters: &mut WorkCounters,
) {
    let Workspace { displacement: u, velocity: v, tensions, added_force, .. } = work;
    if context.added.stress[0] {
        counters.added_passes += 1;
        muscle.solid.added_force(&AddedMotion { u, v, tensions }, added_force);
    } else {
        added_force.fill(0.0);
    }
    counters.bed_passes += u64::from(!muscle.foundations.is_empty());
    for foundation in &muscle.foundations {
        foundation.add_force(u, v, added_force);
    }
    for contact in &muscle.contacts {
        contact.add_friction(t, [u, v], added_force);
    }
}

/// Returns the arguments of the element integrals.
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
