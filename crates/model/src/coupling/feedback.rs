//! Two-way coupling: a muscle whose stiffness or tension follows the coherence of its oscillators.
//!
//! The paper outlines this coupling in section 1.3: tissue stiffens where its oscillators are out of phase and relaxes
//! where they are in phase. Here, the energy W of the law is multiplied at each point ξ by
//!
//! ```text
//! 1 + Σ_k w_k(ξ) (g_k − 1),     g_k = g_∞ + (g_0 − g_∞) (1 − S_k),     S_k ≈ |χ|² of place k,
//! ```
//!
//! with g_0 at zero coherence (or at rest) and g_∞ at full coherence. The weight w_k defines where place k acts.
//! Either it is 1 in a region, or the weights of all places sum to 1 everywhere (the paper's E(ξ, t)). Damping scales
//! with the stiffness, β (∂P/∂F : ∇v + …), but the rate of g causes no damping stress. Similarly, the tension along
//! the fibers is T = Σ_k w_k T_k with T_k = T_0 + (T_1 − T_0) S_k.
//!
//! A network is one chain at a single place, or many chains at many places. For each place, the Jacobian has an
//! additional rank-one block: ∂F/∂s = ∂F/∂g_k · (dg_k/dS_k ∂S_k/∂s). [`FeedbackSolver`] eliminates these blocks.
//!
//! [`FeedbackSolver`]: super::feedback_solver::FeedbackSolver

use myovib_dae::{Problem, StepError, VariableKind};
use nalgebra_sparse::pattern::SparsityPattern;

use super::dae::CoupledDae;
use super::effect::{Effect, Feedback};
use super::reach::{Place, Places};
use crate::blocks::{Block, Blocks};
use crate::error::ModelError;
use crate::muscle_dae::MuscleDae;
use crate::start::Consistent;

/// A muscle with oscillators that also act on the muscle.
#[derive(Debug, Clone)]
pub struct FeedbackDae {
    one_way: CoupledDae<MuscleDae>,
    feedbacks: Vec<Feedback>,
    places: Places,
    /// The one-way system, then one block per feedback.
    blocks: Blocks,
    one_way_values: Vec<f64>,
    /// For each effect, the values of the body that the effect sets; empty for an effect without feedback.
    numbers: [(Effect, Vec<f64>); 2],
}

impl FeedbackDae {
    /// Adds feedbacks to a system.
    ///
    /// # Panics
    /// Panics if a feedback refers to a network or value that does not exist, or if the places of a
    /// network have different numbers of oscillators.
    pub fn new(one_way: CoupledDae<MuscleDae>, feedbacks: Vec<Feedback>) -> Self {
        let body = one_way.body();
        let solid = &body.muscle().solid;
        for feedback in &feedbacks {
            assert!(feedback.network < one_way.n_networks(), "a known network");
            let network = one_way.oscillators(feedback.network).network();
            let places = feedback.weights.len();
            assert_eq!(
                network.n_oscillators() % places,
                0,
                "equally many oscillators at each place"
            );
            let mut weighed = feedback.weights.iter().flatten();
            let count = feedback.effect.numbers(solid);
            assert!(weighed.all(|(i, _)| *i < count), "a known number");
        }
        let numbers = [Effect::Stiffness, Effect::Tension].map(|effect| {
            let any = feedbacks.iter().any(|feedback| feedback.effect == effect);
            let count = if any { effect.numbers(solid) } else { 0 };
            (effect, vec![0.0; count])
        });
        let places = Places::new(&one_way, &feedbacks);
        let n_rows = body.layout().momentum().len();
        let patterns: Vec<SparsityPattern> = (0..feedbacks.len())
            .map(|k| {
                let columns = one_way.range(feedbacks[k].network).len();
                let mut rows_of = vec![&[][..]; columns];
                for place in places.list.iter().filter(|place| place.feedback == k) {
                    for (state, _) in place.slopes() {
                        rows_of[state] = &place.rows;
                    }
                }
                let ends = rows_of.iter().scan(0, |end, rows| {
                    *end += rows.len();
                    Some(*end)
                });
                let offsets = std::iter::once(0).chain(ends).collect();
                SparsityPattern::try_from_offsets_and_indices(
                    columns,
                    n_rows,
                    offsets,
                    rows_of.concat(),
                )
                .expect("the rows of a place are sorted")
            })
            .collect();
        let own = one_way.jacobian_pattern();
        let mut placed = vec![Block::at(0, 0, &own)];
        placed.extend(feedbacks.iter().zip(&patterns).map(|(feedback, pattern)| {
            let columns = one_way.range(feedback.network);
            Block::at(body.layout().momentum().start, columns.start, pattern)
        }));
        let n = one_way.n_unknowns();
        Self {
            blocks: Blocks::new((n, n), &placed),
            one_way_values: vec![0.0; own.nnz()],
            numbers,
            places,
            one_way,
            feedbacks,
        }
    }

    /// Returns the system without feedback.
    pub fn one_way(&self) -> &CoupledDae<MuscleDae> {
        &self.one_way
    }

    /// Returns the feedbacks.
    pub fn feedbacks(&self) -> &[Feedback] {
        &self.feedbacks
    }

    /// Returns the muscle with stiffness and tensions set for the state `y` of the coupled system.
    pub fn muscle_at(&mut self, y: &[f64]) -> &mut MuscleDae {
        self.adapt(y);
        self.one_way.body_mut()
    }

    /// Returns g of each feedback, averaged over its places.
    pub fn factors(&self, y: &[f64]) -> Vec<f64> {
        let mut means = vec![0.0; self.feedbacks.len()];
        for (place, gain) in self.places.list.iter().zip(self.gains(y)) {
            let count = self.feedbacks[place.feedback].weights.len();
            means[place.feedback] += gain / count as f64;
        }
        means
    }

    /// Computes [`CoupledDae::derivatives_at`] with the stiffness and tensions of the muscle set for `y`.
    pub fn derivatives_at(&mut self, t: f64, y: &[f64]) -> Result<(Vec<f64>, f64), StepError> {
        self.adapt(y);
        self.one_way.derivatives_at(t, y)
    }

    /// Returns g of each place.
    fn gains(&self, y: &[f64]) -> impl Iterator<Item = f64> {
        self.places.list.iter().map(|place| {
            let feedback = &self.feedbacks[place.feedback];
            let network = self.one_way.oscillators(feedback.network).network();
            let states = &y[self.one_way.range(feedback.network)];
            place.gain(feedback, network.omega(), states)
        })
    }

    /// Sets the stiffness and tensions of the muscle for the state `y`.
    pub(super) fn adapt(&mut self, y: &[f64]) {
        let gains: Vec<f64> = self.gains(y).collect();
        for (effect, numbers) in &mut self.numbers {
            if numbers.is_empty() {
                continue;
            }
            numbers.fill(effect.elsewhere());
            for (place, gain) in self.places.list.iter().zip(&gains) {
                let feedback = &self.feedbacks[place.feedback];
                if feedback.effect == *effect {
                    for &(i, weight) in &feedback.weights[place.number] {
                        numbers[i] += weight * (gain - effect.elsewhere());
                    }
                }
            }
            let body = self.one_way.body_mut();
            match effect {
                Effect::Stiffness => body.set_factors(numbers),
                Effect::Tension => body.set_tensions(numbers),
            }
        }
    }

    /// Evaluates ∂F/∂g and ∂g/∂s of all places at the state `y`.
    pub(super) fn linearize(&mut self, t: f64, y: &[f64]) -> Result<(), StepError> {
        let places = &mut self.places;
        places.linearize(&mut self.one_way, &self.feedbacks, t, y)
    }

    /// Returns the system without feedback, the places as of the last [`linearize`](Self::linearize), and the
    /// feedbacks.
    pub(super) fn parts(&mut self) -> (&mut CoupledDae<MuscleDae>, &[Place], &[Feedback]) {
        (&mut self.one_way, &self.places.list, &self.feedbacks)
    }

    pub(super) fn places(&self) -> &[Place] {
        &self.places.list
    }
}

impl Consistent for FeedbackDae {
    fn consistent(&mut self, t: f64, y: &[f64]) -> Result<[Vec<f64>; 2], ModelError> {
        self.adapt(y);
        self.one_way.consistent(t, y)
    }
}

impl Problem for FeedbackDae {
    fn n_unknowns(&self) -> usize {
        self.one_way.n_unknowns()
    }

    fn residual(
        &mut self,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
        residual: &mut [f64],
    ) -> Result<(), StepError> {
        self.adapt(y);
        self.one_way.residual(t, y, y_dot, residual)
    }

    fn jacobian_pattern(&self) -> SparsityPattern {
        self.blocks.pattern().clone()
    }

    fn jacobian(
        &mut self,
        t: f64,
        y: &[f64],
        y_dot: &[f64],
        a: f64,
        b: f64,
        values: &mut [f64],
    ) -> Result<(), StepError> {
        self.adapt(y);
        self.one_way.jacobian(t, y, y_dot, a, b, &mut self.one_way_values)?;
        values.fill(0.0);
        self.blocks.add(0, 1.0, &self.one_way_values, values);
        self.linearize(t, y)?;
        for (k, feedback) in self.feedbacks.iter().enumerate() {
            let mut columns = vec![(0.0, &[][..]); self.one_way.range(feedback.network).len()];
            for place in self.places.list.iter().filter(|place| place.feedback == k) {
                for (state, slope) in place.slopes() {
                    columns[state] = (slope, &place.force);
                }
            }
            let block: Vec<f64> = columns
                .into_iter()
                .flat_map(|(slope, forces)| forces.iter().map(move |force| slope * force))
                .collect();
            self.blocks.add(1 + k, a, &block, values);
        }
        Ok(())
    }

    fn kinds(&self) -> Option<Vec<VariableKind>> {
        self.one_way.kinds()
    }

    fn indices(&self) -> Option<Vec<u8>> {
        self.one_way.indices()
    }

    fn component_name(&self, i: usize) -> String {
        self.one_way.component_name(i)
    }
}
