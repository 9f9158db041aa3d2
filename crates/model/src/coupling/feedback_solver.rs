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

use myovib_dae::{LinearSolver, Linearization, StepError};
use myovib_sparse::klu::KluOptions;
use myovib_sparse::{Number, SparseError};
use num_complex::Complex64;

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
    places: Vec<Local>,
}

impl FeedbackSolver {
    /// Lays out the elimination; `None` where a place acts beyond the elements that drive it.
    ///
    /// # Errors
    /// Those of the analysis.
    pub fn new(dae: &mut FeedbackDae, options: KluOptions) -> Result<Option<Self>, SparseError> {
        let (one_way, places, feedbacks) = dae.parts();
        let local = |place: &Place| Local::new(one_way, &feedbacks[place.feedback], place);
        let Some(places) = places.iter().map(local).collect() else {
            return Ok(None);
        };
        one_way.body_mut().coherence_matrices();
        let body = CondensedSolver::new(one_way.body(), options)?;
        let one_way = CoupledSolver::new(body, one_way, options)?;
        Ok(Some(Self { one_way, places }))
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
    let of_place = |place: &Place| along(place, &driven[dae.feedbacks()[place.feedback].network]);
    Ok(dae.places().iter().map(of_place).collect())
}

/// ∇gᵀ x for states x of the network.
fn along<T: Number>(place: &Place, x: &[T]) -> T {
    let terms = place.slopes().map(|(state, slope)| x[state] * slope);
    terms.fold(T::zero(), |sum, term| sum + term)
}

/// Takes what the right-hand sides of the oscillators do to the body.
fn feed_back<T: Number>(
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
    for place in dae.places() {
        let change = along(place, &alone[dae.feedbacks()[place.feedback].network]);
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
            let matrices = body.coherence_matrices();
            matrices.iter_mut().for_each(|values| values.fill(0.0));
            for ((local, place), parts) in locals.iter().zip(places).zip(&all[number]) {
                for (values, h) in matrices.iter_mut().zip(parts) {
                    local.subtract(*h, &place.force, values);
                }
            }
        };
        let body = one_way.body_mut();
        self.one_way.body.set_up_each(body, real, complex, prepare)
    }

    fn solve_real(&mut self, dae: &mut FeedbackDae, rhs: &mut [f64]) -> Result<(), StepError> {
        feed_back(&mut self.one_way.real, dae, rhs)?;
        let (one_way, ..) = dae.parts();
        self.one_way.solve_real(one_way, rhs)
    }

    fn solve_complex(
        &mut self,
        dae: &mut FeedbackDae,
        k: usize,
        rhs: &mut [Complex64],
    ) -> Result<(), StepError> {
        feed_back(&mut self.one_way.complex[k], dae, rhs)?;
        let (one_way, ..) = dae.parts();
        self.one_way.solve_complex(one_way, k, rhs)
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
