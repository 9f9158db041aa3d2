//! Two-way coupling: a muscle whose stiffness follows the coherence of its oscillators.
//!
//! The paper sketches it (section 1.3): a tissue is stiffer where its oscillators are out of step
//! and relaxes where they agree. Here the law's energy W is multiplied, at each point ξ, by
//!
//! ```text
//! 1 + Σ_k w_k(ξ) (g_k − 1),     g_k = g_∞ + (g_0 − g_∞) (1 − S_k),     S_k ≈ |χ|² of chain k,
//! ```
//!
//! with g_0 for oscillators out of step or at rest, g_∞ for coherent ones. The weights w_k say
//! where chain k acts: 1 in a region, or shares that sum to 1 everywhere (the paper's E(ξ, t)).
//! Damping follows the stiffness, β (∂P/∂F : ∇v + …); a change of g by itself gives no damping
//! stress. The Jacobian has one more block per chain, of rank one: ∂F/∂s = ∂F/∂g_k · (dg_k/dS_k
//! ∂S_k/∂s).

use myovib_dae::{Problem, StepError, VariableKind};
use myovib_oscillators::SmoothCoherence;
use nalgebra_sparse::pattern::SparsityPattern;

use super::dae::CoupledDae;
use crate::blocks::{Block, Blocks};
use crate::field::Field;
use crate::muscle_dae::MuscleDae;

/// What the coherence of one chain does to the stiffness around it.
#[derive(Debug, Clone)]
pub struct Feedback {
    /// Number of the network.
    pub network: usize,
    /// The measure of coherence.
    pub coherence: SmoothCoherence,
    /// g_0: the factor of the stiffness for oscillators out of step, or at rest.
    pub unsynchronised: f64,
    /// g_∞: the factor for oscillators in step.
    pub coherent: f64,
    /// w at the corners of each element.
    pub weights: Vec<f64>,
}

impl Feedback {
    /// g for the chain's state s = (y, ẏ).
    fn factor(&self, omega: &[f64], s: &[f64]) -> f64 {
        let (y, w) = s.split_at(omega.len());
        let apart = 1.0 - self.coherence.squared(omega, y, w);
        self.coherent + (self.unsynchronised - self.coherent) * apart
    }

    /// ∂g/∂s.
    fn gradient(&self, omega: &[f64], s: &[f64]) -> Vec<f64> {
        let (y, w) = s.split_at(omega.len());
        let mut gradient = vec![0.0; s.len()];
        let (by_position, by_velocity) = gradient.split_at_mut(omega.len());
        self.coherence
            .gradient(omega, y, w, by_position, by_velocity);
        let slope = self.coherent - self.unsynchronised;
        gradient.iter_mut().for_each(|entry| *entry *= slope);
        gradient
    }
}

/// A muscle with oscillators that act back on its stiffness.
#[derive(Debug, Clone)]
pub struct FeedbackDae {
    one_way: CoupledDae<MuscleDae>,
    feedbacks: Vec<Feedback>,
    /// The one-way system, then a block for each feedback.
    blocks: Blocks,
    one_way_values: Vec<f64>,
    factors: Vec<f64>,
    response: Vec<f64>,
}

impl FeedbackDae {
    /// Adds feedbacks to a system.
    ///
    /// # Panics
    /// When a feedback names a network that is not there, or has not one weight for each vertex of
    /// each element.
    pub fn new(one_way: CoupledDae<MuscleDae>, feedbacks: Vec<Feedback>) -> Self {
        let muscle = one_way.body();
        let space = muscle.muscle().solid.space();
        let n_factors = space.n_elements() * space.mesh().shape().n_vertices();
        for feedback in &feedbacks {
            assert!(feedback.network < one_way.n_networks(), "a known network");
            assert_eq!(feedback.weights.len(), n_factors, "weights at vertices");
        }
        let momentum = muscle
            .layout()
            .range(Field::Velocity)
            .expect("all formulations have v");
        let own = one_way.jacobian_pattern();
        let full = |columns: usize| {
            let offsets = (0..=columns).map(|c| c * momentum.len()).collect();
            let rows = (0..columns).flat_map(|_| 0..momentum.len()).collect();
            SparsityPattern::try_from_offsets_and_indices(columns, momentum.len(), offsets, rows)
                .expect("a full block is a valid pattern")
        };
        let patterns: Vec<SparsityPattern> = feedbacks
            .iter()
            .map(|feedback| full(one_way.range(feedback.network).len()))
            .collect();
        let mut placed = vec![Block::at(0, 0, &own)];
        placed.extend(feedbacks.iter().zip(&patterns).map(|(feedback, pattern)| {
            let columns = one_way.range(feedback.network);
            Block::at(momentum.start, columns.start, pattern)
        }));
        let n = one_way.n_unknowns();
        Self {
            blocks: Blocks::new((n, n), &placed),
            one_way_values: vec![0.0; own.nnz()],
            factors: vec![1.0; n_factors],
            response: vec![0.0; one_way.body_range().len()],
            one_way,
            feedbacks,
        }
    }

    /// The system without the feedback.
    pub fn one_way(&self) -> &CoupledDae<MuscleDae> {
        &self.one_way
    }

    /// The muscle with the stiffness that belongs to the state `y` of the whole system.
    pub fn muscle_at(&mut self, y: &[f64]) -> &mut MuscleDae {
        self.stiffen(y);
        self.one_way.body_mut()
    }

    /// g of each feedback.
    pub fn factors(&self, y: &[f64]) -> Vec<f64> {
        let factor = |feedback: &Feedback| {
            let network = self.one_way.oscillators(feedback.network).network();
            feedback.factor(network.omega(), &y[self.one_way.range(feedback.network)])
        };
        self.feedbacks.iter().map(factor).collect()
    }

    /// As [`CoupledDae::derivatives_at`].
    ///
    /// # Errors
    /// Those of the muscle's residual.
    pub fn derivatives_at(&mut self, t: f64, y: &[f64]) -> Result<(Vec<f64>, f64), StepError> {
        self.stiffen(y);
        self.one_way.derivatives_at(t, y)
    }

    /// Gives the muscle the stiffness that belongs to `y`.
    fn stiffen(&mut self, y: &[f64]) {
        let gains = self.factors(y);
        self.factors.fill(1.0);
        for (feedback, gain) in self.feedbacks.iter().zip(gains) {
            for (factor, weight) in self.factors.iter_mut().zip(&feedback.weights) {
                *factor += weight * (gain - 1.0);
            }
        }
        self.one_way.body_mut().set_factors(&self.factors);
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
        self.stiffen(y);
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
        self.stiffen(y);
        self.one_way
            .jacobian(t, y, y_dot, a, b, &mut self.one_way_values)?;
        values.fill(0.0);
        self.blocks.add(0, 1.0, &self.one_way_values, values);
        let body = self.one_way.body_range();
        let momentum = self
            .one_way
            .body()
            .layout()
            .range(Field::Velocity)
            .expect("all formulations have v");
        for (k, feedback) in self.feedbacks.iter().enumerate() {
            self.response.fill(0.0);
            self.one_way.body_mut().add_factor_response(
                t,
                &y[body.clone()],
                &feedback.weights,
                &mut self.response,
            )?;
            let network = self.one_way.oscillators(feedback.network).network();
            let states = &y[self.one_way.range(feedback.network)];
            let by_factor = &self.response[momentum.clone()];
            let block: Vec<f64> = feedback
                .gradient(network.omega(), states)
                .iter()
                .flat_map(|slope| by_factor.iter().map(move |force| slope * force))
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
