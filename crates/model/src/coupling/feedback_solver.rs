//! Newton systems of a body with oscillators that act back on it, the oscillators eliminated.
//!
//! With g the number that the coherence of a place sets, f = ∂F_b/∂g, and w the unknowns that make up
//! the displacement that drives it,
//!
//! ```text
//! ⎛ J_b      f ∇gᵀ ⎞ ⎛ δy ⎞   ⎛ b_b ⎞     (J_b − Σ h f wᵀ) δy = b_b − Σ f ∇gᵀ J_o⁻¹ b_o,
//! ⎝ γ e wᵀ   J_o   ⎠ ⎝ δs ⎠ = ⎝ b_o ⎠     h = ∇gᵀ J_o⁻¹ γ e.
//! ```
//!
//! One coherence for each place remains of all its oscillators: h, a number. A place that acts on the
//! elements that drive it changes the stiffness in places it has: nothing is filled in, and what is
//! factorised has the size of the body alone. h depends on c; as h = α + β c with real α and β it is a
//! stiffness and a damping.
//!
//! A place that acts elsewhere too would fill the stiffness: it is left to a matrix of low rank
//! ([`Apart`]).

use myovib_dae::{LinearSolver, Linearization, StepError};
use myovib_sparse::klu::KluOptions;
use myovib_sparse::{Number, SparseError};
use num_complex::Complex64;

use super::apart::Apart;
use super::dae::CoupledDae;
use super::effect::Feedback;
use super::feedback::FeedbackDae;
use super::reach::Place;
use super::solver::{CoupledSolver, NetworkFactors};
use crate::field::Field;
use crate::linear::CondensedSolver;
use crate::muscle_dae::MuscleDae;

/// Where f wᵀ of a place lies in the stiffness.
#[derive(Debug)]
struct Local {
    /// w.
    weights: Vec<f64>,
    /// For each of these the entries in its column, one for each row of f.
    entries: Vec<u32>,
}

impl Local {
    /// `None` where the stiffness has no room for it.
    fn new(one_way: &CoupledDae<MuscleDae>, feedback: &Feedback, place: &Place) -> Option<Self> {
        let body = one_way.body();
        let pattern = body.muscle().solid.displacement_pattern();
        let displacement = body.layout().range(Field::Displacement)?;
        let sources = one_way.oscillators(feedback.network).sources();
        if sources.len() != feedback.weights.len() {
            return None;
        }
        let (mut weights, mut entries) = (Vec::new(), Vec::new());
        for &(unknown, weight) in sources[place.number].unknowns() {
            if !displacement.contains(&unknown) {
                return None;
            }
            let column = unknown - displacement.start;
            weights.push(weight);
            for row in &place.rows {
                let within = pattern.lane(column).binary_search(row).ok()?;
                entries.push(u32::try_from(pattern.major_offsets()[column] + within).ok()?);
            }
        }
        Some(Self { weights, entries })
    }

    /// `values` −= h f wᵀ.
    fn subtract(&self, h: f64, force: &[f64], values: &mut [f64]) {
        let columns = self.entries.chunks(force.len().max(1)).zip(&self.weights);
        for (entries, weight) in columns {
            for (&entry, force) in entries.iter().zip(force) {
                values[entry as usize] -= h * weight * force;
            }
        }
    }
}

/// Solves the Newton systems of a [`FeedbackDae`] by those of its body.
#[derive(Debug)]
pub struct FeedbackSolver {
    one_way: CoupledSolver<CondensedSolver>,
    /// `None` for a place that acts beyond the elements that drive it.
    places: Vec<Option<Local>>,
    /// Those places, for the real matrix and for each complex one.
    real: Apart<f64>,
    complex: Vec<Apart<Complex64>>,
}

impl FeedbackSolver {
    /// Lays out the elimination.
    ///
    /// # Errors
    /// Those of the analysis.
    pub fn new(dae: &mut FeedbackDae, options: KluOptions) -> Result<Self, SparseError> {
        let (one_way, places, feedbacks) = dae.parts();
        let local = |place: &Place| Local::new(one_way, &feedbacks[place.feedback], place);
        let places: Vec<Option<Local>> = places.iter().map(local).collect();
        if places.iter().any(Option::is_some) {
            one_way.body_mut().coherence_matrices();
        }
        let body = CondensedSolver::new(one_way.body(), options)?;
        Ok(Self {
            one_way: CoupledSolver::new(body, one_way, options)?,
            places,
            real: Apart::default(),
            complex: Vec::new(),
        })
    }

    /// The numbers of the places that act beyond the elements that drive them.
    fn apart(&self) -> Vec<usize> {
        let places = self.places.iter().enumerate();
        let apart = places.filter(|(_, local)| local.is_none());
        apart.map(|(number, _)| number).collect()
    }

    /// Solves with the matrices as they are without the places apart.
    fn solve_local(&mut self, dae: &mut FeedbackDae, x: &mut [f64]) -> Result<(), StepError> {
        feed_back(&self.places, &mut self.one_way.real, dae, x)?;
        let (one_way, ..) = dae.parts();
        self.one_way.solve_real(one_way, x)
    }

    /// The same with complex matrix `k`.
    fn solve_local_complex(
        &mut self,
        dae: &mut FeedbackDae,
        k: usize,
        x: &mut [Complex64],
    ) -> Result<(), StepError> {
        feed_back(&self.places, &mut self.one_way.complex[k], dae, x)?;
        let (one_way, ..) = dae.parts();
        self.one_way.solve_complex(one_way, k, x)
    }
}

/// h of each place.
fn gains<T: Number>(
    factors: &mut NetworkFactors<T>,
    dae: &FeedbackDae,
) -> Result<Vec<T>, StepError> {
    let one_way = dae.one_way();
    let mut driven = Vec::new();
    for k in 0..one_way.n_networks() {
        let oscillators = one_way.oscillators(k);
        let mut x = vec![T::zero(); one_way.range(k).len()];
        for channel in 0..oscillators.network().n_channels() {
            for row in oscillators.network().forced_rows(channel) {
                x[row] = T::one() * oscillators.drive().gain;
            }
        }
        factors.solve_one(k, &mut x)?;
        driven.push(x);
    }
    let of_place = |place: &Place| place.along(&driven[dae.feedbacks()[place.feedback].network]);
    Ok(dae.places().iter().map(of_place).collect())
}

/// Takes what the right-hand sides of the oscillators do to the body, by the places that are local.
fn feed_back<T: Number>(
    places: &[Option<Local>],
    factors: &mut NetworkFactors<T>,
    dae: &FeedbackDae,
    rhs: &mut [T],
) -> Result<(), StepError> {
    let one_way = dae.one_way();
    let mut alone = Vec::new();
    for k in 0..one_way.n_networks() {
        let mut x = rhs[one_way.range(k)].to_vec();
        factors.solve_one(k, &mut x)?;
        alone.push(x);
    }
    let rows = &mut rhs[one_way.body().layout().momentum()];
    for (_, place) in places
        .iter()
        .zip(dae.places())
        .filter(|(local, _)| local.is_some())
    {
        let change = place.along(&alone[dae.feedbacks()[place.feedback].network]);
        for (&row, &force) in place.rows.iter().zip(&place.force) {
            rows[row] -= change * force;
        }
    }
    Ok(())
}

impl LinearSolver<FeedbackDae> for FeedbackSolver {
    fn evaluate(&mut self, dae: &mut FeedbackDae, at: &Linearization<'_>) -> Result<(), StepError> {
        dae.adapt(at.y);
        let (one_way, ..) = dae.parts();
        self.one_way.evaluate(one_way, at)?;
        dae.linearise(at.t, at.y)
    }

    fn set_up(
        &mut self,
        dae: &mut FeedbackDae,
        real: f64,
        complex: &[Complex64],
    ) -> Result<(), StepError> {
        self.one_way.set_up_networks(real, complex)?;
        // α and β of each place, for each matrix.
        let of_real = gains(&mut self.one_way.real, dae)?;
        let mut all: Vec<Vec<[f64; 2]>> = vec![of_real.iter().map(|h| [*h, 0.0]).collect()];
        for (factors, c) in self.one_way.complex.iter_mut().zip(complex) {
            let split = |h: Complex64| [h.re - h.im / c.im * c.re, h.im / c.im];
            all.push(gains(factors, dae)?.into_iter().map(split).collect());
        }
        let (one_way, places, _) = dae.parts();
        let locals = &self.places;
        let prepare = |number: usize, body: &mut MuscleDae| {
            if locals.iter().all(Option::is_none) {
                return;
            }
            let matrices = body.coherence_matrices();
            matrices.iter_mut().for_each(|values| values.fill(0.0));
            for ((local, place), parts) in locals.iter().zip(places).zip(&all[number]) {
                let Some(local) = local else { continue };
                for (values, h) in matrices.iter_mut().zip(parts) {
                    local.subtract(*h, &place.force, values);
                }
            }
        };
        let body = one_way.body_mut();
        self.one_way
            .body
            .set_up_each(body, real, complex, prepare)?;
        let apart = self.apart();
        self.real = Apart::new(&apart, dae, |dae, x| self.solve_local(dae, x))?;
        self.complex.clear();
        for k in 0..complex.len() {
            let solve =
                |dae: &mut FeedbackDae, x: &mut [Complex64]| self.solve_local_complex(dae, k, x);
            let matrix = Apart::new(&apart, dae, solve)?;
            self.complex.push(matrix);
        }
        Ok(())
    }

    fn solve_real(&mut self, dae: &mut FeedbackDae, rhs: &mut [f64]) -> Result<(), StepError> {
        self.solve_local(dae, rhs)?;
        self.real.correct(dae, rhs)
    }

    fn solve_complex(
        &mut self,
        dae: &mut FeedbackDae,
        k: usize,
        rhs: &mut [Complex64],
    ) -> Result<(), StepError> {
        self.solve_local_complex(dae, k, rhs)?;
        self.complex[k].correct(dae, rhs)
    }

    fn pivot_choices(&self) -> u64 {
        LinearSolver::<CoupledDae<MuscleDae>>::pivot_choices(&self.one_way)
    }

    fn forget_pivots(&mut self) {
        LinearSolver::<CoupledDae<MuscleDae>>::forget_pivots(&mut self.one_way);
    }

    fn history(&self) -> Vec<bool> {
        LinearSolver::<CoupledDae<MuscleDae>>::history(&self.one_way)
    }

    fn set_history(&mut self, history: &[bool]) -> Result<(), StepError> {
        LinearSolver::<CoupledDae<MuscleDae>>::set_history(&mut self.one_way, history)
    }
}
