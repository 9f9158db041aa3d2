//! Consistent initial values for every formulation, computed from displacements and velocities.
//!
//! [`InitialValues`] contains y and ẏ that satisfy F(t, y, ẏ) = 0 and, for index 2 or 3, the hidden equations that
//! follow from the derivatives of F. [`BlockResidual`] measures the error.
//!
//! Reference: U. M. Ascher, L. R. Petzold, *Computer Methods for Ordinary Differential Equations
//! and Differential-Algebraic Equations*, SIAM 1998, section 9.2 (hidden constraints).

mod creep;
pub(crate) mod dynamics;
pub(crate) mod motion;
mod projection;
mod residual;
pub(crate) mod saddle;

use std::ops::Range;

use dynamics::{Dynamics, Internal};
use motion::{Motion, largest};
use myovib_dae::Problem;
pub(crate) use residual::residuals_with_overstress;
pub use residual::{BlockResidual, residuals};

use std::ops::ControlFlow;

use crate::equation::Added;
use crate::error::ModelError;
use crate::field::Field;
use crate::formulation::Formulation;
use crate::muscle::Muscle;
use crate::muscle_dae::MuscleDae;
use crate::statics::{self, Search};

/// Consistent initial values of a muscle in a formulation.
#[derive(Debug, Clone, PartialEq)]
pub struct InitialValues {
    /// Unknowns y.
    pub y: Vec<f64>,
    /// Derivatives ẏ, including those of algebraic variables.
    pub y_dot: Vec<f64>,
    /// Largest change (m) of a displacement component due to the projection onto the constraint.
    pub displacement_moved: f64,
    /// Largest change (m/s) of a velocity component due to the projection.
    pub velocity_moved: f64,
    /// Whether λ(0) was not determined by the equations (κ = ∞ with β > 0) and was computed on the slow manifold. If
    /// the motion is so fast that β |∇v| is not small, there is no slow manifold, and the motion starts with a
    /// transient.
    pub on_slow_manifold: bool,
}

/// A system that can compute a consistent state near a given state.
pub trait Consistent: Problem {
    /// Computes y and ẏ that satisfy the equations at time `t`, including hidden equations. The displacements and
    /// velocities of `y` are projected onto the constraints. Other unknowns with free initial values are kept, and the
    /// remaining unknowns are computed.
    fn consistent(&mut self, t: f64, y: &[f64]) -> Result<[Vec<f64>; 2], ModelError>;
}

impl Consistent for MuscleDae {
    fn consistent(&mut self, t: f64, y: &[f64]) -> Result<[Vec<f64>; 2], ModelError> {
        if !self.muscle().solid.has_inertia() {
            // Displacements are continuous. Velocities and pressures change at kinks of support motions.
            let start = InitialValues::without_inertia(self, t, y.to_vec())?;
            return Ok([start.y, start.y_dot]);
        }
        // λ + β λ̇ balances the momentum; λ is unchanged.
        let parameters = &self.muscle().parameters;
        let is_free = parameters.is_incompressible() && parameters.is_damped();
        let pressure = self.layout().range(Field::Pressure).filter(|_| is_free);
        let start = InitialValues::next_to(self, t, y, pressure)?;
        Ok([start.y, start.y_dot])
    }
}

/// Displacements and velocities that satisfy the constraints, independent of the formulation.
#[derive(Debug, Clone)]
struct Motions {
    q: Vec<f64>,
    v: Vec<f64>,
}

impl InitialValues {
    /// Computes consistent values at time `t` for the displacement `q` and velocity `v`. Unknown tensions start from
    /// zero, and the stress is relaxed (H = 0).
    ///
    /// # Method
    /// For κ = ∞, q and v are first projected: q onto ∫ψ g(J) = 0 in the H1 seminorm, and v onto ∫ψ g' cof F:∇v = 0 in
    /// the norm of the kinetic energy. λ and v̇ follow from the balance of momentum and the second derivative of the
    /// constraint; λ̇ and v̈ follow from the derivatives of these equations. With β > 0, only λ + β λ̇ is determined.
    /// Among all possible λ(0), the value with λ̈ = 0 is chosen. Then e^(-t/β) is excited only by terms of order β² λ̈
    /// (the slow manifold to first order in β).
    ///
    /// For κ < ∞, the constraint determines λ and λ̇. Therefore p/κ + g(J) = 0, which `velocity` conserves, holds from
    /// the start.
    ///
    /// # Shapes
    /// `q`, `v`: the free displacement components.
    ///
    /// # Errors
    /// [`ModelError::Inverted`] or [`ModelError::NotIncompressible`] if the displacement cannot be made consistent;
    /// [`ModelError::Factorization`] if the pressures are undetermined (B does not have full rank).
    ///
    /// # Panics
    /// Panics if a length is wrong.
    pub fn new(dae: &mut MuscleDae, t: f64, q: &[f64], v: &[f64]) -> Result<Self, ModelError> {
        let tensions = vec![0.0; dae.muscle().models().count()];
        Self::contracting(dae, t, [q, v, &tensions], None, None)
    }

    /// Computes consistent values for given tensions. `internal` contains the internal stresses; without it, the stress
    /// is relaxed. `pressure` is used for λ if the equations do not determine λ; without it, λ is on the slow manifold.
    fn contracting(
        dae: &mut MuscleDae,
        t: f64,
        [q, v, tensions]: [&[f64]; 3],
        internal: Option<&[f64]>,
        pressure: Option<&[f64]>,
    ) -> Result<Self, ModelError> {
        let muscle = dae.muscle().with_tangents_of_tensions(t, tensions);
        let models = dae.muscle().models().zip(tensions);
        let tension_rates: Vec<f64> =
            models.map(|((_, model), &tension)| model.rate(t, tension)).collect();
        let moved = project(&muscle, t, q, v, dae.formulation())?;
        let motion = [&moved.q[..], &moved.v];
        let stresses = internal_stresses(&muscle, t, motion, internal);
        let internal = Internal { values: &stresses[0], rates: &stresses[1] };
        let dynamics = if dae.formulation() == Formulation::Displacement {
            let system = dae.with_body(&muscle, Formulation::Displacement);
            Dynamics::without_pressure(system, t, motion, internal)?
        } else {
            let system = dae.with_body(&muscle, Formulation::ImplicitRate);
            Dynamics::new(system, &muscle, t, motion, internal, pressure)?
        };
        let layout = dae.layout();
        let (mut y, mut y_dot) = (vec![0.0; layout.n_unknowns()], vec![0.0; layout.n_unknowns()]);
        for (field, range) in layout.blocks() {
            let (value, rate): (&[f64], &[f64]) = match field {
                Field::Displacement => (&moved.q, &moved.v),
                Field::Velocity => (&moved.v, &dynamics.acceleration),
                Field::Pressure => (&dynamics.pressure, &dynamics.pressure_rate),
                Field::PressureRate => (&dynamics.pressure_rate, &dynamics.pressure_acceleration),
                Field::Tension => (tensions, &tension_rates),
                Field::InternalStress => (internal.values, internal.rates),
                // The multiplier is zero in the exact solution.
                Field::GglMultiplier => continue,
            };
            y[range.clone()].copy_from_slice(value);
            y_dot[range.clone()].copy_from_slice(rate);
        }
        let distance = |a: &[f64], b: &[f64]| {
            largest(&a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<_>>())
        };
        Ok(Self {
            y,
            y_dot,
            displacement_moved: distance(&moved.q, q),
            velocity_moved: distance(&moved.v, v),
            on_slow_manifold: dynamics.on_slow_manifold,
        })
    }

    /// Computes consistent values at time `t` for the displacements, velocities, tensions and
    /// internal stresses in `y`.
    ///
    /// # Panics
    /// Panics if `y` is not a state of `dae`.
    pub fn of(dae: &mut MuscleDae, t: f64, y: &[f64]) -> Result<Self, ModelError> {
        Self::next_to(dae, t, y, None)
    }

    /// Computes consistent values for the state `y`. Keeps λ if the range of λ in `y` is given.
    fn next_to(
        dae: &mut MuscleDae,
        t: f64,
        y: &[f64],
        pressure: Option<Range<usize>>,
    ) -> Result<Self, ModelError> {
        let range = |field| dae.layout().range(field).expect("all formulations have q and v");
        let (q, v) = (range(Field::Displacement), range(Field::Velocity));
        let tensions = dae.layout().range(Field::Tension).unwrap_or_default();
        let internal = dae.layout().range(Field::InternalStress).map(|own| &y[own]);
        let pressure = pressure.map(|own| &y[own]);
        Self::contracting(dae, t, [&y[q], &y[v], &y[tensions]], internal, pressure)
    }

    /// Computes consistent values for the body at rest under its loads at time `t`. `watch`
    /// observes the search.
    ///
    /// # Errors
    /// Errors of [`statics::equilibrium`] and of [`new`](Self::new).
    pub fn equilibrium(
        dae: &mut MuscleDae,
        t: f64,
        watch: &mut dyn FnMut(&Search) -> ControlFlow<()>,
    ) -> Result<Self, ModelError> {
        let (muscle, formulation) = (dae.muscle(), dae.formulation());
        let equilibrium = statics::equilibrium_watched(muscle, formulation, t, watch)?;
        let rest = vec![0.0; equilibrium.displacement.len()];
        if muscle.solid.has_inertia() {
            return Self::new(dae, t, &equilibrium.displacement, &rest);
        }
        // Without inertia, displacements and pressures are those of the equilibrium.
        let [internal, _] = internal_stresses(muscle, t, [&equilibrium.displacement, &rest], None);
        let layout = dae.layout();
        let mut y = vec![0.0; layout.n_unknowns()];
        for (field, range) in layout.blocks() {
            let value = match field {
                Field::Displacement => &equilibrium.displacement,
                Field::Pressure => &equilibrium.pressure,
                Field::InternalStress => &internal,
                _ => continue,
            };
            y[range.clone()].copy_from_slice(value);
        }
        Self::without_inertia(dae, t, y)
    }

    /// Returns the undeformed state at t = 0. In a body with inertia, all values and rates are zero, which is
    /// consistent without load at t = 0. In a body without inertia, velocities and pressures are such that viscous
    /// stresses balance the loads and the motions of supports.
    pub fn at_rest(dae: &mut MuscleDae) -> Result<Self, ModelError> {
        let y = vec![0.0; dae.n_unknowns()];
        if dae.muscle().solid.has_inertia() {
            return Ok(Self::unmoved(y.clone(), y));
        }
        Self::without_inertia(dae, 0.0, y)
    }

    /// Completes the state `y`, in which displacements, tensions and internal stresses are given. Without viscous
    /// stresses, the velocity follows from the first step.
    fn without_inertia(dae: &mut MuscleDae, t: f64, mut y: Vec<f64>) -> Result<Self, ModelError> {
        if Added::of(dae.muscle()).is_damped() {
            creep::balance(dae, t, &mut y)?;
        }
        let y_dot = rates_without_inertia(dae, t, &y);
        Ok(Self::unmoved(y, y_dot))
    }

    fn unmoved(y: Vec<f64>, y_dot: Vec<f64>) -> Self {
        Self { y, y_dot, displacement_moved: 0.0, velocity_moved: 0.0, on_slow_manifold: false }
    }
}

/// Returns ẏ for a body without inertia in the state `y`. It contains the rates of tensions. All other rates are
/// unknown before a step and are set to zero.
fn rates_without_inertia(dae: &MuscleDae, t: f64, y: &[f64]) -> Vec<f64> {
    let mut y_dot = vec![0.0; y.len()];
    if let Some(range) = dae.layout().range(Field::Tension) {
        let models = dae.muscle().models().zip(&y[range.clone()]);
        for (rate, ((_, model), &tension)) in y_dot[range].iter_mut().zip(models) {
            *rate = model.rate(t, tension);
        }
    }
    y_dot
}

/// Returns internal stresses and their rates. The stresses are the `given` values or, without them, the values for
/// relaxed stress.
fn internal_stresses(
    muscle: &Muscle,
    t: f64,
    [q, v]: [&[f64]; 2],
    given: Option<&[f64]>,
) -> [Vec<f64>; 2] {
    let solid = &muscle.solid;
    if solid.n_internal() == 0 {
        return Default::default();
    }
    let u = Motion::new(muscle, t, q, v, v).displacement;
    let values = given.map_or_else(|| solid.equilibrium_overstress(&u), <[f64]>::to_vec);
    let mut rates = vec![0.0; values.len()];
    solid.relaxation_force(&u, &values, None, &mut rates);
    [values, rates]
}

fn project(
    muscle: &Muscle,
    t: f64,
    q: &[f64],
    v: &[f64],
    formulation: Formulation,
) -> Result<Motions, ModelError> {
    if !muscle.parameters.is_incompressible() || formulation == Formulation::Displacement {
        return Ok(Motions { q: q.to_vec(), v: v.to_vec() });
    }
    let q = projection::displacement(muscle, t, q)?;
    let v = projection::velocity(muscle, t, &q, v)?;
    Ok(Motions { q, v })
}
