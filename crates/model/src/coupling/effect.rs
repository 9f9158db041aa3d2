//! What the coherence of oscillators does to the body around them; `feedback` has the formulas.

use myovib_fem::Solid;
use myovib_oscillators::SmoothCoherence;

/// What a coherence changes in the body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Effect {
    /// The factor of the law's energy: numbers at the corners of each element.
    Stiffness,
    /// The tension of active stresses that [follow a coherence](crate::Activation::Coherence), Pa:
    /// one number for each element.
    Tension,
}

impl Effect {
    /// How many numbers an element has.
    pub(super) fn numbers_per_element(self, solid: &Solid) -> usize {
        match self {
            Self::Stiffness => solid.space().mesh().shape().n_vertices(),
            Self::Tension => 1,
        }
    }

    /// How many numbers all elements have.
    pub(super) fn numbers(self, solid: &Solid) -> usize {
        self.numbers_per_element(solid) * solid.space().n_elements()
    }

    /// What a number is where no place acts.
    pub(super) fn elsewhere(self) -> f64 {
        match self {
            Self::Stiffness => 1.0,
            Self::Tension => 0.0,
        }
    }
}

/// What the coherence of one network does to the body around it.
#[derive(Debug, Clone)]
pub struct Feedback {
    /// Number of the network.
    pub network: usize,
    /// The measure of coherence.
    pub coherence: SmoothCoherence,
    /// What it changes.
    pub effect: Effect,
    /// g_0 or T_0: the factor of the stiffness, or the tension, for oscillators out of step, or at rest.
    pub unsynchronised: f64,
    /// g_∞ or T_1: the same for oscillators in step.
    pub coherent: f64,
    /// For each place of the network, which has as many oscillators as the others, w of the numbers it
    /// acts on: those of its elements, in the order of the elements.
    pub weights: Vec<Vec<(usize, f64)>>,
}

impl Feedback {
    /// The weights of a single place, one for each number.
    pub fn of_one_place(weights: &[f64]) -> Vec<Vec<(usize, f64)>> {
        let weights = weights.iter().copied().enumerate();
        vec![weights.filter(|(_, weight)| *weight != 0.0).collect()]
    }
}
