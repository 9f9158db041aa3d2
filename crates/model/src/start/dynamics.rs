//! Accelerations and pressures from the balance of momentum and the derivatives of the constraint.

use myovib_dae::Problem;

use super::motion::{Motion, largest};
use super::saddle::Saddle;
use crate::error::ModelError;
use crate::field::Field;
use crate::integration::typical::transit_time;
use crate::muscle::Muscle;
use crate::muscle_dae::MuscleDae;
use crate::operators::{compliance, element_size, mass};

/// Maximum number of fixed-point iterations for the slow manifold. Each iteration reduces the error by a factor of
/// about β |∇v|. If the iterations do not converge, no useful slow manifold exists.
const MAX_ITERATIONS: usize = 50;
/// Relative change of λ at which the iteration ends. It is far below the errors of finite differences in time.
const SETTLED: f64 = 1e-11;
/// Strain of an element during one time step of the second-order finite differences in time. It determines the step.
/// The relative truncation error is about the square of this strain, and the relative rounding error is about 1e-16
/// divided by the strain.
const DIFFERENCE: f64 = 1e-5;

/// Internal stresses of a viscoelastic body; empty for other bodies.
#[derive(Clone, Copy)]
pub(super) struct Internal<'a> {
    pub(super) values: &'a [f64],
    pub(super) rates: &'a [f64],
}

/// Acceleration v̇ and pressures λ, λ̇, λ̈ of a motion.
#[derive(Default)]
pub(super) struct Dynamics {
    pub(super) acceleration: Vec<f64>,
    pub(super) pressure: Vec<f64>,
    pub(super) pressure_rate: Vec<f64>,
    pub(super) pressure_acceleration: Vec<f64>,
    /// Whether λ was not determined by the equations and was chosen on the slow manifold.
    pub(super) on_slow_manifold: bool,
}

impl Dynamics {
    /// Computes the accelerations of a body without a pressure field. `internal` contains its internal stresses.
    pub(super) fn without_pressure(
        mut dae: MuscleDae,
        t: f64,
        [q, v]: [&[f64]; 2],
        internal: Internal<'_>,
    ) -> Result<Self, ModelError> {
        let zero = vec![0.0; q.len()];
        let y = [q, v, internal.values];
        let force = momentum(&mut dae, t, &y, &[v, &zero, internal.rates])?;
        Ok(Self { acceleration: dae.solve_mass(&negative(&force))?, ..Self::default() })
    }

    /// Computes the accelerations and pressures of a motion of `muscle` from the balance of momentum of `dae`. The
    /// motion must satisfy the constraints. If the equations do not determine the pressure, the result uses `pressure`
    /// if it is given, and otherwise a value on the slow manifold.
    pub(super) fn new(
        dae: MuscleDae,
        muscle: &Muscle,
        t: f64,
        motion: [&[f64]; 2],
        internal: Internal<'_>,
        pressure: Option<&[f64]>,
    ) -> Result<Self, ModelError> {
        if muscle.parameters.is_incompressible() {
            Incompressible::new(dae, muscle, t, motion, internal)?.solve(pressure)
        } else {
            Self::compressible(dae, muscle, t, motion, internal)
        }
    }

    /// Computes the pressure for κ < ∞ from M_p λ/κ = -∫ψ g(J), and its rates from the first and second time
    /// derivatives of this equation.
    fn compressible(
        mut dae: MuscleDae,
        muscle: &Muscle,
        t: f64,
        [q, v]: [&[f64]; 2],
        internal: Internal<'_>,
    ) -> Result<Self, ModelError> {
        let mut mass_p = Saddle::alone(&compliance(&muscle.solid), &mut None)?;
        let kappa = muscle.parameters.kappa();
        let mut pressure_of = |volume_residual: Vec<f64>| -> Result<Vec<f64>, ModelError> {
            let right: Vec<f64> = volume_residual.iter().map(|d| -kappa * d).collect();
            let (pressure, _) = mass_p.solve(&right, &[])?;
            Ok(pressure)
        };
        let zero = vec![0.0; q.len()];
        let motion = Motion::new(muscle, t, q, v, &zero);
        let pressure = pressure_of(motion.volume_residual()?)?;
        let pressure_rate = pressure_of(motion.volume_residual_rate()?)?;
        let y = [q, v, &pressure, internal.values];
        let y_dot = [v, &zero, &pressure_rate, internal.rates];
        let force = momentum(&mut dae, t, &y, &y_dot)?;
        let acceleration = dae.solve_mass(&negative(&force))?;
        let motion = Motion::new(muscle, t, q, v, &acceleration);
        Ok(Self {
            pressure_acceleration: pressure_of(motion.volume_residual_acceleration()?)?,
            acceleration,
            pressure,
            pressure_rate,
            on_slow_manifold: false,
        })
    }
}

/// Equations for κ = ∞: the balance of momentum, the second derivative of the constraint, and the first time
/// derivatives of these two equations.
struct Incompressible<'a> {
    muscle: &'a Muscle,
    dae: MuscleDae,
    saddle: Saddle,
    t: f64,
    q: &'a [f64],
    v: &'a [f64],
    internal: Internal<'a>,
}

impl<'a> Incompressible<'a> {
    fn new(
        dae: MuscleDae,
        muscle: &'a Muscle,
        t: f64,
        [q, v]: [&'a [f64]; 2],
        internal: Internal<'a>,
    ) -> Result<Self, ModelError> {
        let b = Motion::new(muscle, t, q, v, v).divergence()?;
        Ok(Self {
            dae,
            saddle: Saddle::factor(&mass(&muscle.solid), &b)?,
            muscle,
            t,
            q,
            v,
            internal,
        })
    }

    fn solve(mut self, given: Option<&[f64]>) -> Result<Dynamics, ModelError> {
        let n_pressures = self.muscle.solid.space().n_pressures();
        let mut beta = vec![self.muscle.parameters.beta; n_pressures];
        if let Some(ratios) = self.muscle.solid.pressure_damping() {
            for (beta, ratio) in beta.iter_mut().zip(ratios) {
                *beta *= ratio;
            }
        }
        let is_damped = self.muscle.parameters.is_damped();
        let mut pressure = given.map_or_else(|| vec![0.0; n_pressures], <[f64]>::to_vec);
        let mut pressure_rate = vec![0.0; n_pressures];
        let mut settled = false;
        let iterations = if given.is_some() { 0 } else { MAX_ITERATIONS };
        for _ in 0..iterations {
            let (acceleration, missing) = self.acceleration(&pressure)?;
            pressure_rate = self.pressure_rate(&acceleration, &pressure, &pressure_rate)?;
            // -Bᵀ(λ + β λ̇) is known: subtract λ, then β λ̇.
            let change: Vec<f64> = missing
                .iter()
                .zip(&pressure_rate)
                .zip(&beta)
                .map(|((missing, rate), beta)| missing - beta * rate)
                .collect();
            for (pressure, change) in pressure.iter_mut().zip(&change) {
                *pressure += change;
            }
            settled = largest(&change) <= SETTLED * largest(&pressure);
            if settled {
                break;
            }
        }
        // This satisfies the balance of momentum to rounding: the remainder is assigned to β λ̇, or to λ without
        // damping.
        let (acceleration, missing) = self.acceleration(&pressure)?;
        if is_damped {
            let rates = missing.iter().zip(&beta);
            pressure_rate = rates.map(|(missing, beta)| missing / beta).collect();
        } else {
            pressure = sum(&pressure, &missing);
        }
        Ok(Dynamics {
            acceleration,
            pressure,
            pressure_rate,
            pressure_acceleration: vec![0.0; n_pressures],
            on_slow_manifold: settled && is_damped,
        })
    }

    /// Returns v̇, and the π for which −Bᵀπ balances the momentum at the given λ with λ̇ = 0.
    fn acceleration(&mut self, pressure: &[f64]) -> Result<(Vec<f64>, Vec<f64>), ModelError> {
        let (zero, no_rate) = (vec![0.0; self.q.len()], vec![0.0; pressure.len()]);
        let y = [self.q, self.v, pressure, self.internal.values];
        let y_dot = [self.v, &zero, &no_rate, self.internal.rates];
        let force = momentum(&mut self.dae, self.t, &y, &y_dot)?;
        let motion = Motion::new(self.muscle, self.t, self.q, self.v, &zero);
        let flux = motion.volume_residual_acceleration()?;
        self.saddle.solve(&negative(&force), &negative(&flux))
    }

    /// Returns λ̇ from the differentiated equations with λ̈ = 0. `rate` is the current approximation of λ̇.
    fn pressure_rate(
        &mut self,
        acceleration: &[f64],
        pressure: &[f64],
        rate: &[f64],
    ) -> Result<Vec<f64>, ModelError> {
        let step = self.difference_step(acceleration);
        let mut at = |s: f64| -> Result<(Vec<f64>, Vec<f64>), ModelError> {
            let t = self.t + s;
            let v: Vec<f64> = moved(self.v, s, acceleration);
            let q: Vec<f64> = moved(&moved(self.q, s, self.v), 0.5 * s * s, acceleration);
            let pressure = moved(pressure, s, rate);
            let internal = moved(self.internal.values, s, self.internal.rates);
            let y_dot = [&v[..], acceleration, rate, self.internal.rates];
            let force = momentum(&mut self.dae, t, &[&q, &v, &pressure, &internal], &y_dot)?;
            let motion = Motion::new(self.muscle, t, &q, &v, acceleration);
            Ok((force, motion.volume_residual_acceleration()?))
        };
        // A one-sided difference is used, because the load may have a jump or a kink at this time.
        let [(f0, g0), (f1, g1), (f2, g2)] = [at(0.0)?, at(step)?, at(2.0 * step)?];
        let fall = |here: &[f64], next: &[f64], last: &[f64]| -> Vec<f64> {
            let of_row = |i: usize| (3.0 * here[i] - 4.0 * next[i] + last[i]) / (2.0 * step);
            (0..here.len()).map(of_row).collect()
        };
        let (force, flux) = (fall(&f0, &f1, &f2), fall(&g0, &g1, &g2));
        let (_, correction) = self.saddle.solve(&force, &flux)?;
        Ok(sum(rate, &correction))
    }

    /// Returns the time in which the velocity or the acceleration strains an element by [`DIFFERENCE`]: the shorter of
    /// the two times, but at most [`LONGEST_DIFFERENCE`] times the transit time.
    fn difference_step(&self, acceleration: &[f64]) -> f64 {
        let displacement = DIFFERENCE * element_size(&self.muscle.solid);
        let by_velocity = displacement / largest(self.v);
        let by_acceleration = (displacement / largest(acceleration)).sqrt();
        by_velocity.min(by_acceleration).min(LONGEST_DIFFERENCE * transit_time(self.muscle))
    }
}

/// Largest time step of the finite differences, relative to the time in which a shear wave crosses the body. A body at
/// rest without loads has no other time scale.
const LONGEST_DIFFERENCE: f64 = 1e-3;

/// Evaluates the residual of the balance of momentum.
pub(super) fn momentum(
    dae: &mut MuscleDae,
    t: f64,
    y: &[&[f64]],
    y_dot: &[&[f64]],
) -> Result<Vec<f64>, ModelError> {
    let rows = dae.layout().range(Field::Velocity).expect("all formulations have v");
    let mut residual = vec![0.0; dae.n_unknowns()];
    dae.residual(t, &y.concat(), &y_dot.concat(), &mut residual)?;
    Ok(residual[rows].to_vec())
}

fn negative(x: &[f64]) -> Vec<f64> {
    x.iter().map(|x| -x).collect()
}

fn sum(x: &[f64], y: &[f64]) -> Vec<f64> {
    moved(x, 1.0, y)
}

/// Returns x + s y.
pub(crate) fn moved(x: &[f64], s: f64, y: &[f64]) -> Vec<f64> {
    x.iter().zip(y).map(|(x, y)| x + s * y).collect()
}
