//! Rod and oscillators of a scene.

use myovib_model::formula::{Formula, RampedSine};
use myovib_oscillators::{Ends, Reach};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::function::{Function, Shape};

/// The damped elastic rod of the paper's section 3.1, dimensionless.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct Rod {
    /// Length L.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub length: f64,
    /// Axial stiffness EA.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub stiffness: f64,
    /// Mass per length ρ.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub density: f64,
    /// Mass-proportional damping α, 1/s.
    #[schemars(range(min = 0))]
    pub alpha: f64,
    /// Stiffness-proportional damping β, s.
    #[schemars(range(min = 0))]
    pub beta: f64,
    /// Number of linear elements.
    #[schemars(range(min = 1, max = 1_000_000))]
    pub elements: usize,
    /// What τ is.
    pub reading: RodReading,
    /// τ(t), at the right end.
    pub load: Function,
}

/// What the load τ of a rod is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum RodReading {
    /// The strain u_x(L, t); the end force is EA (τ + β τ̇).
    Strain,
    /// The traction; the end force is EA τ.
    Traction,
}

impl Default for Rod {
    /// Section 3.1 of the paper.
    fn default() -> Self {
        Self {
            length: 0.1,
            stiffness: 1e6,
            density: 1e3,
            alpha: 0.25,
            beta: 1e-3,
            elements: 10,
            reading: RodReading::Strain,
            load: Function::Shape(Shape::Formula(Formula::RampedSine(RampedSine {
                amplitude: 1.0,
                frequency: 8.0,
                steepness: 10.0,
                shift: 8.0,
            }))),
        }
    }
}

/// A chain of van der Pol oscillators, (22) and (24).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct Chain {
    /// Name in output and for feedback.
    pub name: String,
    /// Number of oscillators N.
    #[schemars(range(min = 1, max = 1_000_000))]
    pub oscillators: usize,
    /// Centre of the natural frequencies, Hz.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub frequency: f64,
    /// Half width of the interval of the natural frequencies, rad/s.
    #[schemars(range(min = 0))]
    pub half_width: f64,
    /// Generator of the random frequencies.
    pub generator: GeneratorName,
    /// Seed of the generator.
    pub seed: u32,
    /// Van der Pol coefficient μ, 1/s.
    pub van_der_pol: f64,
    /// Duffing coefficient a, 1/s².
    pub duffing: f64,
    /// Neighbour coupling D, 1/s.
    pub coupling: f64,
    /// Ring or open chain.
    pub ends: EndsName,
    /// The oscillators that are driven.
    pub reach: ReachName,
    /// Gain γ of the forcing γ d·u, 1/s² per m.
    pub gain: f64,
    /// Where the displacement drives the chain: a point, m, or a position of the rod. A list of
    /// points, a grid, or the elements or vertices of a group make a chain at each [default: not
    /// driven].
    pub at: Option<Place>,
    /// The displacement that drives the chain, d·u.
    pub component: Component,
    /// For each place of the chain, |χ| of all oscillators within this distance, m, becomes a
    /// field.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub neighbourhood: Option<f64>,
    /// Initial position of all oscillators; they start without velocity.
    pub initial: f64,
}

impl Default for Chain {
    /// Section 3.1 of the paper with 20 oscillators; γ = 1.
    fn default() -> Self {
        Self {
            name: "chain".to_owned(),
            oscillators: 20,
            frequency: 8.0,
            half_width: 0.05,
            generator: GeneratorName::Matlab,
            seed: 5489,
            van_der_pol: 2.0,
            duffing: 0.0,
            coupling: 3.0,
            ends: EndsName::Periodic,
            reach: ReachName::All,
            gain: 1.0,
            at: None,
            component: Component::Named(ComponentName::Y),
            neighbourhood: None,
            initial: 0.0,
        }
    }
}

/// A place in the body or on the rod, or many places in the body.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Place {
    /// A point of the muscle, m.
    Point(#[schemars(length(min = 2, max = 3))] Vec<f64>),
    /// A chain at each of these points, m.
    Points(#[schemars(length(min = 1))] Vec<Vec<f64>>),
    /// A chain in each element of a physical group, whose coherence |χ| becomes a field of the elements.
    Elements {
        /// The group.
        elements: String,
    },
    /// A chain at each vertex of a physical group: of points, of the boundary, or of elements.
    Vertices {
        /// The group.
        vertices: String,
    },
    /// A chain at each point of a grid that lies in the muscle.
    Grid {
        /// First corner of the grid, m.
        #[schemars(length(min = 2, max = 3))]
        from: Vec<f64>,
        /// Last corner, m.
        #[schemars(length(min = 2, max = 3))]
        to: Vec<f64>,
        /// Number of points along each axis; a single one lies in the middle.
        #[schemars(length(min = 2, max = 3), inner(range(min = 1, max = 1_000_000)))]
        points: Vec<usize>,
    },
    /// A position on the rod, from 0 to its length.
    Position(f64),
}

/// The direction d: a name, or a vector of any length.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Component {
    /// A coordinate, or along the fibre.
    Named(ComponentName),
    /// A vector of any length but zero; d has length 1.
    Along(#[schemars(length(min = 2, max = 3))] Vec<f64>),
}

/// Directions with a name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum ComponentName {
    /// Along the muscle.
    X,
    /// Across.
    Y,
    /// The third one, in space.
    Z,
    /// Along the fibre at the place.
    Fibre,
}

/// Generators of random numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum GeneratorName {
    /// MT19937 with 53-bit doubles, as MATLAB's `rand`.
    Matlab,
    /// ChaCha with 8 rounds.
    ChaCha8,
}

/// Ends of a chain.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum EndsName {
    /// A ring.
    Periodic,
    /// First and last have one neighbour.
    Open,
}

impl From<EndsName> for Ends {
    fn from(name: EndsName) -> Self {
        match name {
            EndsName::Periodic => Self::Periodic,
            EndsName::Open => Self::Open,
        }
    }
}

/// The oscillators that are driven.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum ReachName {
    /// All.
    All,
    /// The first and the last.
    Boundary,
}

impl From<ReachName> for Reach {
    fn from(name: ReachName) -> Self {
        match name {
            ReachName::All => Self::All,
            ReachName::Boundary => Self::Boundary,
        }
    }
}
