//! Harmonic response of a body: small motions u₀ + Re(û e^{iωt}) about an equilibrium.
//!
//! With s = iω, the equations of a formulation give (∂F/∂y + s ∂F/∂ẏ) ŷ = f̂. Velocities and
//! internal stresses are eliminated as in Newton's method:
//!
//! ```text
//! (s² M + s D + K) û − (1 + sβ) Bᵀ p̂ = f̂,      B û + M_p p̂/κ = 0.
//! ```
//!
//! K contains the contributions of the law, active stress, foundations and follower pressures, and, for viscoelastic
//! stress, φ(s) − 1 times the material part of the law's stiffness. D contains α, β, Kelvin–Voigt stress and
//! foundations. All matrices are evaluated once, at the equilibrium. Each frequency then requires one complex
//! factorization of a matrix in (û, p̂). This matrix is treated as symmetric unless there are follower pressures or
//! contacts, or β varies between elements.

mod neighbors;
mod operator;

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::sync::{Mutex, MutexGuard, PoisonError};

use myovib_sparse::{LinearWork, Ordering, Prediction, SparseOptions, resources};
use num_complex::Complex64;

use crate::analysis::support::expect_held;
use crate::error::ModelError;
use crate::field::Field;
use crate::formulation::Formulation;
use crate::linear::{Condensation, Condensed, Elimination};
use crate::muscle::Muscle;
use crate::muscle::load::SurfaceLoad;
use crate::muscle_dae::MuscleDae;
use crate::operators;
use crate::reading::snapshot::Snapshot;
use crate::statics::Equilibrium;
use operator::Balance;

pub use neighbors::Neighbors;

/// Complex amplitudes of the harmonic parts of loads and support motions: Re(amplitude e^{iωt}).
#[derive(Debug, Clone)]
pub struct Excitation {
    /// Forces of fixed direction at all nodal components, N.
    pub force: Vec<Complex64>,
    /// Unit loads on the deformed boundary, each with its amplitude.
    pub surface_loads: Vec<(SurfaceLoad, Complex64)>,
    /// Prescribed components of the nodal displacement with their amplitudes, m.
    pub displacement: Vec<(usize, Complex64)>,
}

impl Excitation {
    /// Returns whether all amplitudes are zero.
    pub fn is_zero(&self) -> bool {
        let loads = self.surface_loads.iter().map(|(_, amplitude)| amplitude);
        let displacement = self.displacement.iter().map(|(_, amplitude)| amplitude);
        let mut all = self.force.iter().chain(loads).chain(displacement);
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

/// Dynamic stiffness of a body about an equilibrium, and its harmonic loads.
pub struct DynamicStiffness {
    dae: MuscleDae,
    /// Displacement of all nodes at the equilibrium.
    u: Vec<f64>,
    /// Pressure at the equilibrium; empty for the formulation without pressure.
    p: Vec<f64>,
    /// Forces of the supports at the equilibrium.
    preload: Vec<f64>,
    /// Tension of each element.
    tensions: Vec<f64>,
    /// Time at which the loads are evaluated, s.
    t: f64,
    /// Harmonic forces at all nodal components.
    force: Vec<Complex64>,
    /// Harmonic motion of the supports, for all nodal components; zero for free components.
    supports: Vec<Complex64>,
}

/// Response of a body to its harmonic loads. Each frequency requires one factorization.
pub struct HarmonicResponse {
    stiffness: DynamicStiffness,
    plan: Arc<Condensation>,
    elimination: Arc<Elimination>,
    /// Matrices currently not used by any thread. Allocating a matrix costs as much as a factorization.
    matrices: Mutex<Vec<Factorized>>,
}

/// A matrix with the work counters of its factorizations and solves.
struct Factorized {
    matrix: Condensed<Complex64>,
    work: LinearWork,
}

impl DynamicStiffness {
    /// Linearizes `muscle` about the equilibrium `at`. The only relevant property of `formulation` is whether it has a
    /// pressure.
    ///
    /// # Errors
    /// Returns [`ModelError::Inverted`] if an element is inverted at the equilibrium.
    pub fn about(
        muscle: &Muscle,
        formulation: Formulation,
        at: &Equilibrium,
        drive: &Excitation,
    ) -> Result<Self, ModelError> {
        let muscle = match at.preload_time {
            Some(_) => muscle.clone(),
            None => Muscle { surface_loads: Vec::new(), ..muscle.under_part_of_loads(0.0) },
        };
        let t = at.preload_time.unwrap_or(0.0);
        let muscle = muscle.with_supports_at(t);
        let u = at.nodal_displacement(&muscle);
        let formulation = match (formulation.has(Field::Pressure), muscle.parameters.is_damped()) {
            (false, _) => Formulation::Displacement,
            (true, false) => Formulation::Position,
            (true, true) => Formulation::ImplicitRate,
        };
        let dae = MuscleDae::for_analysis(muscle, formulation);
        let p = match formulation.has(Field::Pressure) {
            true => at.pressure.clone(),
            false => Vec::new(),
        };
        let solid = &dae.muscle().solid;
        let mut force = drive.force.clone();
        force.resize(u.len(), Complex64::ZERO);
        for (load, amplitude) in &drive.surface_loads {
            let mut unit = operators::rest(solid);
            load.add_at(t, 1.0, &u, &mut unit);
            for (force, unit) in force.iter_mut().zip(unit) {
                *force += amplitude * unit;
            }
        }
        let mut supports = vec![Complex64::ZERO; u.len()];
        for &(component, amplitude) in &drive.displacement {
            supports[component] = amplitude;
        }
        let tensions = dae.muscle().tensions_at_rest(t);
        let preload = Vec::new();
        let mut stiffness = Self { dae, u, p, preload, tensions, t, force, supports };
        let y = stiffness.state();
        stiffness.preload = stiffness.dae.unbalanced_force(t, &y, &vec![0.0; y.len()])?;
        stiffness.dae.relax_overstress();
        Ok(stiffness)
    }

    /// Returns the displacement (m) at the equilibrium and the forces (N) of the supports, for all nodal components.
    pub fn preload(&self) -> (&[f64], &[f64]) {
        (&self.u, &self.preload)
    }

    /// Returns the unknowns at the equilibrium, where the overstress is relaxed.
    fn state(&self) -> Vec<f64> {
        let layout = self.dae.layout();
        let mut y = vec![0.0; layout.n_unknowns()];
        if let Some(range) = layout.range(Field::Displacement) {
            let free = self.dae.muscle().solid.dofs().free_to_full().iter();
            let free = free.map(|&i| self.u[i]);
            y[range].iter_mut().zip(free).for_each(|(q, u)| *q = u);
        }
        if let Some(range) = layout.range(Field::Pressure) {
            y[range].copy_from_slice(&self.p);
        }
        if let Some(range) = layout.range(Field::InternalStress) {
            y[range].copy_from_slice(&self.dae.muscle().solid.equilibrium_overstress(&self.u));
        }
        y
    }

    /// Evaluates the matrices of the equilibrium.
    fn update_matrices(&mut self) -> Result<(), ModelError> {
        let mut y = self.state();
        let n_internal = self.dae.muscle().solid.n_internal();
        y.truncate(y.len() - n_internal);
        let rest = vec![0.0; y.len()];
        Ok(self.dae.update_matrices(self.t, &y, &rest)?)
    }
}

impl HarmonicResponse {
    /// Linearizes `muscle` about the equilibrium `at`. The only relevant property of `formulation` is whether it has a
    /// pressure.
    ///
    /// # Errors
    /// Returns [`ModelError::Inverted`] if an element is inverted at the equilibrium, and the errors of the symbolic
    /// analysis.
    pub fn about(
        muscle: &Muscle,
        formulation: Formulation,
        at: &Equilibrium,
        drive: &Excitation,
    ) -> Result<Self, ModelError> {
        let mut stiffness = DynamicStiffness::about(muscle, formulation, at, drive)?;
        stiffness.update_matrices()?;
        let plan = Condensation::at_rest(&stiffness.dae);
        let elimination = plan.elimination(SparseOptions {
            ordering: Ordering::Amd,
            btf: false,
            ..SparseOptions::default()
        })?;
        Ok(Self {
            stiffness,
            plan: Arc::new(plan),
            elimination: Arc::new(elimination),
            matrices: Mutex::default(),
        })
    }

    /// Returns the dynamic stiffness, from which outputs are computed for given amplitudes.
    pub fn stiffness(&self) -> &DynamicStiffness {
        &self.stiffness
    }

    /// Returns the number of unknowns of each linear system.
    pub fn n_unknowns(&self) -> usize {
        self.plan.n_condensed()
    }

    /// Returns the numbers of factorizations and of solves so far.
    pub fn work(&self) -> [u64; 2] {
        let matrices = locked(&self.matrices);
        let sum = |of: fn(&LinearWork) -> u64| matrices.iter().map(|own| of(&own.work)).sum();
        [sum(|work| work.factorizations), sum(|work| work.solves)]
    }

    /// Predicts the memory and work of one factorization. Returns `None` for an external solver.
    pub fn prediction(&self) -> Option<Prediction> {
        self.elimination.prediction::<Complex64>()
    }

    /// Solves for each of the `frequencies` (Hz) and calls `read` with the amplitude. Returns pairs of frequency and
    /// result in the same order as `frequencies`. The frequencies are distributed among the threads of this process as
    /// far as memory permits; the results do not depend on the number of threads. If `read` returns
    /// [`ModelError::Interrupted`], the results obtained so far are returned.
    ///
    /// # Errors
    /// Returns [`ModelError::NotHeld`] if a frequency is 0 and the body can move without strain. Also fails if the
    /// factors exceed the memory, or if a factorization or `read` fails; the computation then ends.
    pub fn map<R: Send>(
        &self,
        frequencies: &[f64],
        read: impl Fn(&Amplitude) -> Result<R, ModelError> + Sync,
    ) -> Result<Vec<(f64, R)>, ModelError> {
        self.map_with_derivatives(frequencies, &[], |amplitude, _| read(amplitude))
    }

    /// Solves like [`map`](Self::map), and also for the derivatives of the amplitudes with respect to parameters. Each
    /// derivative costs one additional solve with the same factors, and a product with the matrix of each neighbor.
    ///
    /// An adjoint solve for each output could replace these solves, but not the products, which cost about four times
    /// as much. With 20 parameters and one output, it would save 17 % of the time (21 000 unknowns in 3D, 15 000 in
    /// 2D).
    ///
    /// # Errors
    /// Returns the same errors as [`map`](Self::map).
    pub fn map_with_derivatives<R: Send>(
        &self,
        frequencies: &[f64],
        neighbors: &[Neighbors],
        read: impl Fn(&Amplitude, &[Amplitude]) -> Result<R, ModelError> + Sync,
    ) -> Result<Vec<(f64, R)>, ModelError> {
        if frequencies.contains(&0.0) {
            expect_held(self.stiffness.dae.muscle())?;
        }
        let (kept, needed) =
            (locked(&self.matrices).len(), self.prediction().map_or(0, |one| one.bytes));
        if kept == 0 {
            resources::expect_memory(needed, 0)?;
        }
        let fitting = resources::available().map_or(usize::MAX, |free| free / needed.max(1));
        let max_tasks = frequencies.len().min(kept.saturating_add(fitting).max(1));
        let next = AtomicUsize::new(0);
        let results = Mutex::new(Vec::new());
        let work = || {
            let mut own = None;
            loop {
                let k = next.fetch_add(1, Relaxed);
                let Some(frequency) = frequencies.get(k) else {
                    return locked(&self.matrices).extend(own);
                };
                let matrix = own.get_or_insert_with(|| self.matrix());
                let s = Complex64::new(0.0, std::f64::consts::TAU * frequency);
                let result = self.solve(matrix, s).and_then(|found| {
                    let derivatives =
                        neighbors.iter().map(|near| self.derivative(matrix, &found, near));
                    read(&found, &derivatives.collect::<Result<Vec<_>, _>>()?)
                });
                if result.is_err() {
                    next.store(frequencies.len(), Relaxed);
                }
                locked(&results).push((k, result));
            }
        };
        match resources::threads() {
            None => work(),
            Some(pool) => pool.scope(|scope| {
                for _ in 0..pool.current_num_threads().min(max_tasks) {
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

    /// Returns a matrix that no other thread uses.
    fn matrix(&self) -> Factorized {
        let unused = locked(&self.matrices).pop();
        unused.unwrap_or_else(|| Factorized {
            matrix: Condensed::new(self.plan.clone(), self.elimination.clone()),
            work: LinearWork::default(),
        })
    }

    /// Solves for one value of s = iω.
    fn solve(&self, factorized: &mut Factorized, s: Complex64) -> Result<Amplitude, ModelError> {
        let Factorized { matrix, work } = factorized;
        matrix.forget_history()?;
        matrix.set_up(s, |values| self.stiffness.dae.matrix_values(values), work)?;
        let supports = &self.stiffness.supports;
        let still = vec![Complex64::ZERO; self.stiffness.p.len()];
        let moved = self.stiffness.unbalanced(s, supports, &still)?;
        self.balance(factorized, s, &moved, supports)
    }

    /// Solves for the free displacements and the pressures that cancel `unbalanced`. The matrix must already be
    /// factorized at `s`. At supported components, the result equals `supports`.
    fn balance(
        &self,
        factorized: &mut Factorized,
        s: Complex64,
        unbalanced: &Balance,
        supports: &[Complex64],
    ) -> Result<Amplitude, ModelError> {
        let dae = &self.stiffness.dae;
        let free_to_full = dae.muscle().solid.dofs().free_to_full();
        let layout = dae.layout();
        let mut x = vec![Complex64::ZERO; layout.n_unknowns()];
        for (row, &i) in x[layout.momentum()].iter_mut().zip(free_to_full) {
            *row = -unbalanced.force[i];
        }
        let pressures = layout.range(Field::Pressure).unwrap_or_default();
        for (row, volume) in x[pressures.clone()].iter_mut().zip(&unbalanced.volume) {
            *row = -volume;
        }
        factorized.matrix.solve(&mut x, &mut factorized.work)?;
        let mut displacement = supports.to_vec();
        let free = layout.range(Field::Displacement);
        let free = &x[free.expect("all formulations have q")];
        for (&i, value) in free_to_full.iter().zip(free) {
            displacement[i] = *value;
        }
        Ok(Amplitude { s, displacement, pressure: x[pressures].to_vec() })
    }

    /// Returns the derivative û' of the amplitude with respect to a parameter p, evaluated at the amplitude `at`. It
    /// follows from K û' = −∂(K û − f̂)/∂p.
    fn derivative(
        &self,
        factorized: &mut Factorized,
        at: &Amplitude,
        near: &Neighbors,
    ) -> Result<Amplitude, ModelError> {
        let mut supports = vec![Complex64::ZERO; at.displacement.len()];
        let mut change =
            Balance { force: supports.clone(), volume: vec![Complex64::ZERO; at.pressure.len()] };
        let add = |weight: f64, from: &[Complex64], to: &mut [Complex64]| {
            for (to, from) in to.iter_mut().zip(from) {
                *to += weight * from;
            }
        };
        for (weight, other) in near.weighted() {
            // The weights sum to zero.
            let mut moved = at.displacement.clone();
            add(1.0, &other.supports, &mut moved);
            add(-1.0, &self.stiffness.supports, &mut moved);
            let unbalanced = other.unbalanced(at.s, &moved, &at.pressure)?;
            add(weight, &unbalanced.force, &mut change.force);
            add(weight, &unbalanced.volume, &mut change.volume);
            add(weight, &other.supports, &mut supports);
        }
        self.balance(factorized, at.s, &change, &supports)
    }
}

impl DynamicStiffness {
    /// Returns the amplitudes (N) of the forces of the supports on the body at all nodal components. For free
    /// components, the amplitudes are zero up to rounding.
    ///
    /// # Errors
    /// Returns [`ModelError::Inverted`] if an element is inverted at the equilibrium.
    pub fn reactions(&self, at: &Amplitude) -> Result<Vec<Complex64>, ModelError> {
        Ok(self.unbalanced(at.s, &at.displacement, &at.pressure)?.force)
    }

    /// Returns the amplitudes of functions of the body's state. Each amplitude is the derivative of a function along
    /// the motion, computed by central differences. For linear functions, the derivatives are exact up to rounding;
    /// for smooth functions, their relative error is about 1e-9. Values without a derivative, such as a von Mises
    /// stress at rest, have no amplitude.
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

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Real or imaginary part of a motion and of its rates.
struct Part {
    displacement: Vec<f64>,
    velocity: Vec<f64>,
    acceleration: Vec<f64>,
    pressure: Vec<f64>,
    pressure_rate: Vec<f64>,
}

impl Amplitude {
    fn part(&self, part: fn(Complex64) -> f64) -> Part {
        let times = |factor: Complex64, amplitudes: &[Complex64]| {
            let products = amplitudes.iter().map(|z| part(factor * z));
            products.collect()
        };
        let value = |amplitudes: &[Complex64]| times(Complex64::ONE, amplitudes);
        let rate = |amplitudes: &[Complex64]| times(self.s, amplitudes);
        Part {
            displacement: value(&self.displacement),
            velocity: rate(&self.displacement),
            acceleration: times(self.s * self.s, &self.displacement),
            pressure: value(&self.pressure),
            pressure_rate: rate(&self.pressure),
        }
    }
}
