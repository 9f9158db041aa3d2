//! Dynamic stiffness as an operator on all nodal components, used for moving supports and for reactions.

use myovib_fem::output::StressContext;
use myovib_fem::{AddedMotion, Change, Fields, TangentProduct};
use num_complex::Complex64;

use super::{DynamicStiffness, Part};
use crate::error::ModelError;
use crate::operators;
use crate::reading::snapshot::Snapshot;
use crate::start::dynamics::moved;

/// Displacement gradient of the perturbations in difference quotients. For this value, the truncation and rounding
/// errors are below 1e-9 of the derivative.
const PROBING_GRADIENT: f64 = 1e-5;

/// Forces at all nodal components and volumes at the vertices.
pub(super) struct Balance {
    pub(super) force: Vec<Complex64>,
    pub(super) volume: Vec<Complex64>,
}

impl DynamicStiffness {
    /// Returns the unbalanced forces and volumes of the motion (û, p̂) under its loads.
    ///
    /// # Errors
    /// Returns [`ModelError::Inverted`] if an element is inverted at the equilibrium.
    pub(super) fn unbalanced(
        &self,
        s: Complex64,
        u: &[Complex64],
        p: &[Complex64],
    ) -> Result<Balance, ModelError> {
        let mut balance = self.product(s, u, p)?;
        for (force, load) in balance.force.iter_mut().zip(&self.force) {
            *force -= load;
        }
        Ok(balance)
    }

    /// Applies the dynamic stiffness for s = iω to the motion (û, p̂), without forming a matrix.
    ///
    /// # Errors
    /// Returns [`ModelError::Inverted`] if an element is inverted at the equilibrium.
    fn product(
        &self,
        s: Complex64,
        u: &[Complex64],
        p: &[Complex64],
    ) -> Result<Balance, ModelError> {
        let mut total = Balance {
            force: vec![Complex64::ZERO; u.len()],
            volume: vec![Complex64::ZERO; p.len()],
        };
        let real = |values: &[Complex64]| values.iter().map(|z| z.re).collect::<Vec<_>>();
        let imaginary = |values: &[Complex64]| values.iter().map(|z| z.im).collect::<Vec<_>>();
        for (unit, u, p) in
            [(Complex64::ONE, real(u), real(p)), (Complex64::I, imaginary(u), imaginary(p))]
        {
            if u.iter().chain(&p).any(|x| *x != 0.0) {
                self.add_product(s, unit, [&u, &p], &mut total)?;
            }
        }
        Ok(total)
    }

    /// Adds `unit` times the product with a real motion.
    fn add_product(
        &self,
        s: Complex64,
        unit: Complex64,
        [u, p]: [&[f64]; 2],
        total: &mut Balance,
    ) -> Result<(), ModelError> {
        let muscle = self.dae.muscle();
        let (solid, parameters) = (&muscle.solid, &muscle.parameters);
        let mut force = operators::rest(solid);
        let mut volume = vec![0.0; p.len()];
        let add = |factor: Complex64, values: &[f64], total: &mut [Complex64]| {
            for (total, value) in total.iter_mut().zip(values) {
                *total += unit * factor * value;
            }
        };

        solid.apply_mass(u, &mut force);
        add(s * s, &force, &mut total.force);
        solid.apply_damping_mass(u, &mut force);
        add(s * parameters.alpha, &force, &mut total.force);

        let still = operators::rest(solid);
        let no_rate = vec![0.0; p.len()];
        let has_pressure = !p.is_empty();
        let fields = Fields {
            v: Some(&still),
            p_rate: has_pressure.then_some(&no_rate),
            ..Fields::new(&self.u, parameters.pressure(has_pressure.then_some(&self.p)))
        };
        let at = TangentProduct { beta: 0.0, constraint_rate: false };
        let mut change = Change {
            u,
            v: None,
            p: has_pressure.then_some(p),
            p_rate: None,
            force: &mut force,
            volume_residual: has_pressure.then_some(&mut volume),
        };
        solid.multiply(&fields, at, std::slice::from_mut(&mut change))?;
        add(Complex64::ONE, &force, &mut total.force);
        add(Complex64::ONE, &volume, &mut total.volume);
        if has_pressure {
            solid.apply_compliance(p, &mut volume);
            let inv_kappa = Complex64::from(parameters.inv_kappa);
            add(inv_kappa, &volume, &mut total.volume);
        }
        if parameters.is_damped() {
            // ∫β Ṗ:∇φ with u and p as the rates, which are then multiplied by s.
            let at = TangentProduct { beta: parameters.beta, ..at };
            let mut change = Change {
                u: &still,
                v: Some(u),
                p: None,
                p_rate: has_pressure.then_some(p),
                force: &mut force,
                volume_residual: None,
            };
            solid.multiply(&fields, at, std::slice::from_mut(&mut change))?;
            add(s, &force, &mut total.force);
        }

        for foundation in &muscle.foundations {
            force.fill(0.0);
            foundation.operator().add_product(1.0, u, &mut force);
            let factor = foundation.stiffness() + s * foundation.damping();
            add(factor, &force, &mut total.force);
        }
        if !solid.added_stresses().is_empty() {
            let added = |u: &[f64], v: &[f64], force: &mut [f64]| {
                let tensions = &self.tensions[..];
                solid.added_force(&AddedMotion { u, v, tensions }, force);
            };
            if self.tensions.iter().all(|tension| *tension == 0.0) {
                // Only viscous stress acts; it is linear in the velocity and zero at rest.
                added(&self.u, u, &mut force);
                add(s, &force, &mut total.force);
            } else {
                let by_u = self.slope(u, &self.u, |u, force| added(u, &still, force));
                add(Complex64::ONE, &by_u, &mut total.force);
                let by_v = self.slope(u, &still, |v, force| added(&self.u, v, force));
                add(s, &by_v, &mut total.force);
            }
        }
        for load in muscle.boundary_forces() {
            let by_u = self.slope(u, &self.u, |u, force| {
                force.fill(0.0);
                load.add_force(self.t, 1.0, -1.0, u, force);
            });
            add(Complex64::ONE, &by_u, &mut total.force);
        }
        if solid.n_slots() > 0 {
            let mut rates = [vec![0.0; solid.n_slots()]];
            solid.driving_stress_rates(&self.u, &[u.to_vec()], &mut rates);
            let [mut re] = rates;
            let mut im = vec![0.0; re.len()];
            for region in solid.relaxation_regions() {
                let factor = region.prony.tangent_factor(s) - Complex64::ONE;
                for slot in region.slots.clone() {
                    (re[slot], im[slot]) = (factor.re * re[slot], factor.im * re[slot]);
                }
            }
            let mut forces = [still.clone(), still];
            solid.tensor_forces(&self.u, &[re, im], &mut forces);
            add(Complex64::ONE, &forces[0], &mut total.force);
            add(Complex64::I, &forces[1], &mut total.force);
        }
        Ok(())
    }

    /// Returns the derivative of `force` along `direction` at the nodal field `at`, computed by central differences.
    /// Extrapolation removes the error term of first order in the step. This term is caused by the force–velocity
    /// relation, whose curvature jumps at rest.
    fn slope(&self, direction: &[f64], at: &[f64], force: impl Fn(&[f64], &mut [f64])) -> Vec<f64> {
        let values = |step: f64| {
            let mut result = vec![0.0; at.len()];
            force(&moved(at, step, direction), &mut result);
            result.into_iter()
        };
        let difference = |step: f64| {
            let pairs = values(step).zip(values(-step));
            pairs.map(move |(ahead, behind)| (ahead - behind) / (2.0 * step))
        };
        let step = self.probing_step(direction);
        let pairs = difference(step).zip(difference(0.5 * step));
        pairs.map(|(whole, half)| 2.0 * half - whole).collect()
    }

    /// Returns the step of the central differences in the direction of a nodal `displacement`.
    pub(super) fn probing_step(&self, displacement: &[f64]) -> f64 {
        let space = self.dae.muscle().solid.space();
        match operators::largest_gradient(space, displacement) {
            0.0 => 1.0,
            gradient => PROBING_GRADIENT / gradient,
        }
    }

    /// Reads the state that is the sum of the equilibrium and `step` times a motion.
    pub(super) fn with_snapshot<R>(
        &self,
        motion: &Part,
        step: f64,
        read: impl Fn(&Snapshot<'_>) -> R,
    ) -> R {
        let muscle = self.dae.muscle();
        let parameters = &muscle.parameters;
        let scaled = |rate: &[f64]| rate.iter().map(|x| step * x).collect::<Vec<_>>();
        let pressure = moved(&self.p, step, &motion.pressure);
        let has_pressure = !pressure.is_empty();
        let p_rate = scaled(&motion.pressure_rate);
        read(&Snapshot {
            solid: &muscle.solid,
            displacement: &moved(&self.u, step, &motion.displacement),
            velocity: &scaled(&motion.velocity),
            acceleration: &scaled(&motion.acceleration),
            pressure: parameters.pressure(has_pressure.then_some(&pressure)),
            factors: None,
            p_rate: (has_pressure && parameters.is_damped()).then_some(&p_rate),
            stress_context: StressContext {
                tensions: &self.tensions,
                beta: parameters.beta,
                internal: &[],
            },
        })
    }
}
