//! Residual of an equilibrium and its derivative.

use myovib_fem::{AddedMotion, Fields, Inverted, Vectors};
use myovib_sparse::SparseError;

use super::Newton;
use crate::driven;
use crate::field::Field;
use crate::muscle::load::{BoundaryForce, boundary_forces};

impl Newton<'_> {
    /// Sets all components of the displacement: the free components to `q`, and the other components to `factor` times
    /// their prescribed values.
    pub(super) fn deform(&mut self, q: &[f64], factor: f64) {
        for &(component, value) in &self.prescribed {
            self.displacement[component] = factor * value;
        }
        self.muscle.solid.dofs().expand(q, &mut self.displacement);
    }

    /// Sets all components of the displacement under `factor` times the load.
    pub(super) fn place(&mut self, q: &[f64], factor: f64) {
        self.deform(q, factor);
        for (component, signal) in &self.turned {
            self.displacement[*component] = signal.scaled(factor).at(self.t).value;
        }
        for &(component, distance) in &self.distances {
            self.displacement[component] += self.distant * distance;
        }
    }

    /// Computes the residual at `x` under `factor` times the load.
    pub(in crate::statics) fn residual(
        &mut self,
        x: &[f64],
        factor: f64,
        r: &mut [f64],
    ) -> Result<(), Inverted> {
        self.residual_under(x, factor, None, r)
    }

    /// Computes the residual. If `driven` is given, it scales the forces on obstacles, and contacts with obstacles that
    /// have a prescribed motion are omitted.
    pub(super) fn residual_under(
        &mut self,
        x: &[f64],
        factor: f64,
        driven: Option<f64>,
        r: &mut [f64],
    ) -> Result<(), Inverted> {
        self.place(&x[..self.muscle.solid.dofs().n_free()], factor);
        let Self {
            muscle,
            layout,
            displacement,
            velocity,
            added,
            force,
            load,
            tensions,
            contacts,
            t,
            ..
        } = self;
        let solid = &muscle.solid;
        let n_free = solid.dofs().n_free();
        debug_assert_eq!(layout.n_unknowns(), x.len());
        let pressure = layout.range(Field::Pressure).map(|range| &x[range]);
        let (momentum, constraint) = r.split_at_mut(n_free);
        let fields = Fields::new(displacement, muscle.parameters.pressure(pressure));
        let mut vectors = Vectors {
            force: Some(force),
            volume_residual: pressure.is_some().then_some(&mut *constraint),
            ..Vectors::default()
        };
        solid.evaluate(&fields, &mut vectors).inspect_err(|at| {
            self.inverted = Some(*at);
        })?;
        for load in &muscle.surface_loads {
            load.add_force(*t, factor, -1.0, displacement, force);
        }
        for contact in contacts.iter().filter(|own| driven.is_none() || own.is_driven()) {
            contact.add_force(*t, driven.unwrap_or(factor), -1.0, displacement, force);
        }
        for foundation in &muscle.foundations {
            foundation.add_force(displacement, velocity, force);
        }
        if !tensions.is_empty() {
            let motion =
                AddedMotion { u: displacement, v: velocity, tensions: &scaled(tensions, factor) };
            solid.added_force(&motion, added);
            for (force, added) in force.iter_mut().zip(added) {
                *force += *added;
            }
        }
        for (row, &i) in momentum.iter_mut().zip(solid.dofs().free_to_full()) {
            *row = force[i] - factor * load[i];
        }
        if let Some(pressure) = pressure {
            let mut product = vec![0.0; pressure.len()];
            solid.apply_compliance(pressure, &mut product);
            for (row, m_p) in constraint.iter_mut().zip(&product) {
                *row += muscle.parameters.inv_kappa * m_p;
            }
        }
        Ok(())
    }

    /// Assembles the matrix of the linear system at `x`.
    pub(in crate::statics) fn tangent(&mut self, x: &[f64], factor: f64) -> Result<(), Inverted> {
        let muscle = self.muscle;
        let solid = &muscle.solid;
        self.place(&x[..solid.dofs().n_free()], factor);
        let pressure = self.layout.range(Field::Pressure).map(|range| &x[range]);
        let pressure = self.muscle.parameters.pressure(pressure);
        let fields = Fields::new(&self.displacement, pressure);
        solid.tangents(&fields, &mut self.matrices.requested())?;
        let (u, of_contacts) = (&self.displacement, self.contact_factor(factor));
        let forces = boundary_forces(&muscle.surface_loads, &self.contacts);
        self.matrices.update_boundary_forces(forces, (self.t, of_contacts), u);
        let slopes = driven::slopes(solid.dofs(), &self.contacts, (self.t, of_contacts), u);
        self.slopes = slopes.map(|(slope, _)| slope).collect();
        if !self.tensions.is_empty() {
            let motion =
                AddedMotion { u, v: &self.velocity, tensions: &scaled(&self.tensions, factor) };
            solid.added_tangents(&motion, self.matrices.requested_added());
        }
        let matrices = &self.matrices;
        self.assembly.combine(
            |_, df_dy| *df_dy,
            |matrix| matrices.values(solid, matrix),
            self.system.values_mut(),
        );
        Ok(())
    }

    /// Factorizes the matrix of the last [`tangent`](Self::tangent).
    pub(in crate::statics) fn factorize(&mut self) -> Result<(), SparseError> {
        self.system.renew(&mut self.work)?;
        let (n, rows) = (self.layout.n_unknowns(), 0..self.n_free());
        let Self { system, work, slopes, driven, .. } = self;
        driven.factorize(slopes, (n, rows.clone(), rows), |x| system.solve(x, work))
    }

    /// Solves a linear system with the factors of the last [`factorize`](Self::factorize). Obstacles follow their
    /// forces.
    pub(in crate::statics) fn solve_linear(&mut self, b: &mut [f64]) -> Result<(), SparseError> {
        self.system.solve(b, &mut self.work)?;
        self.driven.correct(b, 1);
        Ok(())
    }
}

fn scaled(tensions: &[f64], factor: f64) -> Vec<f64> {
    tensions.iter().map(|tension| factor * tension).collect()
}
