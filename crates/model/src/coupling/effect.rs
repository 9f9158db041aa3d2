//! Effect of the oscillators' coherence on the surrounding body; the formulas are in `feedback`.

use myovib_fem::Solid;
use myovib_oscillators::SmoothCoherence;

/// Property of the body that the coherence changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Effect {
    /// Factor of the law's energy: one value per corner of each element.
    Stiffness,
    /// Tension of active stresses that [follow a coherence](crate::Activation::Coherence), Pa: one
    /// value per element.
    Tension,
}

impl Effect {
    pub(super) fn numbers_per_element(self, solid: &Solid) -> usize {
        match self {
            Self::Stiffness => solid.space().mesh().shape().n_vertices(),
            Self::Tension => 1,
        }
    }

    pub(super) fn numbers(self, solid: &Solid) -> usize {
        self.numbers_per_element(solid) * solid.space().n_elements()
    }

    /// Returns the value at points on which no place acts.
    pub(super) fn elsewhere(self) -> f64 {
        match self {
            Self::Stiffness => 1.0,
            Self::Tension => 0.0,
        }
    }
}

/// Effect of the coherence of one network on the surrounding body.
#[derive(Debug, Clone)]
pub struct Feedback {
    /// Index of the network.
    pub network: usize,
    /// Measure of coherence.
    pub coherence: SmoothCoherence,
    /// Property that the coherence changes.
    pub effect: Effect,
    /// g_0 or T_0: stiffness factor or tension at zero coherence.
    pub unsynchronized: f64,
    /// g_∞ or T_1: stiffness factor or tension at full coherence.
    pub coherent: f64,
    /// For each place of the network, the index and weight w of each value that the place affects, ordered by element.
    /// All places have the same number of oscillators.
    pub weights: Vec<Vec<(usize, f64)>>,
}

impl Feedback {
    /// Converts an array with one weight per value to the weights of a single place.
    pub fn of_one_place(weights: &[f64]) -> Vec<Vec<(usize, f64)>> {
        let weights = weights.iter().copied().enumerate();
        vec![weights.filter(|(_, weight)| *weight != 0.0).collect()]
    }
}
