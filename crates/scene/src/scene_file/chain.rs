//! Rod and oscillators of a scene.

use std::f64::consts::TAU;

use myovib_model::formula::{Formula, RampedSine};
use myovib_oscillators::{Ends, Generator, Reach};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::function::{Function, Shape};
use super::response::Amplitude;

/// Dimensionless damped elastic rod of section 3.1 of the paper.
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
    pub rayleigh_mass: f64,
    /// Stiffness-proportional damping β, s.
    #[schemars(range(min = 0))]
    pub rayleigh_stiffness: f64,
    /// Number of linear elements.
    #[schemars(range(min = 1, max = 1_000_000))]
    pub elements: usize,
    /// Meaning of the load.
    pub load_type: RodLoadType,
    /// Load τ(t) at the right end.
    pub load: Function,
    /// Harmonic part of τ in a response.
    pub response: Option<Amplitude>,
}

/// Meaning of the load τ of a rod.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum RodLoadType {
    /// Strain u_x(L, t); the end force is EA (τ + β τ̇).
    Strain,
    /// Traction; the end force is EA τ.
    Traction,
}

impl Default for Rod {
    /// Returns the values of section 3.1 of the paper.
    fn default() -> Self {
        Self {
            length: 0.1,
            stiffness: 1e6,
            density: 1e3,
            rayleigh_mass: 0.25,
            rayleigh_stiffness: 1e-3,
            elements: 10,
            load_type: RodLoadType::Strain,
            load: Function::Shape(Shape::Formula(Formula::RampedSine(RampedSine {
                amplitude: 1.0,
                frequency: 8.0,
                steepness: 10.0,
                shift: 8.0,
            }))),
            response: None,
        }
    }
}

/// Chain of van der Pol oscillators, equations (22) and (24) of the paper, driven by the displacement of the body.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct Chain {
    /// Name in output files and feedback.
    pub name: String,
    /// Number of oscillators N.
    #[schemars(range(min = 1, max = 1_000_000))]
    pub oscillators: usize,
    /// Center ω/2π of the natural frequencies without coupling, Hz. In a ring that oscillates in phase, ω² − D ω
    /// replaces ω².
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub frequency: f64,
    /// Half the width of the frequency interval, Hz.
    #[schemars(range(min = 0))]
    pub frequency_spread: f64,
    /// Random number generator for the frequencies.
    pub generator: Generator,
    /// Seed of the generator.
    pub seed: u32,
    /// Van der Pol coefficient μ, 1/s.
    pub van_der_pol: f64,
    /// Duffing coefficient a, 1/s².
    pub duffing: f64,
    /// Coupling D of neighbors, 1/s.
    pub coupling: f64,
    /// Connection of the ends.
    pub ends: Ends,
    /// Oscillators that are driven.
    pub driven: Reach,
    /// Gain γ of the forcing γ d·u, 1/s² per m. An isolated oscillator follows a harmonic u at a frequency that differs
    /// from its natural frequency by Δω if γ |u| exceeds about 4 ω Δω.
    pub gain: f64,
    /// Location of the driving displacement: a point, m, or a position on the rod [default: not driven]. Lists,
    /// grids and groups create several chains.
    pub at: Option<Place>,
    /// Direction d of the driving displacement d·u.
    pub component: Component,
    /// Radius of the neighborhood whose |χ| is written as a field, m.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub coherence_radius: Option<f64>,
    /// Initial position of all oscillators, which start at rest.
    pub initial: f64,
}

impl Default for Chain {
    /// Returns the values of section 3.1 of the paper with 20 oscillators and γ = 1.
    fn default() -> Self {
        Self {
            name: "chain".to_owned(),
            oscillators: 20,
            frequency: 8.0,
            frequency_spread: 0.05 / TAU,
            generator: Generator::Matlab,
            seed: 5489,
            van_der_pol: 2.0,
            duffing: 0.0,
            coupling: 3.0,
            ends: Ends::Periodic,
            driven: Reach::All,
            gain: 1.0,
            at: None,
            component: Component::Named(ComponentName::Y),
            coherence_radius: None,
            initial: 0.0,
        }
    }
}

/// Location of one or many chains.
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
    /// A chain at each vertex of a physical group of points, boundary facets or elements.
    Vertices {
        /// The group.
        vertices: String,
    },
    /// A chain at each grid point inside the muscle.
    Grid {
        /// First corner of the grid, m.
        #[schemars(length(min = 2, max = 3))]
        from: Vec<f64>,
        /// Last corner, m.
        #[schemars(length(min = 2, max = 3))]
        to: Vec<f64>,
        /// Number of points along each axis; a single point is centered.
        #[schemars(length(min = 2, max = 3), inner(range(min = 1, max = 1_000_000)))]
        points: Vec<usize>,
    },
    /// A position on the rod, from 0 to its length.
    Position(f64),
}

/// Direction, given by a name or by a vector of any length.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Component {
    /// The direction of a coordinate or of the fibers.
    Named(ComponentName),
    /// A nonzero vector; only its direction matters.
    Along(#[schemars(length(min = 2, max = 3))] Vec<f64>),
}

/// Named directions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum ComponentName {
    /// First coordinate.
    X,
    /// Second coordinate.
    Y,
    /// Third coordinate.
    Z,
    /// Local fiber direction.
    Fiber,
}
