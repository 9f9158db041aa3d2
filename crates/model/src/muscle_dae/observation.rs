//! Quantities derived from a state of the muscle, outside the time integration.

use myovib_dae::{Problem, StepError};
use myovib_fem::output::StressContext;
use myovib_fem::{AddedMotion, Fields, Inverted, Pressure, Vectors};

use super::MuscleDae;
use crate::equation::PressureRateSource;
use crate::field::Field;
use crate::muscle::Muscle;
use crate::reading::displacement::Displacement;
use crate::reading::energy::Powers;
use crate::reading::probe::{Probe, ProbeValue};
use crate::reading::quantity::Quantity;
use crate::reading::snapshot::Snapshot;
use crate::state::Workspace;

impl MuscleDae {
    /// Returns the displacement and velocity of all nodes at time `t`, including prescribed components.
    pub fn nodal_motion(&mut self, t: f64, y: &[f64]) -> (&[f64], &[f64]) {
        self.expand(t, y, None);
        (&self.work.displacement, &self.work.velocity)
    }

    /// Returns whether the stress depends on ẏ. This is the case if the damping stress requires the pressure rate and
    /// the formulation takes this rate from the integrator.
    pub fn stress_needs_rates(&self) -> bool {
        self.context.beta > 0.0 && self.context.pressure_rate == PressureRateSource::Derivative
    }

    /// Returns a snapshot of the body at time `t` for measurements. `y_dot` may be empty if the body is at rest. It may
    /// also be empty if neither accelerations nor stresses that [depend on ẏ](Self::stress_needs_rates) are measured.
    pub fn snapshot<'a>(&'a mut self, t: f64, y: &'a [f64], y_dot: &'a [f64]) -> Snapshot<'a> {
        if y_dot.is_empty() {
            self.expand(t, y, None);
            self.work.acceleration.fill(0.0);
        } else {
            self.expand(t, y, Some(y_dot));
        }
        let pressure = self.muscle.parameters.pressure(self.pressure(y));
        let p_rate = match self.context.pressure_rate {
            PressureRateSource::None => None,
            PressureRateSource::Unknown => self.range_in(Field::PressureRate, y),
            PressureRateSource::Derivative => self.range_in(Field::Pressure, y_dot),
        };
        let internal = self.range_in(Field::InternalStress, y);
        Snapshot {
            solid: &self.muscle.solid,
            displacement: &self.work.displacement,
            velocity: &self.work.velocity,
            acceleration: &self.work.acceleration,
            pressure,
            factors: self.factors.as_deref(),
            p_rate,
            stress_context: StressContext {
                tensions: &self.work.tensions,
                beta: self.context.beta,
                internal: internal.unwrap_or_default(),
            },
        }
    }

    /// Returns the part of `values` that belongs to `field`, if there is one.
    fn range_in<'v>(&self, field: Field, values: &'v [f64]) -> Option<&'v [f64]> {
        values.get(self.layout.range(field)?)
    }

    /// Computes the unbalanced force at all nodal components: inertia, stress and damping minus the loads. At free
    /// components, the force is zero. At fixed or prescribed components, it is the force of the support on the body (N;
    /// N/m in 2D).
    pub fn unbalanced_force(
        &mut self,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
    ) -> Result<Vec<f64>, StepError> {
        let mut rows = vec![0.0; self.n_unknowns()];
        self.residual(t, y, y_dot, &mut rows)?;
        let Workspace { inertia, force, force_rate, added_force, load, .. } = &self.work;
        let beta = self.context.beta;
        let added = |i: usize| added_force.get(i).copied().unwrap_or(0.0);
        let balance = |i: usize| inertia[i] + force[i] + added(i) - load[i];
        Ok(if self.needs.force_rate {
            (0..force.len()).map(|i| balance(i) + beta * force_rate[i]).collect()
        } else {
            (0..force.len()).map(balance).collect()
        })
    }

    /// Returns the loads and ∫Ṗ:∇φ (zero without damping) at all nodal components from the last evaluation of the
    /// residual.
    pub(crate) fn nodal_forces(&self) -> (&[f64], &[f64]) {
        (&self.work.load, &self.work.force_rate)
    }

    /// Returns the velocity at all nodal components from the last evaluation of the residual.
    pub(crate) fn nodal_velocity(&self) -> &[f64] {
        &self.work.velocity
    }

    /// Returns the energy of foundations and contacts for the most recent state, which must be at time `t`.
    pub(crate) fn boundary_energy(&self, t: f64) -> f64 {
        let Workspace { displacement: u, velocity: v, .. } = &self.work;
        let Muscle { foundations, contacts, .. } = &self.muscle;
        let contacts = contacts.iter().map(|contact| contact.stored_energy(t, u, v)[0]);
        let foundations = foundations.iter().map(|foundation| foundation.energy(u));
        contacts.chain(foundations).sum()
    }

    /// Returns the power of contacts (as power of the loads), the dissipation by foundations, friction, viscous
    /// stresses and viscoelastic stresses, and the power of active stresses. Other entries are zero. The last residual
    /// must have been evaluated at time `t` and state `y`.
    pub(crate) fn added_powers(&self, t: f64, y: &[f64]) -> Powers {
        let Workspace { displacement: u, velocity: v, tensions, .. } = &self.work;
        let Muscle { solid, foundations, contacts, .. } = &self.muscle;
        let mut powers = Powers::default();
        for contact in contacts {
            let [_, rate] = contact.stored_energy(t, u, v);
            let [dissipation, obstacle] = contact.friction_powers(t, [u, v]);
            powers.dissipation += dissipation;
            powers.load += rate + obstacle;
        }
        for foundation in foundations {
            powers.dissipation += foundation.dissipation(v);
        }
        if let Some(internal) = self.layout.range(Field::InternalStress) {
            let (mut force, mut rates) = (vec![0.0; u.len()], vec![0.0; internal.len()]);
            solid.relaxation_force(u, &y[internal], Some(&mut force), &mut rates);
            powers.dissipation += force.iter().zip(v).map(|(f, v)| f * v).sum::<f64>();
        }
        if self.context.added.stress[0] {
            let mut force = vec![0.0; u.len()];
            let mut power = |tensions: &[f64]| {
                solid.added_force(&AddedMotion { u, v, tensions }, &mut force);
                force.iter().zip(v).map(|(f, v)| f * v).sum::<f64>()
            };
            let viscous = power(&vec![0.0; tensions.len()]);
            powers.dissipation += viscous;
            if tensions.iter().any(|tension| *tension != 0.0) {
                powers.active = viscous - power(tensions);
            }
        }
        powers
    }

    /// Returns the pressure coefficients in `y`, if the formulation has a pressure.
    pub fn pressure<'y>(&self, y: &'y [f64]) -> Option<&'y [f64]> {
        self.layout.range(Field::Pressure).map(|range| &y[range])
    }

    /// Returns the displacement u and the pressure p at a probe.
    pub fn read(&mut self, probe: &Probe, t: f64, y: &[f64]) -> ProbeValue {
        let pressure = self.pressure(y);
        let (displacement, _) = self.nodal_motion(t, y);
        probe.read(displacement, pressure)
    }

    /// Returns the displacement at a probe in the direction `axis` (0: x, 1: y, 2: z), including
    /// prescribed components.
    pub fn displacement_at(&self, probe: &Probe, axis: usize) -> Displacement {
        let mut direction = [0.0; 3];
        direction[axis] = 1.0;
        self.displacement_along(probe, direction)
    }

    /// Returns the displacement d·u at a probe along the vector d = `direction`, including prescribed components.
    /// Components of d beyond the dimension of the body are ignored.
    pub fn displacement_along(&self, probe: &Probe, direction: [f64; 3]) -> Displacement {
        let start = self.layout.range(Field::Displacement).expect("all formulations have q").start;
        let dimension = self.muscle.solid.space().dimension();
        let mut displacement = Displacement::default();
        for &(node, weight) in probe.node_weights() {
            let along = direction[..dimension].iter().enumerate();
            for (axis, part) in along.filter(|(_, part)| **part != 0.0) {
                let (component, weight) = (dimension * node + axis, part * weight);
                if let Some(unknown) = self.unknown_of(component, start) {
                    displacement.unknowns.push((unknown, weight));
                    continue;
                }
                let at_node = self.muscle.prescribed.iter();
                displacement.prescribed.extend(
                    at_node
                        .filter(|prescribed| prescribed.component == component)
                        .map(|prescribed| (prescribed.signal.clone(), weight)),
                );
            }
        }
        displacement
    }

    /// Selects the unknowns among nodal `components` of the displacement or velocity. Returns the index of each unknown
    /// with its weight; empty for other quantities.
    pub fn unknowns_among(
        &self,
        quantity: Quantity,
        components: &[(usize, f64)],
    ) -> Vec<(usize, f64)> {
        let block = match quantity {
            Quantity::Displacement => self.layout.range(Field::Displacement),
            Quantity::Velocity => self.layout.range(Field::Velocity),
            _ => None,
        };
        let Some(block) = block else {
            return Vec::new();
        };
        let unknown = |&(component, weight): &(usize, f64)| {
            let number = self.unknown_of(component, block.start)?;
            Some((number, weight))
        };
        components.iter().filter_map(unknown).collect()
    }

    /// Returns the index of the unknown for a nodal component, in the block of a field that starts at `start`; `None`
    /// if the component is not free.
    fn unknown_of(&self, component: usize, start: usize) -> Option<usize> {
        let free = self.muscle.solid.dofs().free_to_full();
        let place = free.binary_search(&component).ok()?;
        Some(start + place)
    }

    /// Returns the constraint drift: the maximum of |∫ψ_k (p/κ + g(J))| / ∫ψ_k over the P1 functions ψ_k. The drift is
    /// 0 for a formulation without pressure.
    ///
    /// # Errors
    /// [`Inverted`] if an element has det F ≤ 0.
    pub fn constraint_drift(&mut self, t: f64, y: &[f64]) -> Result<f64, Inverted> {
        let Some(range) = self.layout.range(Field::Pressure) else {
            return Ok(0.0);
        };
        self.expand(t, y, None);
        let solid = &self.muscle.solid;
        let work = &mut self.work;
        let fields = Fields::new(&work.displacement, Pressure::Nodal(&y[range.clone()]));
        solid.evaluate(
            &fields,
            &mut Vectors { volume_residual: Some(&mut work.volume_residual), ..Vectors::default() },
        )?;
        solid.apply_compliance(&y[range], &mut work.pressure_product);
        let inv_kappa = self.context.inv_kappa;
        Ok(work
            .volume_residual
            .iter()
            .zip(&work.pressure_product)
            .zip(solid.pressure_weights())
            .map(|((volume_residual, m_p), weight)| {
                ((volume_residual + inv_kappa * m_p) / weight).abs()
            })
            .fold(0.0, f64::max))
    }
}
