//! Harmonic response of a body: small motions u₀ + Re(û e^{iωt}) about an equilibrium.
//!
//! With s = iω, the equations of a formulation give (∂F/∂y + s ∂F/∂ẏ) ŷ = f̂. Velocities and
//! internal stresses are eliminated as in Newton's method:
//!
//! ```text
//! (s² M + s D + K) û − (1 + sβ) Bᵀ p̂ = f̂,      B û + M_p p̂/κ = 0.
//! ```
//!
//! K contains the law, φ(s) − 1 times its material part for viscoelastic stress, active stress,
//! foundations and follower pressures; D contains α, β, Kelvin–Voigt stress and foundations. All
//! matrices belong to the equilibrium and are evaluated once; each frequency costs one complex
//! factorization of a matrix in (û, p̂). It is symmetric except under follower pressures and for
//! damping β that varies between elements.

mod operator;

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::sync::{Mutex, PoisonError};

use myovib_sparse::{LinearWork, Ordering, Prediction, SparseOptions, resources};
use num_complex::Complex64;

use crate::analysis::spectrum;
use crate::analysis::support::expect_held;
use crate::error::ModelError;
use crate::field::Field;
use crate::formulation::Formulation;
use crate::linear::{Condensation, Condensed, Elimination};
use crate::muscle::Muscle;
use crate::muscle::load::PressureLoad;
use crate::muscle_dae::MuscleDae;
use crate::operators;
use crate::reading::snapshot::Snapshot;
use crate::statics::Equilibrium;

/// Complex amplitudes of the harmonic parts of loads and support motions: Re(amplitude e^{iωt}).
#[derive(Debug, Clone)]
pub struct Drive {
    /// Forces of fixed direction at all nodal components, N.
    pub force: Vec<Complex64>,
    /// Follower pressures of 1 Pa, each with its amplitude, Pa.
    pub pressures: Vec<(PressureLoad, Complex64)>,
    /// Prescribed components of the nodal displacement with their amplitudes, m.
    pub displacement: Vec<(usize, Complex64)>,
}

impl Drive {
    /// Returns whether all amplitudes are zero.
    pub fn is_zero(&self) -> bool {
        let pressures = self.pressures.iter().map(|(_, amplitude)| amplitude);
        let displacement = self.displacement.iter().map(|(_, amplitude)| amplitude);
        let mut all = self.force.iter().chain(pressures).chain(displacement);
        all.all(|amplitude| amplitude.norm() == 0.0)
    }
}

/// Amplitude of the motion at one frequency.
#[derive(Debug, Clone)]
pub struct Amplitude {
    /// iω, 1/s.
    pub s: Complex64,
    /// û of all nodal components, m.
    pub displacement: Vec<Complex64>,
    /// p̂ at the vertices, Pa; empty for the formulation without pressure.
    pub pressure: Vec<Complex64>,
}

/// Linearization of a body about an equilibrium, and its harmonic loads.
pub struct HarmonicResponse {
    dae: MuscleDae,
    /// Displacement of all nodes at the equilibrium.
    u: Vec<f64>,
    /// Pressure at the equilibrium; empty for the formulation without pressure.
    p: Vec<f64>,
    /// Tension of each element.
    tensions: Vec<f64>,
    /// Time of the loads, s.
    t: f64,
    /// Harmonic forces at all nodal components.
    force: Vec<Complex64>,
    /// Harmonic motion of the supports at all nodal components; zero for free components.
    supports: Vec<Complex64>,
    plan: Arc<Condensation>,
    elimination: Arc<Elimination>,
}

impl HarmonicResponse {
    /// Linearizes `muscle` about the equilibrium `at` of a formulation with or without pressure.
    ///
    /// # Errors
    /// [`ModelError::Inverted`] for a state without stress; errors of the symbolic analysis.
    pub fn about(
        muscle: &Muscle,
        formulation: Formulation,
        at: &Equilibrium,
        drive: &Drive,
    ) -> Result<Self, ModelError> {
        let muscle = match at.preload_time {
            Some(_) => muscle.clone(),
            None => Muscle {
                pressures: Vec::new(),
                ..muscle.under_part_of_loads(0.0)
            },
        };
        let t = at.preload_time.unwrap_or(0.0);
        let u = spectrum::displacement(&muscle, at);
        let formulation = match (
            formulation.has(Field::Pressure),
            muscle.parameters.is_damped(),
        ) {
            (false, _) => Formulation::Displacement,
            (true, false) => Formulation::Position,
            (true, true) => Formulation::ImplicitRate,
        };
        let mut dae = MuscleDae::for_analysis(muscle, formulation);
        dae.relax_overstress();
        let mut y = vec![0.0; dae.layout().n_unknowns()];
        let mut set = |field, values: &[f64]| {
            if let Some(range) = dae.layout().range(field) {
                y[range].copy_from_slice(values);
            }
        };
        set(Field::Displacement, &at.displacement);
        set(Field::Pressure, &at.pressure);
        let n_internal = dae.muscle().solid.n_internal();
        y.truncate(y.len() - n_internal);
        let rest = vec![0.0; y.len()];
        dae.update_matrices(t, &y, &rest)?;
        let p = dae.pressure(&y).unwrap_or_default().to_vec();

        let solid = &dae.muscle().solid;
        let mut force = drive.force.clone();
        force.resize(u.len(), Complex64::ZERO);
        for (pressure, amplitude) in &drive.pressures {
            let mut unit = operators::rest(solid);
            pressure.add_at(t, 1.0, &u, &mut unit);
            for (force, unit) in force.iter_mut().zip(unit) {
                *force += amplitude * unit;
            }
        }
        let mut supports = vec![Complex64::ZERO; u.len()];
        for &(component, amplitude) in &drive.displacement {
            supports[component] = amplitude;
        }
        let plan = Condensation::at_rest(&dae);
        let elimination = plan.elimination(SparseOptions {
            ordering: Ordering::Amd,
            btf: false,
            ..SparseOptions::default()
        })?;
        Ok(Self {
            tensions: dae.muscle().tensions_at_rest(t),
            dae,
            u,
            p,
            t,
            force,
            supports,
            plan: Arc::new(plan),
            elimination: Arc::new(elimination),
        })
    }

    /// Returns whether stresses relax, so that stresses are not functions of the current motion.
    pub fn relaxes(&self) -> bool {
        self.dae.muscle().solid.n_slots() > 0
    }

    /// Returns the number of unknowns of each linear system.
    pub fn n_unknowns(&self) -> usize {
        self.plan.n_condensed()
    }

    /// Predicts memory and work of one factorization; `None` for an external solver.
    pub fn prediction(&self) -> Option<Prediction> {
        self.elimination.prediction::<Complex64>()
    }

    /// Solves for each frequency (Hz) and returns what `read` makes of the amplitudes, with its frequency, in the order
    /// of the frequencies. Frequencies are distributed over the threads of this process; the
    /// results do not depend on their number. If `read` returns [`ModelError::Interrupted`], the results so far are returned.
    ///
    /// # Errors
    /// [`ModelError::NotHeld`] for frequency 0 of a body that can move without strain; errors of
    /// the factorization and of `read`, which end the computation.
    pub fn map<R: Send>(
        &self,
        frequencies: &[f64],
        read: impl Fn(&Amplitude) -> Result<R, ModelError> + Sync,
    ) -> Result<Vec<(f64, R)>, ModelError> {
        if frequencies.contains(&0.0) {
            expect_held(self.dae.muscle())?;
        }
        let next = AtomicUsize::new(0);
        let results = Mutex::new(Vec::new());
        let work = || {
            let mut matrix = None;
            loop {
                let k = next.fetch_add(1, Relaxed);
                let Some(frequency) = frequencies.get(k) else {
                    return;
                };
                let matrix = matrix.get_or_insert_with(|| {
                    Condensed::new(self.plan.clone(), self.elimination.clone())
                });
                let s = Complex64::new(0.0, std::f64::consts::TAU * frequency);
                let result = self.solve(matrix, s).and_then(|found| read(&found));
                if result.is_err() {
                    next.store(frequencies.len(), Relaxed);
                }
                let mut results = results.lock().unwrap_or_else(PoisonError::into_inner);
                results.push((k, result));
            }
        };
        match resources::threads() {
            None => work(),
            Some(pool) => pool.scope(|scope| {
                for _ in 0..pool.current_num_threads().min(frequencies.len()) {
                    scope.spawn(|_| work());
                }
            }),
        }
        let mut results = results.into_inner().unwrap_or_else(PoisonError::into_inner);
        results.sort_by_key(|(k, _)| *k);
        let found = results.into_iter().filter_map(|(k, result)| match result {
            Ok(result) => Some(Ok((frequencies[k], result))),
            Err(ModelError::Interrupted) => None,
            Err(error) => Some(Err(error)),
        });
        found.collect()
    }

    /// Solves for one s = iω.
    fn solve(
        &self,
        matrix: &mut Condensed<Complex64>,
        s: Complex64,
    ) -> Result<Amplitude, ModelError> {
        let mut work = LinearWork::default();
        matrix.forget_history()?;
        matrix.set_up(s, |values| self.dae.matrix_values(values), &mut work)?;
        let still = vec![Complex64::ZERO; self.p.len()];
        let moved = self.product(s, &self.supports, &still)?;
        let dofs = self.dae.muscle().solid.dofs();
        let layout = self.dae.layout();
        let mut x = vec![Complex64::ZERO; layout.n_unknowns()];
        for (row, &i) in x[layout.momentum()].iter_mut().zip(dofs.free_to_full()) {
            *row = self.force[i] - moved.force[i];
        }
        let pressures = layout.range(Field::Pressure).unwrap_or_default();
        for (row, volume) in x[pressures.clone()].iter_mut().zip(moved.volume) {
            *row = -volume;
        }
        matrix.solve(&mut x, &mut work)?;
        let mut displacement = self.supports.clone();
        let free = layout.range(Field::Displacement);
        let free = &x[free.expect("all formulations have q")];
        for (&i, value) in dofs.free_to_full().iter().zip(free) {
            displacement[i] = *value;
        }
        Ok(Amplitude {
            s,
            displacement,
            pressure: x[pressures].to_vec(),
        })
    }

    /// Returns the amplitudes of the forces of the supports on the body at all nodal components, N;
    /// zero up to rounding for free components.
    ///
    /// # Errors
    /// [`ModelError::Inverted`] for an equilibrium without stress.
    pub fn reactions(&self, at: &Amplitude) -> Result<Vec<Complex64>, ModelError> {
        let balance = self.product(at.s, &at.displacement, &at.pressure)?;
        let forces = balance.force.into_iter().zip(&self.force);
        Ok(forces.map(|(force, given)| force - given).collect())
    }

    /// Returns the amplitudes of functions of the body's state: their derivatives
    /// along the motion, by central differences. Linear values are exact up to rounding, others to
    /// about 1e-9.
    pub fn amplitudes(
        &self,
        at: &Amplitude,
        read: impl Fn(&Snapshot<'_>) -> Vec<f64>,
    ) -> Vec<Complex64> {
        let slope = |part: fn(Complex64) -> f64| {
            let motion = at.part(part);
            let step = self.probing_step(&motion.displacement);
            let values = |step: f64| self.with_snapshot(&motion, step, &read).into_iter();
            let pairs = values(step).zip(values(-step));
            pairs.map(move |(ahead, behind)| (ahead - behind) / (2.0 * step))
        };
        let parts = slope(|z| z.re).zip(slope(|z| z.im));
        parts.map(|(re, im)| Complex64::new(re, im)).collect()
    }
}

/// Real or imaginary part of a motion and of its rates.
struct Part {
    displacement: Vec<f64>,
    velocity: Vec<f64>,
    pressure: Vec<f64>,
    pressure_rate: Vec<f64>,
}

impl Amplitude {
    fn part(&self, part: fn(Complex64) -> f64) -> Part {
        let value = |amplitudes: &[Complex64]| amplitudes.iter().map(|z| part(*z)).collect();
        let rate = |amplitudes: &[Complex64]| {
            let rates = amplitudes.iter().map(|z| part(self.s * z));
            rates.collect()
        };
        Part {
            displacement: value(&self.displacement),
            velocity: rate(&self.displacement),
            pressure: value(&self.pressure),
            pressure_rate: rate(&self.pressure),
        }
    }
}
